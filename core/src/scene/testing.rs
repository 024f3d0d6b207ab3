//! Small scenes and captures for the core's own tests.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Affine3A, DQuat, DVec3, Vec3};
use tempfile::TempDir;

use super::{
    Camera, ColorImage, DepthMap, Distortion, Frame, Lens, OpenOptions, Pixels, Scene, SceneError,
    SceneSource,
};

/// A scene of these frames that was read from nowhere.
pub fn scene(frames: Vec<Frame>) -> Scene {
    Scene::new(SceneSource::Demo, "test", frames)
}

/// A frame at the origin without a file, with these colours (row-major, three bytes a pixel) and this depth.
pub fn frame(stem: &str, camera: Camera, rgb: Vec<u8>, depth: Option<DepthMap>) -> Frame {
    let color = ColorImage::new(camera.width, camera.height, rgb).unwrap();
    Frame {
        stem: stem.to_owned(),
        path: PathBuf::new(),
        camera,
        camera_to_world: Affine3A::IDENTITY,
        pixels: Pixels::new(color, depth).into(),
        points: Vec::new(),
        lens: None,
    }
}

/// A wall two metres away, dark where x < 0 and bright elsewhere, seen by cameras side by side, the
/// first at x = -0.2 m and the last at x = 0.2 m, with depth and a horizontal field of view of 90 degrees.
pub fn wall(frames: usize, width: u32, height: u32) -> Scene {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let frames = (0..frames)
        .map(|number| {
            let x = -0.2 + 0.4 * number as f32 / (frames - 1).max(1) as f32;
            let mut rgb = Vec::new();
            for index in 0..camera.pixels() {
                let direction = camera.direction_at(index);
                let bright = x + 2.0 * direction.x > 0.0;
                rgb.extend([if bright { 220 } else { 40 }; 3]);
            }
            let depth = DepthMap::from_z_depths(&camera, vec![2.0; camera.pixels()]);
            let mut frame = frame(&format!("rgb_{number}"), camera, rgb, Some(depth));
            frame.camera_to_world = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
            frame
        })
        .collect();
    scene(frames)
}

/// The same scene where no depth was measured.
pub fn without_depth(mut scene: Scene) -> Scene {
    scene.frames.iter_mut().for_each(|frame| frame.set_depth(None));
    scene
}

/// Makes a frame one of a lens with this radial distortion: its camera becomes that of the straightened image.
pub fn bend(frame: &mut Frame, k1: f64) {
    let lens = Lens {
        image: frame.camera,
        distortion: Distortion::opencv([k1]),
    };
    frame.camera = lens.pinhole().unwrap();
    frame.lens = Some(lens);
}

/// Hides pixels of a frame, by row-major index.
pub fn hide(frame: &mut Frame, is_hidden: impl Fn(usize) -> bool) {
    let color = ColorImage::clone(&frame.color());
    frame.set_color(color.hiding(is_hidden));
}

/// Writes a file in a folder; its path.
pub fn write_file(folder: &TempDir, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// A turn and a shift to somewhere far away, in which a scene may lie.
pub fn far_away() -> (DQuat, DVec3) {
    (
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 2.1),
        DVec3::new(400_000.0, -20.0, 3.0),
    )
}

/// What some work gives on so many threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(work)
}

pub fn stems(scene: &Scene) -> Vec<&str> {
    scene.frames.iter().map(|frame| frame.stem.as_str()).collect()
}

/// Depth of a frame's pixel along the camera's z axis, in metres.
pub fn z_depth(frame: &Frame, index: usize) -> Option<f32> {
    let length = frame.depth()?.ray_length(index)?;
    Some(length / frame.camera.direction_at(index).length())
}

/// Opens a folder as the program would.
pub fn open(folder: &Path) -> Result<Scene, SceneError> {
    open_with(folder, OpenOptions::default())
}

pub fn open_with(folder: &Path, options: OpenOptions) -> Result<Scene, SceneError> {
    Scene::open(&SceneSource::Folder(folder.to_path_buf()), options, &|_, _| {})
}

/// Opens a folder that must be usable without a warning.
#[track_caller]
pub fn opened(folder: &Path) -> Scene {
    let scene = open(folder).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// Opens a folder as the program would with `--no-depth`; there must be no warning.
#[track_caller]
pub fn opened_without_depth(folder: &Path) -> Scene {
    let options = OpenOptions {
        depth: false,
        ..OpenOptions::default()
    };
    let scene = open_with(folder, options).unwrap();
    assert!(!scene.has_depth());
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// Asserts that a folder is refused with all of these words and the advice to allow files outside of it, and that
/// `frames` frames are read where they are allowed, which come back.
#[track_caller]
pub fn assert_outside(folder: &Path, words: &[&str], frames: usize) -> Scene {
    assert_refused(folder, &[words, &["--outside-files"]].concat());
    let options = OpenOptions {
        outside_files: true,
        ..OpenOptions::default()
    };
    let scene = open_with(folder, options).unwrap();
    assert_eq!(scene.frames.len(), frames, "{:?}", scene.warnings);
    scene
}

/// Asserts that a folder is refused with one sentence that holds all of these.
#[track_caller]
pub fn assert_refused(folder: &Path, words: &[&str]) {
    assert_eq!(opening_problem(folder, None, words), None);
}

/// What is wrong, if anything, with what opening a folder says: a sentence with all of these words, by which it is
/// refused, or the only warning where so many frames are to be read.
fn opening_problem(folder: &Path, frames: Option<usize>, words: &[&str]) -> Option<String> {
    let sentence = match (open(folder), frames) {
        (Err(error), None) => error.to_string(),
        (Ok(scene), Some(frames)) if scene.frames.len() == frames && scene.warnings.len() == 1 => {
            scene.warnings[0].clone()
        }
        (Ok(scene), _) => return Some(format!("{} frames, {:?}", scene.frames.len(), scene.warnings)),
        (Err(error), Some(_)) => return Some(format!("is refused: {error}")),
    };
    if sentence.contains('\n') {
        return Some(format!("several lines: {sentence}"));
    }
    let missing = words.iter().find(|word| !sentence.contains(**word))?;
    Some(format!("{missing:?} is not in: {sentence}"))
}

/// Checks what opening a capture says after each of several changes, a line each: `change | outcome | words`.
///
/// The outcome is `refused`, or the number of frames that are read with one warning. All the words, separated by
/// ` & `, are in that sentence. Each line gets a capture of its own, which `change` alters as its first column says:
/// [`change_files`] where nothing else is needed.
#[track_caller]
pub fn check_changes(capture: fn() -> (TempDir, PathBuf), change: fn(&Path, &str), table: &str) {
    let problem = |line: &str| {
        let columns: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let [changes, outcome, words] = columns[..] else {
            panic!("three columns: {line}");
        };
        let frames = (outcome != "refused").then(|| outcome.parse().unwrap());
        let (_root, folder) = capture();
        change(&folder, changes);
        let words: Vec<&str> = words.split(" & ").collect();
        let problem = opening_problem(&folder, frames, &words)?;
        Some(format!("{changes}: {problem}"))
    };
    let problems: Vec<String> = table.trim().lines().filter_map(problem).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Changes files of a capture as a line of [`check_changes`] says, by steps with `; ` between them:
///
/// - `FILE = TEXT` and `FILE:LINE = TEXT` write a file or one of its lines, from 1; `\n` ends a line
/// - `remove FILE` (or a folder), `halve FILE`, and `spoil FILE` by bytes that are neither text nor an image
/// - `rgb8 FILE WIDTHxHEIGHT`, and so `gray8` and `gray16`: a black image
///
/// A FILE with `{a,b}` in it is two files.
pub fn change_files(folder: &Path, steps: &str) {
    for step in steps.split("; ") {
        if let Some((file, text)) = step.split_once(" =") {
            let text = text.trim().replace("\\n", "\n");
            for file in expanded(file) {
                match file.split_once(':') {
                    Some((file, line)) => set_line(&folder.join(file), line.parse().unwrap(), &text),
                    None => fs::write(folder.join(file), &text).unwrap(),
                }
            }
            continue;
        }
        let words: Vec<&str> = step.split(' ').collect();
        for file in expanded(words[1]) {
            let path = folder.join(file);
            let save = |kind| {
                let (width, height) = words[2].split_once('x').unwrap();
                let image = image::DynamicImage::new(width.parse().unwrap(), height.parse().unwrap(), kind);
                image.save(&path).unwrap();
            };
            match words[0] {
                "remove" if path.is_dir() => fs::remove_dir_all(&path).unwrap(),
                "remove" => fs::remove_file(&path).unwrap(),
                "halve" => {
                    let bytes = fs::read(&path).unwrap();
                    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
                }
                "spoil" => fs::write(&path, [0xFF, 0xFE, 0x00]).unwrap(),
                "rgb8" => save(image::ColorType::Rgb8),
                "gray8" => save(image::ColorType::L8),
                "gray16" => save(image::ColorType::L16),
                _ => panic!("{step}"),
            }
        }
    }
}

fn set_line(path: &Path, number: usize, line: &str) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines[number - 1] = line;
    fs::write(path, lines.join("\n")).unwrap();
}

/// The names that a name with `{a,b}` in it stands for.
pub fn expanded(name: &str) -> Vec<String> {
    let Some((before, rest)) = name.split_once('{') else {
        return vec![name.to_owned()];
    };
    let (among, after) = rest.split_once('}').unwrap();
    among
        .split(',')
        .map(|word| format!("{before}{word}{after}"))
        .collect()
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
