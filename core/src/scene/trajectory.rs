//! The path of a camera that takes no pictures: poses in a capture's own coordinates.

use std::fmt::Display;
use std::path::Path;

use glam::DAffine3;
use serde::Deserialize;

use super::camera::image_size;
use super::error::{refusal, refuse};
use super::files::MOST_PIXELS;
use super::rgbd::text::{pose_of, read_intrinsics, read_text};
use super::transforms::{Transforms, pose_of_open_gl};
use super::{Camera, SceneError, replica};

/// What is said to do about a camera that cannot be used.
const GIVE_INTRINSICS: &str = "give the camera by a file of its own with fx fy cx cy width height";

/// The poses that a camera takes one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Camera-to-world, OpenCV's camera axes, in the capture's own coordinates and unit. There is at least one.
    pub poses: Vec<DAffine3>,
    /// The camera, where the file says it.
    pub camera: Option<Camera>,
}

/// What tells the kinds of JSON files apart, and the camera path of nerfstudio.
#[derive(Deserialize)]
struct PathFile {
    camera_path: Option<Vec<PathView>>,
    camera_type: Option<String>,
    render_width: Option<f64>,
    render_height: Option<f64>,
}

/// A view of nerfstudio's camera path.
#[derive(Deserialize)]
struct PathView {
    /// 4 x 4 row by row, OpenGL's camera axes.
    camera_to_world: Vec<f64>,
    /// Vertical field of view in degrees.
    fov: Option<f64>,
}

impl Trajectory {
    /// Reads a path: lines of 16 numbers as in the Replica layout, or a JSON file: a `transforms.json`, of which the
    /// images need not be there, or a camera path of nerfstudio (`camera_path`), either with its camera.
    ///
    /// `intrinsics` is a file with `fx fy cx cy width height`, which counts in place of the camera of the path.
    ///
    /// # Errors
    /// A file that cannot be read, a pose that is not rigid, several cameras, views with more pixels than an image that is
    /// read may have: a sentence that names the file.
    pub fn read(path: &Path, intrinsics: Option<&Path>) -> Result<Self, SceneError> {
        let given = intrinsics.map(read_intrinsics).transpose()?;
        let text = read_text(path)?;
        let views = read_views(path, &text)?;
        let poses = views.iter().map(|view| view.pose).collect();
        let camera = match given {
            Some(camera) => Some(camera),
            None => one_camera(path, views)?,
        };
        if let Some(Camera { width, height, .. }) = camera
            && u64::from(width) * u64::from(height) > MOST_PIXELS
        {
            refuse!(
                intrinsics.unwrap_or(path),
                "asks for views of {width} x {height} pixels, which is too large for an image; give a smaller width and \
                 height, and focal lengths to match"
            );
        }
        Ok(Self { poses, camera })
    }
}

/// A place on the path.
struct View {
    pose: DAffine3,
    /// Where the file says it, or what is wrong with it.
    camera: Result<Option<Camera>, String>,
}

/// The views in the text of a file of any kind.
fn read_views(path: &Path, text: &str) -> Result<Vec<View>, SceneError> {
    let unusable = |number: usize, problem: &dyn Display| {
        refusal!(
            path,
            "pose {number} cannot be used: {problem}; each must be a rigid camera-to-world matrix"
        )
    };
    if !text.trim_start().starts_with('{') {
        let poses = replica::parse_poses(path, text)?.into_iter().enumerate();
        let views = poses.map(|(number, (line, values))| {
            let pose = pose_of(&values);
            Ok(View {
                pose: pose.map_err(|problem| unusable(number, &format_args!("{problem} (line {line})")))?,
                camera: Ok(None),
            })
        });
        return views.collect();
    }
    let file: PathFile = serde_json::from_str(text)
        .map_err(|error| refusal!(path, "is no list of poses ({error}); write the file anew"))?;
    let Some(places) = &file.camera_path else {
        let transforms = Transforms::parse(path, text.as_bytes())?;
        let views = transforms.frames.iter().enumerate().map(|(number, entry)| {
            let pose = pose_of_open_gl(&entry.transform_matrix);
            let lens = transforms.size(entry).map(|size| transforms.lens(entry, size));
            Ok(View {
                pose: pose.map_err(|problem| unusable(number, &problem))?,
                camera: lens.transpose().map(|lens| lens.map(|(_, pinhole)| pinhole)),
            })
        });
        return views.collect();
    };
    if places.is_empty() {
        refuse!(path, "its camera_path has no poses; add some and save it again");
    }
    let views = places.iter().enumerate().map(|(number, place)| {
        let rows: Vec<&[f64]> = place.camera_to_world.chunks(4).collect();
        Ok(View {
            pose: pose_of_open_gl(&rows).map_err(|problem| unusable(number, &problem))?,
            camera: path_camera(&file, place),
        })
    });
    views.collect()
}

/// The camera of a view of nerfstudio's path: square pixels, the principal point in the middle.
fn path_camera(file: &PathFile, view: &PathView) -> Result<Option<Camera>, String> {
    let unusable = |problem: String| Err(format!("{problem}; correct it"));
    if let Some(kind) = file.camera_type.as_deref().filter(|&kind| kind != "perspective") {
        let kind: String = kind.escape_debug().take(40).collect();
        return unusable(format!("its camera_type is {kind}, not perspective"));
    }
    let (Some(width), Some(height), Some(fov)) = (file.render_width, file.render_height, view.fov) else {
        return Ok(None);
    };
    let Some(size) = image_size([width, height]) else {
        return unusable(format!("render_width x render_height is {width} x {height}"));
    };
    if !(fov > 0.0 && fov < 180.0) {
        return unusable(format!("a field of view (fov) is {fov} degrees"));
    }
    let focal = 0.5 * height / (0.5 * fov.to_radians()).tan();
    let camera = Camera::checked(size, [focal, focal, 0.5 * width, 0.5 * height]);
    camera
        .map(Some)
        .or_else(|problem| unusable(format!("with a field of view (fov) of {fov} degrees {problem}")))
}

/// The camera that all views have, if any.
fn one_camera(path: &Path, views: Vec<View>) -> Result<Option<Camera>, SceneError> {
    let mut found: Option<Option<Camera>> = None;
    for view in views {
        let camera = view.camera.map_err(|problem| {
            refusal!(path, "its camera cannot be used: {problem}, or {GIVE_INTRINSICS}")
        })?;
        if *found.get_or_insert(camera) != camera {
            refuse!(
                path,
                "its views have several cameras, and the folder that is written holds one; {GIVE_INTRINSICS}"
            );
        }
    }
    Ok(found.flatten())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::{DMat3, DMat4, DVec3, EulerRot};
    use serde_json::json;

    use super::*;
    use crate::scene::testing::write_file;

    /// Looks down a little, far from zero.
    fn pose() -> DAffine3 {
        let rotation = DMat3::from_euler(EulerRot::YXZ, 0.7, -0.2, 0.1);
        DAffine3::from_mat3_translation(rotation, DVec3::new(4_000_000.25, -3.5, 12.0))
    }

    /// Row by row.
    fn rows(pose: &DAffine3) -> Vec<f64> {
        DMat4::from(*pose).transpose().to_cols_array().to_vec()
    }

    /// The same camera with OpenGL's axes.
    fn open_gl(pose: &DAffine3) -> DAffine3 {
        *pose * DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0))
    }

    fn words(values: &[f64]) -> String {
        let words: Vec<String> = values.iter().map(f64::to_string).collect();
        words.join(" ")
    }

    #[test]
    fn the_same_poses_are_read_from_every_kind_of_file() {
        let folder = tempfile::tempdir().unwrap();
        let gl = rows(&open_gl(&pose()));
        let matrix: Vec<&[f64]> = gl.chunks(4).collect();
        let lines = format!("# a comment\n{}\n", words(&rows(&pose())));
        let text = write_file(&folder, "path.txt", lines);
        let transforms = json!({"w": 64, "h": 48, "fl_x": 50.0, "cx": 30.0,
            "frames": [{"file_path": "none.png", "transform_matrix": matrix}]});
        let transforms = write_file(&folder, "transforms.json", transforms.to_string());
        let path = json!({"camera_type": "perspective", "render_width": 64, "render_height": 48,
            "camera_path": [{"camera_to_world": gl, "fov": 90.0, "aspect": 1.3}]});
        let path = write_file(&folder, "camera_path.json", path.to_string());
        let cameras = [&text, &transforms, &path].map(|file| {
            let read = Trajectory::read(file, None).unwrap();
            assert_eq!(read.poses.len(), 1);
            assert!(read.poses[0].abs_diff_eq(pose(), 1e-9), "{}", file.display());
            read.camera
        });
        let camera = |focal, cx| Camera::new([64, 48], [focal, focal, cx, 24.0]);
        let [transforms_camera, path_camera] = [camera(50.0, 30.0), camera(24.0, 32.0)];
        assert_eq!(cameras, [None, Some(transforms_camera), Some(path_camera)]);
        // As some editors save it.
        for file in [&text, &transforms, &path] {
            let read = |file| Trajectory::read(file, None).unwrap();
            let marked = format!("\u{feff}{}", fs::read_to_string(file).unwrap());
            assert_eq!(read(&write_file(&folder, "marked", marked)), read(file));
        }
        let intrinsics = write_file(&folder, "own.txt", "20 21 5 6 10 12\n");
        for file in [&text, &transforms, &path] {
            let camera = Trajectory::read(file, Some(&intrinsics)).unwrap().camera.unwrap();
            assert_eq!((camera.width, camera.fy, camera.cx), (10, 21.0, 5.0));
        }
    }

    #[test]
    fn views_that_no_image_could_hold_are_refused_by_the_file_that_asks_for_them() {
        let folder = tempfile::tempdir().unwrap();
        let pose = rows(&DAffine3::IDENTITY);
        let matrix: Vec<&[f64]> = pose.chunks(4).collect();
        for (side, is_refused) in [(100_000, true), (60_000, true), (13_000, false)] {
            let transforms = json!({"w": side, "h": side, "fl_x": side,
                "frames": [{"file_path": "none.png", "transform_matrix": matrix}]});
            let path = json!({"render_width": side, "render_height": side,
                "camera_path": [{"camera_to_world": pose, "fov": 60.0}]});
            let center = side / 2;
            let own = format!("{side} {side} {center} {center} {side} {side}");
            let own = write_file(&folder, "own.txt", own);
            let poses = write_file(&folder, "poses.txt", words(&pose));
            let transforms = write_file(&folder, "transforms.json", transforms.to_string());
            let path = write_file(&folder, "path.json", path.to_string());
            for (file, intrinsics, named) in [
                (transforms, None, "transforms.json"),
                (path, None, "path.json"),
                (poses, Some(own.as_path()), "own.txt"),
            ] {
                let read = Trajectory::read(&file, intrinsics);
                if !is_refused {
                    assert_eq!(read.unwrap().camera.unwrap().width, side, "{named}");
                    continue;
                }
                let message = read.unwrap_err().to_string();
                for part in [named, &side.to_string()] {
                    assert!(message.contains(part), "{part} is not in: {message}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_path_is_refused_with_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let view = |fov: f64| json!({"camera_to_world": rows(&DAffine3::IDENTITY), "fov": fov});
        let path = |kind: &str, views: Vec<serde_json::Value>| {
            json!({"camera_type": kind, "render_width": 8, "render_height": 6, "camera_path": views})
                .to_string()
        };
        let views = |views: Vec<serde_json::Value>| path("perspective", views);
        let flat = json!({"camera_to_world": [1.0], "fov": 50.0});
        let mut stretched = rows(&DAffine3::IDENTITY);
        stretched[0] = 2.0;
        let cases = [
            (words(&rows(&DAffine3::IDENTITY)[..12]), "line 1 has 12 numbers"),
            (words(&stretched), "pose 0 cannot be used"),
            (String::new(), "holds no poses"),
            ("{".to_owned(), "is no list of poses"),
            (json!({"frames": []}).to_string(), "lists no frames"),
            (views(Vec::new()), "no poses"),
            (path("fisheye", vec![view(50.0)]), "camera_type is fisheye"),
            (views(vec![view(50.0), view(60.0)]), "several cameras"),
            (views(vec![view(180.0)]), "180 degrees"),
            (views(vec![view(1e-50)]), "not a finite number"),
            (views(vec![view(179.999_999)]), "farther to a side"),
            (
                views(vec![flat]),
                "pose 0 cannot be used: it is not a matrix of 4 x 4 numbers",
            ),
        ];
        for (text, part) in cases {
            let file = write_file(&folder, "path", text);
            let message = Trajectory::read(&file, None).unwrap_err().to_string();
            assert!(message.contains(part), "{part}: {message}");
            assert!(message.contains("path"), "{part}: {message}");
        }
        let message = Trajectory::read(&folder.path().join("none"), None)
            .unwrap_err()
            .to_string();
        assert!(message.contains("none: cannot be read"), "{message}");
    }
}
