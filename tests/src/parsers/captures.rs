//! The files of captures, each in a folder with the others.

use std::fs;
use std::path::Path;

use glam::{DAffine3, DMat4};
use inplace_core::scene::Trajectory;

use super::{Parser, SIZE, assert_sentence, make, opened, write};

/// The pose of a camera that looks along z from x: four lines of four numbers.
fn pose(x: u32) -> String {
    format!("1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
}

/// The same in a line.
fn pose_line(x: u32) -> String {
    pose(x).replace('\n', " ") + "\n"
}

pub(super) fn write_color(path: &Path) {
    let [width, height] = SIZE;
    let bytes = vec![90; 3 * (width * height) as usize];
    image::save_buffer(path, &bytes, width, height, image::ColorType::Rgb8).expect("an image");
}

fn write_depth(path: &Path) {
    let [width, height] = SIZE;
    let bytes: Vec<u8> = (0..width * height).flat_map(|_| 2000_u16.to_ne_bytes()).collect();
    image::save_buffer(path, &bytes, width, height, image::ColorType::L16).expect("an image");
}

/// Checks what opening a capture makes of files with these paths in its folder and these contents.
fn check_files<const N: usize>(folder: &Path, names: [impl AsRef<Path>; N], contents: [&[u8]; N]) {
    for (name, bytes) in names.iter().zip(contents) {
        write(&folder.join(name), bytes);
    }
    opened::check(folder);
}

/// Two frames in the Replica layout, with depth.
fn write_replica(folder: &Path) {
    make(folder, &["rgb", "depth"]);
    for number in 0..2 {
        write_color(&folder.join(format!("rgb/rgb_{number}.png")));
        write_depth(&folder.join(format!("depth/depth_{number}.png")));
    }
    let poses = [0, 1].map(pose_line).concat();
    write(&folder.join("traj_w_c.txt"), poses.as_bytes());
}

pub(super) const REPLICA_POSES: Parser = Parser::new("replica_poses", write_replica, |folder, bytes| {
    check_files(folder, ["traj_w_c.txt"], [bytes]);
});

pub(super) const INTRINSICS: Parser = Parser::new("intrinsics", write_replica, |folder, bytes| {
    check_files(folder, ["intrinsics.txt"], [bytes]);
});

pub(super) const TRANSFORMS: Parser = Parser {
    name: "transforms",
    prepare: |folder| {
        make(folder, &["images"]);
        for name in ["a.png", "b.png", "images/a.png", "images/c.png"] {
            write_color(&folder.join(name));
        }
        write_depth(&folder.join("d.png"));
        link_images(&folder.join("images"));
    },
    check: |folder, bytes| check_files(folder, ["transforms.json"], [bytes]),
};

/// A link to the image `a.png` beside it, and one to nothing.
fn link_images(folder: &Path) {
    #[cfg(unix)]
    for (name, target) in [("link.png", "a.png"), ("gone.png", "none.png")] {
        std::os::unix::fs::symlink(target, folder.join(name)).expect("the temporary folder can be written");
    }
    #[cfg(not(unix))]
    write_color(&folder.join("link.png"));
}

fn write_images(folder: &Path) {
    make(folder, &["images/sub", "sparse/0"]);
    for name in ["a.png", "b.png", "sub/a.png"] {
        write_color(&folder.join("images").join(name));
    }
    link_images(&folder.join("images"));
}

/// The files of a model.
fn model(ending: &str) -> [String; 3] {
    ["cameras", "images", "points3D"].map(|name| format!("sparse/0/{name}.{ending}"))
}

/// The three files one after another, the lengths of the first two (u16, little endian) before them.
pub(super) const COLMAP_BINARY: Parser = Parser::new("colmap_binary", write_images, |folder, bytes| {
    let Some((lengths, rest)) = bytes.split_first_chunk::<4>() else {
        return;
    };
    let [a, b, c, d] = *lengths;
    let (cameras, rest) = rest.split_at(rest.len().min(u16::from_le_bytes([a, b]).into()));
    let (images, points) = rest.split_at(rest.len().min(u16::from_le_bytes([c, d]).into()));
    let contents = [cameras, images, points];
    check_files(folder, model("bin"), contents);
});

/// The three files with a zero byte between them.
pub(super) const COLMAP_TEXT: Parser = Parser::new("colmap_text", write_images, |folder, bytes| {
    check_files(folder, model("txt"), parts(bytes));
});

/// What is between the zero bytes; empty where there are fewer parts.
fn parts<const N: usize>(bytes: &[u8]) -> [&[u8]; N] {
    let mut parts = bytes.splitn(N, |&byte| byte == 0);
    [(); N].map(|()| parts.next().unwrap_or_default())
}

/// `rgb.txt`, `depth.txt` and `groundtruth.txt` with a zero byte between them.
pub(super) const TUM: Parser = Parser {
    name: "tum",
    prepare: |folder| {
        make(folder, &["rgb", "depth"]);
        for time in ["1.0", "2.0"] {
            write_color(&folder.join(format!("rgb/{time}.png")));
            write_depth(&folder.join(format!("depth/{time}.png")));
        }
        // Else the size of the images must be that of the benchmark's.
        write(&folder.join("intrinsics.txt"), b"4 4 4 3 8 6");
    },
    check: |folder, bytes| {
        check_files(folder, ["rgb.txt", "depth.txt", "groundtruth.txt"], parts(bytes));
    },
};

pub(super) const SEVEN_SCENES: Parser = Parser {
    name: "seven_scenes",
    prepare: |folder| {
        write(&folder.join("intrinsics.txt"), b"4 4 4 3 8 6");
        for number in 0..2 {
            write_color(&folder.join(format!("frame-00000{number}.color.png")));
            write_depth(&folder.join(format!("frame-00000{number}.depth.png")));
            let path = folder.join(format!("frame-00000{number}.pose.txt"));
            write(&path, pose(0).as_bytes());
        }
    },
    check: |folder, bytes| check_files(folder, ["frame-000000.pose.txt"], [bytes]),
};

/// `intrinsic_color.txt`, `intrinsic_depth.txt`, `extrinsic_color.txt` and the pose of a frame with a zero byte between
/// them; the second is left out where it is empty.
pub(super) const SCANNET: Parser = Parser {
    name: "scannet",
    prepare: |folder| {
        make(folder, &["color", "depth", "intrinsic", "pose"]);
        for number in 0..2 {
            write_color(&folder.join(format!("color/{number}.png")));
            write_depth(&folder.join(format!("depth/{number}.png")));
            write(
                &folder.join(format!("pose/{number}.txt")),
                pose(number).as_bytes(),
            );
        }
    },
    check: |folder, bytes| {
        let [color, depth, extrinsic, pose] = parts(bytes);
        let depth_path = folder.join("intrinsic/intrinsic_depth.txt");
        if depth.is_empty() {
            // It may be there from the check before.
            let _ = fs::remove_file(depth_path);
        } else {
            write(&depth_path, depth);
        }
        let names = [
            "intrinsic/intrinsic_color.txt",
            "intrinsic/extrinsic_color.txt",
            "pose/0.txt",
        ];
        check_files(folder, names, [color, extrinsic, pose]);
    },
};

/// The path, and after a zero byte the intrinsics of its camera.
pub(super) const CAMERA_PATH: Parser = Parser::alone("camera_path", |folder, bytes| {
    let [path_bytes, intrinsics_bytes] = parts(bytes);
    let (path, intrinsics) = (folder.join("path"), folder.join("intrinsics.txt"));
    write(&path, path_bytes);
    write(&intrinsics, intrinsics_bytes);
    let intrinsics = (!intrinsics_bytes.is_empty()).then_some(intrinsics.as_path());
    let read = match Trajectory::read(&path, intrinsics) {
        Ok(read) => read,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    assert!(!read.poses.is_empty(), "a path has poses");
    assert!(read.poses.iter().all(|pose| pose.is_finite()), "{:?}", read.poses);
    assert!(
        intrinsics.is_none() || read.camera.is_some(),
        "the camera was given"
    );
    if let Some(camera) = &read.camera {
        assert_eq!(camera.problem(), None);
    }
    // The plain kind of file can say all poses, and a camera beside it leaves them as they are.
    let lines: String = read.poses.iter().map(line_of).collect();
    write(&path, lines.as_bytes());
    let again = Trajectory::read(&path, None).expect("what was accepted is a path");
    assert_eq!(again.poses, read.poses);
});

/// The sixteen numbers of a pose.
fn line_of(pose: &DAffine3) -> String {
    let rows = DMat4::from(*pose).transpose().to_cols_array();
    rows.map(|value| value.to_string()).join(" ") + "\n"
}

/// Through a pinhole in the Replica layout, and through a lens in that of `transforms.json`.
pub(super) const COLOR_IMAGE: Parser = Parser {
    name: "color_image",
    prepare: |folder| {
        make(folder, &["replica/rgb", "transforms"]);
        write(&folder.join("replica/traj_w_c.txt"), pose_line(0).as_bytes());
        let transforms = r#"{"fl_x": 20, "k1": -0.05, "frames": [{"file_path": "a.png",
            "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"#;
        write(&folder.join("transforms/transforms.json"), transforms.as_bytes());
    },
    check: |folder, bytes| {
        check_files(&folder.join("replica"), ["rgb/rgb_0.png"], [bytes]);
        check_files(&folder.join("transforms"), ["a.png"], [bytes]);
    },
};

/// As large as the colour image in the Replica layout, and of any size in that of `transforms.json`.
pub(super) const DEPTH_IMAGE: Parser = Parser {
    name: "depth_image",
    prepare: |folder| {
        make(folder, &["replica", "transforms"]);
        write_replica(&folder.join("replica"));
        write_color(&folder.join("transforms/a.png"));
        let transforms = r#"{"fl_x": 4, "k1": 0.01, "frames": [{"file_path": "a.png", "depth_file_path": "d.png",
            "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"#;
        write(&folder.join("transforms/transforms.json"), transforms.as_bytes());
    },
    check: |folder, bytes| {
        check_files(&folder.join("replica"), ["depth/depth_0.png"], [bytes]);
        check_files(&folder.join("transforms"), ["d.png"], [bytes]);
    },
};
