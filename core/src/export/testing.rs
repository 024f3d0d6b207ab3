//! A small scene with label maps that have all that is hard to write: regions in regions, diagonals, lines of one pixel,
//! specks.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use super::layout::Labelled;
use super::{ExportError, Format, LabelledScene, Options, Written, export};
use crate::labels::{Class, ClassId, VOID};
use crate::scene::{Camera, Scene, testing};
use crate::session::FrameMap;

pub(super) const WIDTH: u32 = 24;
pub(super) const HEIGHT: u32 = 18;
pub(super) const SIZE: [u32; 2] = [WIDTH, HEIGHT];

/// The classes of the maps; the first two share a colour.
pub(super) fn classes() -> Vec<Class> {
    let mut classes: Vec<Class> = [
        (1, "wall"),
        (3, "chair, red"),
        (7, "lamp"),
        (70, "sofa"),
        (200, "tüte"),
    ]
    .map(|(id, name)| Class::new(id, name))
    .into();
    classes[1].color = classes[0].color;
    classes
}

/// Two frames with images.
pub(super) fn scene() -> Scene {
    let camera = Camera::with_horizontal_fov(WIDTH, HEIGHT, 90.0);
    let frame = |number: u32| {
        let pixel = |index: u32| {
            let (x, y) = (index % WIDTH, index / WIDTH);
            [(x * 9) as u8, (y * 11) as u8, 60 + 40 * number as u8]
        };
        let rgb = (0..WIDTH * HEIGHT).flat_map(pixel).collect();
        testing::frame(&format!("rgb_{number}"), camera, rgb, None)
    };
    testing::scene(vec![frame(0), frame(1)])
}

/// A frame of the scene with these labels, row-major, as a format gets it.
pub(super) fn labelled<'a>(
    scene: &'a Scene,
    size: [u32; 2],
    classes: &'a [Class],
    labels: Vec<ClassId>,
) -> Labelled<'a> {
    Labelled {
        frame: &scene.frames[0],
        number: 1,
        size,
        entropy: Vec::new(),
        objects: None,
        listed: &[],
        classes,
        labels,
    }
}

/// All files below a folder, by their paths in it.
pub(super) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            let inner = files(&entry.path()).into_iter();
            found.extend(inner.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

/// A map for each list of labels, of frames of this size, without entropy.
pub(super) fn maps(size: [u32; 2], labels: &[Vec<ClassId>]) -> Vec<Arc<FrameMap>> {
    let map = |(frame, labels): (usize, &Vec<ClassId>)| {
        let entropy = vec![0; labels.len()];
        Arc::new(FrameMap::new(frame, 1, size, labels.clone(), entropy).unwrap())
    };
    labels.iter().enumerate().map(map).collect()
}

/// A scene with maps and without objects.
pub(super) fn labelled_scene<'a>(
    scene: &'a Scene,
    classes: &'a [Class],
    maps: &'a [Arc<FrameMap>],
) -> LabelledScene<'a> {
    LabelledScene {
        scene,
        classes,
        objects: &[],
        parts: &[],
        maps,
    }
}

/// Exports to the end.
pub(super) fn export_all(
    folder: &Path,
    scene: &Scene,
    classes: &[Class],
    maps: &[Arc<FrameMap>],
    (format, options): (Format, &Options),
) -> Result<Written, ExportError> {
    let labelled = labelled_scene(scene, classes, maps);
    export(folder, labelled, format, options, &|_, _| {
        ControlFlow::Continue(())
    })
}

/// A label map, row-major `[height, width]`, another for each number: rings and boxes in each other, diagonals, and one
/// pixel in so many at random.
pub(super) fn labels(number: usize) -> Vec<ClassId> {
    let mut state = 17 + number as u32;
    let mut next = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    let ids: Vec<ClassId> = [VOID]
        .into_iter()
        .chain(classes().iter().map(|class| class.id))
        .collect();
    let mut labels = vec![ids[next(6) as usize]; (WIDTH * HEIGHT) as usize];
    for _ in 0..8 {
        let (x, y) = (next(WIDTH), next(HEIGHT));
        let (width, height) = (1 + next(WIDTH - x), 1 + next(HEIGHT - y));
        let (id, kind) = (ids[next(6) as usize], next(3));
        for row in y..y + height {
            for column in x..x + width {
                let at_border = row == y || column == x || row + 1 == y + height || column + 1 == x + width;
                let is_drawn = match kind {
                    0 => true,
                    1 => at_border,
                    _ => row - y == column - x,
                };
                if is_drawn {
                    labels[(row * WIDTH + column) as usize] = id;
                }
            }
        }
    }
    let sparse = 2 + 5 * number as u32 % 37;
    for label in &mut labels {
        if next(sparse) == 0 {
            *label = ids[next(6) as usize];
        }
    }
    labels
}
