//! Captures that do not fit in the memory for images: keyframes, and the frames that are labelled from their surface.

#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use inplace_core::export::{Format, LabelledScene, Options, export};
use inplace_core::field::Volume;
use inplace_core::labels::ClassId;
use inplace_core::scene::demo::{self, Shot};
use inplace_core::scene::{GroundTruth, OpenOptions, Scene, SceneSource, write_replica};
use inplace_core::semantics::FrameMap;
use inplace_lab::ConfusionMatrix;
use inplace_tests::propagated;

const SHOT: Shot = Shot {
    rooms: 1,
    frames: 60,
    width: 160,
    height: 120,
};
/// Pixels of so many frames fit in memory.
const FITTING: usize = 20;

/// The demo in a folder, and its true classes.
static CAPTURE: LazyLock<(tempfile::TempDir, Vec<Vec<ClassId>>)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let truth = SHOT.ground_truth();
    let written = GroundTruth {
        classes: &demo::classes(),
        labels: &|frame| truth[frame].clone(),
        held_out: &[],
    };
    write_replica(&SHOT.unrendered(), &folder.path().join("room"), Some(&written)).unwrap();
    (folder, truth)
});

fn open(folder: &Path, fitting: usize) -> Arc<Scene> {
    let options = OpenOptions {
        image_bytes: (fitting * SHOT.width as usize * SHOT.height as usize * 5) as u64,
        ..OpenOptions::default()
    };
    let source = SceneSource::Folder(folder.to_path_buf());
    Arc::new(Scene::open(&source, options, &|_, _| {}).unwrap())
}

/// The demo's clicks spread over the surface of the scene's keyframes.
fn labelled(scene: &Arc<Scene>) -> Vec<Arc<FrameMap>> {
    propagated(scene, &SHOT.clicks(), Volume::around(&scene.bounds()).side)
}

fn miou(maps: &[Arc<FrameMap>], frames: &[usize]) -> f64 {
    let mut confusion = ConfusionMatrix::default();
    for &frame in frames {
        confusion.add(&CAPTURE.1[frame], &maps[frame].labels()).unwrap();
    }
    confusion.miou().unwrap()
}

#[test]
fn frames_that_are_no_keyframes_are_labelled_as_well_as_those_that_are() {
    let folder = CAPTURE.0.path().join("room");
    let whole = open(&folder, SHOT.frames);
    let scene = open(&folder, FITTING);
    let keyframes = scene.keyframes();
    assert_eq!((keyframes.len(), whole.keyframes().len()), (FITTING, SHOT.frames));
    assert!(whole.notes.is_empty() && scene.notes[0].starts_with("20 of 60 frames are keyframes"));
    for (frame, same) in scene.frames.iter().zip(&whole.frames) {
        assert_eq!(frame.pixels().unwrap(), same.pixels().unwrap());
        assert!(frame.has_depth());
        assert_eq!(frame.depth_coverage(), same.depth_coverage());
    }
    let others: Vec<usize> = (0..SHOT.frames)
        .filter(|frame| !keyframes.contains(frame))
        .collect();
    // Some clicks lie on frames that are no keyframes, and count.
    assert!(
        SHOT.clicks()
            .strokes
            .values()
            .any(|stroke| others.contains(&stroke.frame))
    );
    let (all, few) = (labelled(&whole), labelled(&scene));
    let (of_keyframes, of_others, of_all) =
        (miou(&few, &keyframes), miou(&few, &others), miou(&all, &others));
    println!("keyframes {of_keyframes:.3}, others {of_others:.3}; others if all were keyframes {of_all:.3}");
    assert!(of_others > 0.5 && of_others > of_keyframes - 0.05 && of_others > of_all - 0.05);
}

/// The capture's first `count` frames in a folder of their own.
fn copy(count: usize) -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for name in ["rgb", "depth"] {
        fs::create_dir(copy.path().join(name)).unwrap();
        for number in 0..count {
            let file = format!("{name}/{name}_{number}.png");
            fs::copy(CAPTURE.0.path().join("room").join(&file), copy.path().join(&file)).unwrap();
        }
    }
    let poses = fs::read_to_string(CAPTURE.0.path().join("room/traj_w_c.txt")).unwrap();
    let poses: Vec<&str> = poses.lines().take(count).collect();
    fs::write(copy.path().join("traj_w_c.txt"), poses.join("\n")).unwrap();
    copy
}

#[test]
fn what_alpha_hides_is_hidden_in_frames_that_are_no_keyframes_too() {
    let folder = copy(6);
    let is_hidden = |x: u32, y: u32| (20..70).contains(&x) && (30..90).contains(&y);
    for number in 0..6 {
        let path = folder.path().join(format!("rgb/rgb_{number}.png"));
        let mut image = image::open(&path).unwrap().into_rgba8();
        for (x, y, pixel) in image.enumerate_pixels_mut() {
            pixel.0[3] = if is_hidden(x, y) { 0 } else { 255 };
        }
        image.save(&path).unwrap();
    }
    let (whole, scene) = (open(folder.path(), 6), open(folder.path(), 3));
    assert_eq!(scene.keyframes().len(), 3);
    assert!(
        scene.notes[0].contains("hide pixels in 6 of 6 frames"),
        "{:?}",
        scene.notes
    );
    assert_eq!(whole.notes[0], scene.notes[0]);
    let maps = labelled(&scene);
    for ((frame, same), map) in scene.frames.iter().zip(&whole.frames).zip(&maps) {
        assert_eq!(frame.pixels().unwrap(), same.pixels().unwrap());
        let (labels, entropy, depth) = (map.labels(), map.entropy(), frame.depth().unwrap());
        let hidden = frame.hidden_pixels();
        assert_eq!(hidden.len(), 50 * 60);
        assert!(hidden.iter().all(|&pixel| !frame.is_valid(pixel)));
        assert!(
            hidden
                .iter()
                .all(|&pixel| (labels[pixel], entropy[pixel]) == (0, 0))
        );
        assert!(hidden.iter().all(|&pixel| depth.ray_length(pixel).is_none()));
        assert!(labels.iter().any(|&label| label != 0));
    }
}

#[test]
fn an_export_names_the_file_of_a_frame_that_has_vanished_since_the_capture_was_opened() {
    let copy = copy(6);
    let scene = open(copy.path(), 3);
    let maps = labelled(&scene);
    let other = scene.frames.iter().find(|frame| !frame.is_keyframe()).unwrap();
    fs::remove_file(&other.path).unwrap();
    let out = copy.path().join("out");
    let labelled = LabelledScene {
        scene: &scene,
        classes: &[],
        maps: &maps,
    };
    let go_on = |_, _| ControlFlow::Continue(());
    let error = export(&out, labelled, Format::Png, &Options::default(), &go_on).unwrap_err();
    let name = other.path.file_name().unwrap().to_str().unwrap();
    let sentence = error.to_string();
    assert!(sentence.contains(name), "{sentence}");
    assert!(sentence.contains("can no longer be read"), "{sentence}");
    assert!(!out.join("classes.json").exists());
}
