//! What every format shares, and the plain one.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;

use super::testing::{export_all, files, labelled_scene};
use super::*;
use crate::labels::testing::clicked;
use crate::labels::{Class, ClassId, History, ObjectId, Stroke, png};
use crate::scene::testing::{self, wall};
use crate::scene::{Camera, Scene, SceneSource};
use crate::semantics::LabelPropagation;
use crate::semantics::testing::propagated;
use crate::session::FrameMap;

fn scene(stems: &[&str]) -> Scene {
    let camera = Camera::with_horizontal_fov(3, 2, 90.0);
    let frame = |stem: &&str| testing::frame(stem, camera, vec![0; 18], None);
    testing::scene(stems.iter().map(frame).collect())
}

fn map(frame: usize, labels: [ClassId; 6]) -> Arc<FrameMap> {
    let entropy = vec![0, 1, 9_999, 10_000, 27_080, 65_535];
    Arc::new(FrameMap::new(frame, 1, [3, 2], labels.to_vec(), entropy).unwrap())
}

fn export_pngs(
    folder: &Path,
    scene: &Scene,
    classes: &[Class],
    maps: &[Arc<FrameMap>],
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    let labelled = labelled_scene(scene, classes, maps);
    export(folder, labelled, Format::Png, &Options::default(), progress)
}

/// The wall in a capture whose unit is a foot, far from its zero, with a click of the first class on its dark part and one
/// of the second on its bright part, propagated.
pub(super) fn distant_wall(frames: usize, classes: &[Class]) -> (Arc<Scene>, LabelPropagation) {
    let mut scene = wall(frames, 64, 48);
    scene.origin = DVec3::new(8000.0, -250.0, 30.5);
    scene.unit = 3.28;
    let mut history = History::new(LabelSet::of_classes(classes.to_vec()));
    history.add_stroke(Stroke::click(0, classes[0].id, [10, 20]));
    history.add_stroke(Stroke::click(0, classes[1].id, [50, 30]));
    let propagation = propagated(&scene, history.labels());
    (Arc::new(scene), propagation)
}

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn every_frame_comes_back_from_its_pngs_and_no_temporary_files_stay() {
    let root = tempfile::tempdir().unwrap();
    let (first, second) = ([0, 1, 255, 1, 1, 0], [0, 1, 256, 1, 1, 0]);
    let classes = [Class::new(1, "wall"), Class::new(256, "lamp")];
    let maps = [map(1, second), map(0, first)];
    let calls = AtomicUsize::new(0);
    let progress = |_, total| {
        assert_eq!(total, 2);
        calls.fetch_add(1, Ordering::Relaxed);
        ControlFlow::Continue(())
    };
    let scene = scene(&["rgb_0", "rgb_1"]);
    let whole = export_pngs(root.path(), &scene, &classes, &maps, &progress).unwrap();
    assert_eq!((calls.into_inner(), whole.files, whole.unchanged), (2, 7, 0));
    let written = files(root.path());
    let names: Vec<&str> = written.keys().map(String::as_str).collect();
    let expected = "classes.json color/rgb_0.png color/rgb_1.png entropy/rgb_0.png entropy/rgb_1.png \
                    labels/rgb_0.png labels/rgb_1.png";
    assert_eq!(names.join(" "), expected);
    let labels = |name: &str| png::decode_gray(&written[name]).unwrap().2;
    assert_eq!(labels("labels/rgb_0.png"), first);
    assert_eq!(labels("labels/rgb_1.png"), second);
    assert_eq!(labels("entropy/rgb_0.png"), maps[0].entropy()[..]);
    let depth = |name: &str| written[name][24];
    assert_eq!([depth("labels/rgb_0.png"), depth("labels/rgb_1.png")], [8, 16]);
    let color = image::load_from_memory(&written["color/rgb_1.png"]).unwrap();
    let colors = [[0; 3], classes[0].color, classes[1].color];
    assert_eq!(color.to_rgb8().as_raw()[..9], *colors.as_flattened());
    let read: Vec<Class> = serde_json::from_slice(&written["classes.json"]).unwrap();
    assert_eq!(read, classes);

    // Only what changed is written again.
    let changed = [map(1, [0; 6]), map(0, first)];
    let before = fs::metadata(root.path().join("labels/rgb_0.png")).unwrap();
    let again = export_pngs(root.path(), &scene, &classes, &changed, &go_on).unwrap();
    assert_eq!([again.files, again.unchanged], [2, 5]);
    let after = fs::metadata(root.path().join("labels/rgb_0.png")).unwrap();
    assert_eq!(before.modified().unwrap(), after.modified().unwrap());
}

#[test]
fn a_cancelled_export_says_how_far_it_came_and_its_files_are_whole_but_no_finished_run() {
    let root = tempfile::tempdir().unwrap();
    let stems: Vec<String> = (0..60).map(|index| format!("rgb_{index}")).collect();
    let stems: Vec<&str> = stems.iter().map(String::as_str).collect();
    let maps: Vec<_> = (0..60).map(|frame| map(frame, [1; 6])).collect();
    let progress = |_, _| ControlFlow::Break(());
    write_report(root.path(), &Report::default()).unwrap();
    let error = export_pngs(root.path(), &scene(&stems), &[], &maps, &progress).unwrap_err();
    let ExportError::Cancelled { written, frames, .. } = error else {
        panic!("{error}");
    };
    // One for each thread at most.
    assert_eq!(frames, 60, "{written} of {frames}");
    assert!((1..60).contains(&written), "{written} of {frames}");
    // Neither a list of classes nor the report of the run before, which would say that all is there.
    let files = files(root.path());
    assert_eq!(files.len(), 3 * written);
    for (name, bytes) in files.iter().filter(|(name, _)| name.starts_with("labels/")) {
        assert_eq!(png::decode_gray(bytes).unwrap().2, [1; 6], "{name}");
    }
}

#[test]
fn nothing_is_written_unless_there_is_one_map_for_every_frame_with_the_probabilities_of_a_threshold() {
    let root = tempfile::tempdir().unwrap();
    let two = scene(&["rgb_0", "rgb_1"]);
    let labels = [1; 6];
    let mut small = FrameMap::clone(&map(1, labels));
    small.width = 2;
    let refused = |scene: &Scene, second: Option<Arc<FrameMap>>, reason: &str| {
        let maps: Vec<_> = [Some(map(0, labels)), second].into_iter().flatten().collect();
        let error = export_pngs(root.path(), scene, &[], &maps, &go_on).unwrap_err();
        assert!(error.to_string().contains(reason), "{error}");
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
    };
    refused(&two, None, "frame \"rgb_1\" has no map yet");
    refused(&two, Some(map(0, labels)), "two maps of frame \"rgb_0\"");
    refused(&two, Some(map(7, labels)), "frame 7");
    refused(&two, Some(Arc::new(small)), "another size");
    let options = Options {
        least_probability: Some(0.5),
        ..Options::default()
    };
    let maps = [map(0, labels), map(1, labels)];
    let error = export_all(root.path(), &two, &[], &maps, (Format::Png, &options)).unwrap_err();
    assert!(error.to_string().contains("probabilities"), "{error}");
}

#[test]
fn what_a_killed_run_left_is_cleared_away() {
    let root = tempfile::tempdir().unwrap();
    prepare(root.path(), &["labels"]).unwrap();
    // No process has this number.
    let left = root.path().join("labels/.a.png.4294967295.inplace-tmp");
    let others = atomic::temporary(&root.path().join("labels/b.png"));
    // A run before this one had its number.
    let same = format!("labels/.{}.{}.inplace-tmp", u64::MAX, std::process::id());
    let same = root.path().join(same);
    for begun in [&left, &others, &same] {
        fs::write(begun, "half").unwrap();
    }
    fs::write(root.path().join("labels/mine.txt"), "kept").unwrap();
    prepare(root.path(), &["labels"]).unwrap();
    assert!(!left.exists() && !same.exists());
    assert_eq!(
        others.exists(),
        cfg!(target_os = "linux"),
        "of an export that still runs"
    );
    assert!(root.path().join("labels/mine.txt").exists());
}

#[test]
fn a_file_with_the_longest_name_can_be_written() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("a".repeat(250));
    write(&path, b"whole").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"whole");
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1);
}

#[test]
fn strokes_on_vanished_frames_are_not_exported() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("strokes.json");
    let history = clicked(&["wall"], &[(0, 1, [2, 3]), (5, 1, [2, 3])]);
    write_strokes(&path, history.labels(), &wall(1, 4, 3).frames).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    assert_eq!(json["strokes"].as_array().unwrap().len(), 1);
    assert_eq!(json["strokes"][0]["frame"], "rgb_0");
}

#[test]
fn an_export_into_the_folder_of_the_capture_leaves_its_images_alone() {
    let root = tempfile::tempdir().unwrap();
    let mut scene = scene(&["rgb_0"]);
    let (classes, maps) = ([Class::new(1, "wall")], [map(0, [1; 6])]);
    for folder in ["color", "images"] {
        fs::create_dir(root.path().join(folder)).unwrap();
    }
    let photo = png::encode_rgb(3, 2, &[7; 18]).unwrap();
    for name in ["color/rgb_0.jpg", "color/rgb_0.png"] {
        scene.frames[0].path = root.path().join(name);
        fs::write(&scene.frames[0].path, &photo).unwrap();
        let early = prepare_pngs(root.path(), &scene).unwrap_err();
        let late = export_pngs(root.path(), &scene, &classes, &maps, &go_on).unwrap_err();
        for error in [early, late] {
            assert!(error.to_string().contains("the capture's own images"), "{error}");
        }
        assert_eq!(fs::read(&scene.frames[0].path).unwrap(), photo);
    }
    // What a data set has a copy of is there already.
    scene.frames[0].path = root.path().join("images/rgb_0.png");
    fs::write(&scene.frames[0].path, &photo).unwrap();
    let options = (Format::CocoInstances, &Options::default());
    let written = export_all(root.path(), &scene, &classes, &maps, options).unwrap();
    assert_eq!((written.files, written.unchanged), (1, 1));
    prepare_pngs(root.path(), &scene).unwrap();
}

#[test]
fn a_copy_of_an_image_takes_the_place_of_no_other_size_of_it_in_the_capture() {
    let root = tempfile::tempdir().unwrap();
    let mut scene = scene(&["rgb_0"]);
    scene.source = SceneSource::Folder(root.path().to_path_buf());
    let (classes, maps) = ([Class::new(1, "wall")], [map(0, [1; 6])]);
    for (folder, shade) in [("images", 7), ("images_4", 8)] {
        fs::create_dir(root.path().join(folder)).unwrap();
        scene.frames[0].path = root.path().join(folder).join("rgb_0.png");
        let photo = png::encode_rgb(3, 2, &[shade; 18]).unwrap();
        fs::write(&scene.frames[0].path, photo).unwrap();
    }
    let large = root.path().join("images/rgb_0.png");
    let before = fs::read(&large).unwrap();
    let into = |folder: &Path| {
        let options = (Format::CocoInstances, &Options::default());
        export_all(folder, &scene, &classes, &maps, options)
    };
    let error = into(root.path()).unwrap_err().to_string();
    assert!(error.contains("the capture's own images"), "{error}");
    assert_eq!(fs::read(&large).unwrap(), before);
    let elsewhere = root.path().join("labels");
    into(&elsewhere).unwrap();
    assert!(elsewhere.join("images/rgb_0.png").is_file());
}

/// A history with a class of things, 4, and one of stuff, 9.
fn panel_and_floor() -> History {
    let mut history = History::default();
    history.add_classes(&[Class::new(4, "panel"), Class::new(9, "floor")]);
    history
}

/// The maps of the wall of three frames by these labels.
fn maps_by(scene: &Arc<Scene>, labels: &LabelSet) -> Vec<Arc<FrameMap>> {
    let propagation = propagated(scene, labels);
    let map = |frame| Arc::new(propagation.map(scene, frame, 1));
    (0..3).map(map).collect()
}

/// Of the wall with its dark and its bright half as two objects of one class, and a third class that is stuff and is not
/// shown.
#[test]
fn objects_that_are_shown_are_listed_with_the_same_numbers_in_all_frames() {
    let scene = Arc::new(wall(3, 64, 48));
    let mut history = panel_and_floor();
    for pixel in [[10, 20], [55, 20]] {
        history.add_object(Stroke::click(0, 4, pixel), &[]).unwrap();
    }
    let labels = history.labels();
    let maps = maps_by(&scene, labels);
    let labelled = LabelledScene::new(&scene, labels, &[], &maps);
    let root = tempfile::tempdir().unwrap();
    export(root.path(), labelled, Format::Png, &Options::default(), &go_on).unwrap();
    let written = files(root.path());
    let list: serde_json::Value = serde_json::from_slice(&written["objects.json"]).unwrap();
    let area = |frame: usize, object: u16| {
        let objects = png::decode_gray(&written[&format!("objects/rgb_{frame}.png")])
            .unwrap()
            .2;
        objects.iter().filter(|&&own| own == object).count()
    };
    let records = [1, 2].map(|object| {
        let areas = [0, 1, 2].map(|frame| area(frame, object));
        assert!(areas.iter().all(|&area| area > 500), "{areas:?}");
        serde_json::json!({
            "id": object, "class_id": 4, "class_name": "panel", "thing": true,
            "name": format!("panel {object}"), "pixels": areas.iter().sum::<usize>(),
        })
    });
    assert_eq!(
        list,
        serde_json::json!(records),
        "what no frame shows is not listed"
    );
    // What is written anew and not to the end has no list that tells of other numbers.
    let stop = |_, _| ControlFlow::Break(());
    fs::remove_file(root.path().join("objects/rgb_0.png")).unwrap();
    let stopped = || export(root.path(), labelled, Format::Png, &Options::default(), &stop);
    assert!(testing::on_threads(1, stopped).is_err());
    assert_eq!(files(root.path())["objects.json"], b"[]\n");
    // Where nothing is known of objects, those of before are none of these labels.
    let map = |frame| FrameMap::new(frame, 2, [64, 48], vec![9; 64 * 48], vec![0; 64 * 48]).unwrap();
    let bare = [0, 1, 2].map(|frame| Arc::new(map(frame)));
    let labelled = labelled_scene(&scene, &labels.classes, &bare);
    export(root.path(), labelled, Format::Png, &Options::default(), &go_on).unwrap();
    let left = files(root.path());
    assert!(
        left.keys().all(|name| !name.starts_with("objects")),
        "{:?}",
        left.keys()
    );
}

#[test]
fn stuff_has_a_number_of_its_own_where_a_thing_has_the_largest() {
    let scene = Arc::new(wall(3, 64, 48));
    let mut history = panel_and_floor();
    history.add_object(Stroke::click(0, 4, [10, 20]), &[]).unwrap();
    history.add_stroke(Stroke::click(0, 9, [55, 20]));
    let mut labels = history.labels().clone();
    let largest = ObjectId::new(u16::MAX).unwrap();
    labels.objects[0].id = largest;
    for stroke in labels.strokes.values_mut().filter(|stroke| stroke.class == 4) {
        Arc::make_mut(stroke).object = Some(largest);
    }
    let maps = maps_by(&scene, &labels);
    let labelled = LabelledScene::new(&scene, &labels, &[], &maps);
    let root = tempfile::tempdir().unwrap();
    export(root.path(), labelled, Format::Png, &Options::default(), &go_on).unwrap();
    let list: serde_json::Value = serde_json::from_slice(&files(root.path())["objects.json"]).unwrap();
    let list = list.as_array().unwrap();
    let ids_of = |class: u16| -> Vec<u64> {
        let own = list.iter().filter(|object| object["class_id"] == class);
        own.map(|object| object["id"].as_u64().unwrap()).collect()
    };
    let (panels, floors) = (ids_of(4), ids_of(9));
    assert!(panels.contains(&u64::from(u16::MAX)), "{panels:?}");
    assert_eq!(floors.len(), 1);
    assert!(!panels.contains(&floors[0]), "{floors:?}");
}
