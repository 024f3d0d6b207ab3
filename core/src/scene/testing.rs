//! A small capture for the core's own tests.

use std::path::{Path, PathBuf};

use glam::{Affine3A, DVec3, Vec3};

use super::{Camera, ColorImage, DepthMap, Frame, FramePixels, OpenOptions, Scene, SceneError, SceneSource};

/// A wall two metres away, dark where x < 0 and bright elsewhere, seen by cameras side by side, the
/// first at x = -0.2 m and the last at x = 0.2 m, with depth and a horizontal field of view of 90 degrees.
pub fn wall(frames: usize, width: u32, height: u32) -> Scene {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let frames = (0..frames)
        .map(|number| {
            let x = -0.2 + 0.4 * number as f32 / (frames - 1).max(1) as f32;
            let mut rgb = Vec::new();
            for index in 0..camera.pixels() as u32 {
                let direction = camera.pixel_direction(index % width, index / width);
                let bright = x + 2.0 * direction.x > 0.0;
                rgb.extend([if bright { 220 } else { 40 }; 3]);
            }
            Frame {
                stem: format!("rgb_{number}"),
                path: PathBuf::new(),
                camera,
                camera_to_world: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
                pixels: FramePixels::new(
                    ColorImage::new(width, height, rgb).unwrap(),
                    Some(DepthMap::from_z_depths(&camera, vec![2.0; camera.pixels()])),
                ),
                points: Vec::new(),
                lens: None,
            }
        })
        .collect();
    Scene {
        source: SceneSource::Demo,
        format: "test",
        frames,
        origin: DVec3::ZERO,
        unit: 1.0,
        point_errors: None,
        warnings: Vec::new(),
        notes: Vec::new(),
    }
}

/// Hides pixels of a frame, by row-major index.
pub fn hide(frame: &mut Frame, is_hidden: impl Fn(usize) -> bool) {
    let color = ColorImage::clone(&frame.color());
    frame.set_color(color.hiding(is_hidden));
}

/// To open captures without their depth.
pub const WITHOUT_DEPTH: OpenOptions = OpenOptions {
    depth: false,
    outside_files: false,
    image_bytes: u64::MAX,
};

/// Opens a folder as the program would.
pub fn open(folder: &Path) -> Result<Scene, SceneError> {
    let source = SceneSource::Folder(folder.to_path_buf());
    Scene::open(&source, OpenOptions::default(), &|_, _| {})
}

/// Opens a folder as the program would with `--outside-files`.
pub fn open_with_outside_files(folder: &Path) -> Result<Scene, SceneError> {
    let options = OpenOptions {
        outside_files: true,
        ..OpenOptions::default()
    };
    Scene::open(&SceneSource::Folder(folder.to_path_buf()), options, &|_, _| {})
}

/// Moves a file out of the capture in `folder` and leaves a link in its place; holds the folder that has it now.
#[cfg(unix)]
pub fn move_out(folder: &Path, name: &str) -> tempfile::TempDir {
    let outside = tempfile::tempdir().unwrap();
    let (place, moved) = (folder.join(name), outside.path().join("moved"));
    std::fs::copy(&place, &moved).unwrap();
    std::fs::remove_file(&place).unwrap();
    std::os::unix::fs::symlink(&moved, &place).unwrap();
    outside
}

/// Asserts that a folder is refused with a message that holds all of these.
#[track_caller]
pub fn assert_refused(folder: &Path, parts: &[&str]) {
    let message = open(folder).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is not in: {message}");
    }
}

/// Asserts that so many frames of a folder are read with one warning that holds all of these.
#[track_caller]
pub fn assert_warned(folder: &Path, frames: usize, parts: &[&str]) {
    let scene = open(folder).unwrap();
    assert_eq!(scene.frames.len(), frames);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    for part in parts {
        assert!(scene.warnings[0].contains(part), "{:?}", scene.warnings);
    }
}

/// Writes a colour image of 8 x 6 pixels of one gray.
pub fn write_color(path: &Path, gray: u8) {
    image::save_buffer(path, &[gray; 8 * 6 * 3], 8, 6, image::ColorType::Rgb8).unwrap();
}

/// Writes a 16-bit depth image of 8 x 6 pixels: these values first and then `rest`.
pub fn write_depth(path: &Path, first: &[u16], rest: u16) {
    let mut values = first.to_vec();
    values.resize(8 * 6, rest);
    image::save_buffer(path, bytemuck::cast_slice(&values), 8, 6, image::ColorType::L16).unwrap();
}

/// EXIF metadata that ask for an orientation, 1 to 8: TIFF with one entry, tag 0x112, one short.
pub fn orientation_metadata(orientation: u8) -> Vec<u8> {
    let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
    [&b"II*\0\x08\0\0\0\x01\0"[..], &entry, &[0; 4]].concat()
}

/// A JPEG of 32x16 pixels, dark on the left and bright on the right, that asks for an EXIF orientation.
pub fn sideways_jpeg(orientation: u8) -> Vec<u8> {
    let image = image::RgbImage::from_fn(32, 16, |x, _| image::Rgb([if x < 16 { 20 } else { 220 }; 3]));
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut bytes);
    image::ImageEncoder::set_exif_metadata(&mut encoder, orientation_metadata(orientation)).unwrap();
    encoder.encode_image(&image).unwrap();
    bytes
}
