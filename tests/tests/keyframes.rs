//! Captures that do not fit in the memory for images: keyframes, and the frames that are labelled from their surface.

#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::path::Path;
use std::sync::Arc;

use inplace_core::field::Volume;
use inplace_core::labels::LabelSet;
use inplace_core::scene::demo::Shot;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::semantics::FrameMap;
use inplace_tests::{OnDisk, Small, propagated};

/// Opens a capture of which this many pixels fit in memory.
fn open(folder: &Path, fitting: usize) -> Arc<Scene> {
    let options = OpenOptions {
        image_bytes: (fitting * 5) as u64,
        ..OpenOptions::default()
    };
    let source = SceneSource::Folder(folder.to_path_buf());
    Arc::new(Scene::open(&source, options, &|_, _| {}).unwrap())
}

/// Labels spread over the surface of the scene's keyframes.
fn labelled(scene: &Arc<Scene>, labels: &LabelSet) -> Vec<Arc<FrameMap>> {
    propagated(scene, labels, Volume::around(&scene.bounds()).side)
}

#[test]
fn frames_that_are_no_keyframes_are_labelled_as_well_as_those_that_are() {
    let shot = Shot::new(60, [160, 120]);
    let capture = Small::of(shot);
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("room");
    capture.write(&folder);
    let [whole, scene] = [60, 20].map(|fitting| open(&folder, fitting * 160 * 120));
    let keyframes = scene.keyframes();
    assert_eq!((keyframes.len(), whole.keyframes().len()), (20, 60));
    assert!(whole.notes.is_empty() && scene.notes[0].starts_with("20 of 60 frames are keyframes"));
    for (frame, same) in scene.frames.iter().zip(&whole.frames) {
        assert_eq!(frame.pixels().unwrap(), same.pixels().unwrap());
        assert!(frame.has_depth());
        assert_eq!(frame.depth_coverage(), same.depth_coverage());
    }
    let others: Vec<usize> = (0..60).filter(|frame| !keyframes.contains(frame)).collect();
    // Some clicks lie on frames that are no keyframes, and count.
    let clicks = shot.clicks();
    let mut strokes = clicks.strokes.values();
    assert!(strokes.any(|stroke| others.contains(&stroke.frame)));
    let (all, few) = (labelled(&whole, &clicks), labelled(&scene, &clicks));
    let miou = |maps: &[Arc<FrameMap>], frames: &[usize]| {
        capture.miou(frames.iter().map(|&frame| (frame, maps[frame].labels())))
    };
    let (of_keyframes, of_others, of_all) =
        (miou(&few, &keyframes), miou(&few, &others), miou(&all, &others));
    println!("keyframes {of_keyframes:.3}, others {of_others:.3}; others if all were keyframes {of_all:.3}");
    assert!(of_others > 0.5 && of_others > of_keyframes - 0.05 && of_others > of_all - 0.05);
}

#[test]
fn what_alpha_hides_is_hidden_in_frames_that_are_no_keyframes_too() {
    let disk = OnDisk::default();
    let folder = disk.path("room");
    let is_hidden = |x: u32, y: u32| (8..28).contains(&x) && (12..36).contains(&y);
    for number in 0..10 {
        let path = folder.join(format!("rgb/rgb_{number}.png"));
        let mut image = image::open(&path).unwrap().into_rgba8();
        for (x, y, pixel) in image.enumerate_pixels_mut() {
            pixel.0[3] = if is_hidden(x, y) { 0 } else { 255 };
        }
        image.save(&path).unwrap();
    }
    let [whole, scene] = [10, 5].map(|fitting| open(&folder, fitting * 64 * 48));
    assert_eq!(scene.keyframes().len(), 5);
    let note = &scene.notes[0];
    assert!(note.contains("hide pixels in 10 of 10 frames"), "{note}");
    assert_eq!(&whole.notes[0], note);
    let maps = labelled(&scene, &Small::get().labels());
    for ((frame, same), map) in scene.frames.iter().zip(&whole.frames).zip(&maps) {
        assert_eq!(frame.pixels().unwrap(), same.pixels().unwrap());
        let (labels, entropy, depth) = (map.labels(), map.entropy(), frame.depth().unwrap());
        let hidden = frame.hidden_pixels();
        assert_eq!(hidden.len(), 20 * 24);
        for &pixel in hidden.iter() {
            assert!(!frame.is_valid(pixel) && depth.ray_length(pixel).is_none());
            assert_eq!((labels[pixel], entropy[pixel]), (0, 0));
        }
        assert!(labels.iter().any(|&label| label != 0));
    }
}
