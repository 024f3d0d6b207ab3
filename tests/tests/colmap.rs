//! A capture with a COLMAP model and a bent lens is labelled in the pixels of its own images.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::Quat;
use image::RgbImage;
use inplace_core::labels::{ClassId, LabelSet, Stroke, strokes_json};
use inplace_core::scene::{Camera, Distortion, Lens};
use inplace_tests::{Small, info, label, miou_with_clicks, succeed};

/// What the labels reach at least, tiny classes included; one class everywhere gives 0.02.
const MIOU: f64 = 0.05;
/// Units of the model in a metre.
const UNIT: f32 = 3.0;
/// Every so many pixels of a frame shows a point of the model.
const POINT_EVERY: usize = 37;

/// Radial distortion of the lens, k1 and k2.
const RADIAL: [f64; 2] = [-0.06, 0.01];

/// The images are a cut-out of the small capture's frames through this lens.
fn lens() -> Lens {
    let camera = Small::get().scene.frames[0].camera;
    Lens {
        image: Camera {
            width: 56,
            height: 42,
            cx: camera.cx - 4.0,
            cy: camera.cy - 3.0,
            ..camera
        },
        distortion: Distortion::opencv(RADIAL),
    }
}

/// Index of the small capture's pixel that each pixel of a bent image shows, row by row.
fn shown() -> Vec<usize> {
    let (lens, camera) = (lens(), Small::get().scene.frames[0].camera);
    let position = |pixel: u32| {
        let (column, row) = (pixel % lens.image.width, pixel / lens.image.width);
        let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
        let (x, y) = lens.to_pinhole(&camera, x, y).unwrap();
        y as usize * camera.width as usize + x as usize
    };
    (0..lens.image.pixels() as u32).map(position).collect()
}

/// Writes images and a text model, with points at measured depths.
fn write(folder: &Path) {
    let (small, lens, shown) = (Small::get(), lens(), shown());
    let model = folder.join("sparse/0");
    fs::create_dir_all(&model).unwrap();
    fs::create_dir(folder.join("images")).unwrap();
    let (mut images, mut points) = (String::new(), String::new());
    let mut id = 0;
    for frame in &small.scene.frames {
        let (color, depth) = (frame.color(), frame.depth().unwrap());
        let world_to_camera = frame.camera_to_world.inverse();
        // Where the image shows the points that the frame measured.
        let mut places = String::new();
        for index in (0..depth.len()).step_by(POINT_EVERY) {
            let Some(length) = depth.ray_length(index) else {
                continue;
            };
            id += 1;
            let point = frame.center() + length * frame.ray_direction(index);
            let [x, y, z] = (UNIT * point).to_array();
            writeln!(points, "{id} {x} {y} {z} 0 0 0 0.1 1 0 2 0 3 0").unwrap();
            let local = world_to_camera.transform_point3(point).as_dvec3();
            let (x, y) = lens.place(local.x / local.z, local.y / local.z).unwrap();
            let [width, height] = [lens.image.width, lens.image.height].map(f64::from);
            if x > 0.0 && y > 0.0 && x < width && y < height {
                write!(places, "{x} {y} {id} ").unwrap();
            }
        }
        let rgb = shown.iter().flat_map(|&index| color.pixel(index)).collect();
        let image = RgbImage::from_raw(lens.image.width, lens.image.height, rgb).unwrap();
        let name = format!("{}.png", frame.stem);
        image.save(folder.join("images").join(&name)).unwrap();
        let [x, y, z, w] = Quat::from_mat3a(&world_to_camera.matrix3).to_array();
        let [tx, ty, tz] = (UNIT * world_to_camera.translation).to_array();
        writeln!(images, "1 {w} {x} {y} {z} {tx} {ty} {tz} 1 {name}\n{places}").unwrap();
    }
    let image = lens.image;
    let [k1, k2] = RADIAL;
    let (width, height, cx, cy) = (image.width, image.height, image.cx, image.cy);
    let camera = format!("1 RADIAL {width} {height} {} {cx} {cy} {k1} {k2}\n", image.fx);
    for (name, text) in [("cameras", camera), ("images", images), ("points3D", points)] {
        fs::write(model.join(name).with_extension("txt"), text).unwrap();
    }
}

/// The small capture's clicks where the bent images show them, in pixels of these.
fn clicks() -> LabelSet {
    let (lens, shown) = (lens(), shown());
    let width = Small::get().scene.frames[0].camera.width;
    let mut clicks = Small::get().labels();
    clicks.strokes.retain(|_, click| {
        let [x, y] = click.first_point().unwrap();
        let place = shown.iter().position(|&index| index == (y * width + x) as usize);
        let image = lens.image.width;
        let pixel = place.map(|index| [index as u32 % image, index as u32 / image]);
        *click = Arc::new(Stroke::click(click.frame, click.class, pixel.unwrap_or_default()));
        pixel.is_some()
    });
    clicks
}

#[test]
fn labels_come_out_in_the_pixels_of_the_bent_images() {
    let root = tempfile::tempdir().unwrap();
    let (room, out) = (root.path().join("room"), root.path().join("out"));
    write(&room);
    let (small, lens, clicks) = (Small::get(), lens(), clicks());
    assert!(clicks.strokes.len() > 10);

    let facts = info(&room, &[]);
    assert_eq!(facts["format"], "COLMAP");
    assert_eq!([&facts["width"], &facts["height"]], [56, 42]);
    for count in ["frames", "frames_with_distortion", "frames_with_points"] {
        assert_eq!(facts[count], 10, "{count}");
    }
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0, "{facts}");
    let points = &facts["reprojection"]["points"];
    assert!(points["median_px"].as_f64().unwrap() < 0.1, "{facts}");
    assert!(points["count"].as_u64().unwrap() > 0, "{facts}");

    let file = root.path().join("strokes.json");
    fs::write(&file, strokes_json(&clicks, &small.scene.frames)).unwrap();
    let mut command = label(&room, &out);
    command.arg("--strokes").arg(&file).args(["--budget", "6"]);
    assert_eq!(succeed(&mut command).stderr, "");

    let shown = shown();
    let truth = small.scene.frames.iter().zip(&small.truth).map(|(frame, truth)| {
        let truth: Vec<ClassId> = shown.iter().map(|&pixel| truth[pixel]).collect();
        (frame.stem.as_str(), truth)
    });
    let miou = miou_with_clicks(&out, (lens.image.width, lens.image.height), &clicks, truth);
    println!("mIoU: {miou:.3}");
    assert!(miou > MIOU, "{miou}");
}
