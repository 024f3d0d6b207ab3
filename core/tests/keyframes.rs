//! Captures that do not fit in the memory for images: keyframes, and the frames that are labelled from their surface.

#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use inplace_core::eval::ConfusionMatrix;
use inplace_core::export::{Format, LabelledScene, Options, export};
use inplace_core::field::Volume;
use inplace_core::labels::ClassId;
use inplace_core::scene::demo::{self, Shot};
use inplace_core::scene::{GroundTruth, OpenOptions, Scene, SceneSource, write_replica};
use inplace_core::semantics::{FrameMap, Spread, Surface};

const SHOT: Shot = Shot {
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
    let extent = Volume::around(&scene.bounds()).side;
    let mut spread = Spread::new(Arc::new(Surface::build(scene, &[], extent).unwrap()));
    spread.set_labels(scene, &SHOT.clicks());
    let frames = 0..scene.frames.len();
    frames
        .map(|frame| Arc::new(spread.map(scene, frame, 1)))
        .collect()
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
        assert_eq!(
            (frame.has_depth(), frame.depth_coverage()),
            (true, same.depth_coverage())
        );
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

#[test]
fn an_export_names_the_file_of_a_frame_that_has_vanished_since_the_capture_was_opened() {
    let copy = tempfile::tempdir().unwrap();
    for name in ["rgb", "depth"] {
        fs::create_dir(copy.path().join(name)).unwrap();
        for number in 0..6 {
            let file = format!("{name}/{name}_{number}.png");
            fs::copy(CAPTURE.0.path().join("room").join(&file), copy.path().join(&file)).unwrap();
        }
    }
    let poses = fs::read_to_string(CAPTURE.0.path().join("room/traj_w_c.txt")).unwrap();
    let poses: Vec<&str> = poses.lines().take(6).collect();
    fs::write(copy.path().join("traj_w_c.txt"), poses.join("\n")).unwrap();
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
    assert!(
        sentence.contains(name) && sentence.contains("can no longer be read"),
        "{sentence}"
    );
    assert!(!out.join("classes.json").exists());
}
