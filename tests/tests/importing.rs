//! What becomes of labels from elsewhere that are small or predicted, on the demo scene: from the files that a
//! folder has to the maps that a session shows.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use inplace_core::export::write_json;
use inplace_core::labels::{ClassId, History, LabelSet, Trust, read_label_images};
use inplace_core::scene::demo;
use inplace_core::semantics::{LabelPropagation, Surface, SurfaceImport};
use inplace_tests::Small;
use rand::{Rng, SeedableRng, rngs::SmallRng};

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
const FRAMES: usize = 10;

/// A part of the demo scene and its surface.
struct Room {
    capture: Small,
    surface: Arc<Surface>,
}

static ROOM: LazyLock<Room> = LazyLock::new(|| {
    let capture = Small::of(demo::Shot::new(FRAMES, [WIDTH as u32, HEIGHT as u32]));
    let surface = Arc::new(Surface::build(&capture.scene, &[], 5.0).unwrap());
    Room { capture, surface }
});

impl Room {
    /// The maps of all frames from the label images of a folder alone.
    fn maps(&self, folder: &Path, trust: Trust) -> Vec<Vec<ClassId>> {
        let Small { scene, classes, .. } = &self.capture;
        let images = read_label_images(folder, scene, classes, trust).unwrap();
        assert_eq!((images.labels.maps.len(), images.unmatched), (FRAMES, 0));
        let mut history = History::new(LabelSet::of_classes(classes.clone()));
        history.import(images);
        let mut spread = LabelPropagation::new(Arc::clone(&self.surface));
        spread.set_labels(scene, history.labels());
        spread.set_import(SurfaceImport::new(&self.surface, history.labels()).unwrap());
        (0..FRAMES)
            .map(|frame| spread.map(scene, frame, 1).labels().into_owned())
            .collect()
    }
}

#[test]
fn labels_of_an_eighth_of_the_size_come_out_sharper_than_enlarged_ones() {
    const FACTOR: usize = 8;
    let (room, capture) = (&*ROOM, &ROOM.capture);
    let folder = tempfile::tempdir().unwrap();
    let [width, height] = [WIDTH / FACTOR, HEIGHT / FACTOR];
    let mut enlarged = Vec::new();
    for (frame, labels) in capture.truth.iter().enumerate() {
        let middle = |at: usize| at * FACTOR + FACTOR / 2;
        let small: Vec<ClassId> = (0..width * height)
            .map(|pixel| labels[middle(pixel / width) * WIDTH + middle(pixel % width)])
            .collect();
        let ids = small.iter().map(|&id| u8::try_from(id).unwrap()).collect();
        let image = image::GrayImage::from_raw(width as u32, height as u32, ids).unwrap();
        image
            .save(folder.path().join(format!("rgb_{frame}.png")))
            .unwrap();
        let of = |pixel: usize| small[pixel / WIDTH / FACTOR * width + pixel % WIDTH / FACTOR];
        enlarged.push((0..WIDTH * HEIGHT).map(of).collect::<Vec<ClassId>>());
    }
    let before = capture.miou(enlarged.iter().enumerate());
    for trust in [Trust::VOTES, Trust::RIGHT] {
        let after = capture.miou(room.maps(folder.path(), trust).iter().enumerate());
        println!("an eighth of the size, {trust:?}: {before:.3} to {after:.3}");
        assert!(after > before + 0.2, "{trust:?}: {before} {after}");
    }
}

/// Probabilities `[classes, height, width]` of half the size, of which the likeliest class is wrong in about half of
/// the patches, as sure as in the others.
fn predicted(capture: &Small, frame: usize) -> Vec<f32> {
    const PATCH: usize = 6;
    let [width, height] = [WIDTH / 2, HEIGHT / 2];
    let mut rng = SmallRng::seed_from_u64(100 + frame as u64);
    let count = capture.classes.len();
    let patches: Vec<Option<usize>> = (0..width.div_ceil(PATCH) * height.div_ceil(PATCH))
        .map(|_| rng.random_bool(0.5).then(|| rng.random_range(0..count)))
        .collect();
    let mut values = vec![0.0; count * width * height];
    for pixel in 0..width * height {
        let (x, y) = (pixel % width, pixel / width);
        let id = capture.truth[frame][2 * y * WIDTH + 2 * x];
        let right = capture.classes.iter().position(|class| class.id == id);
        let wrong = patches[y / PATCH * width.div_ceil(PATCH) + x / PATCH];
        let peak = rng.random_range(0.3..0.9);
        for class in 0..count {
            let is_peak = wrong.or(right) == Some(class);
            let share = if is_peak {
                peak
            } else {
                (1.0 - peak) / (count - 1) as f32
            };
            values[class * width * height + pixel] = share;
        }
    }
    values
}

#[test]
fn predictions_that_are_wrong_in_half_of_each_frame_agree_on_what_is_right() {
    let (room, capture) = (&*ROOM, &ROOM.capture);
    let folder = tempfile::tempdir().unwrap();
    let [width, height] = [WIDTH / 2, HEIGHT / 2];
    for frame in 0..FRAMES {
        let values = predicted(capture, frame);
        let header = format!(
            "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {height}, {width}), }}\n",
            capture.classes.len()
        );
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.as_bytes());
        file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        fs::write(folder.path().join(format!("rgb_{frame}.npy")), file).unwrap();
    }
    write_json(&folder.path().join("classes.json"), &capture.classes).unwrap();
    let images = read_label_images(folder.path(), &capture.scene, &[], Trust::VOTES).unwrap();
    let maps = images.labels.maps.iter();
    let single = maps.map(|map| capture.miou([(map.frame, map.labels())]));
    let best = single.fold(0.0, f64::max);
    let fused = room.maps(folder.path(), Trust::VOTES);
    let each = fused.iter().enumerate().map(|fused| capture.miou([fused]));
    let least = each.fold(1.0, f64::min);
    let all = capture.miou(fused.iter().enumerate());
    println!("half-wrong predictions: at best {best:.3} to at least {least:.3}, in all {all:.3}");
    assert!(best < 0.5 && least > best + 0.2, "{best} {least}");
}
