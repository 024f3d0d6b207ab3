//! A small scene with label maps that have all that is hard to write: regions in regions, diagonals, lines of one pixel,
//! specks.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::tests::{files, scene as empty_scene};
use super::{Format, LabelledScene, Options, export};
use crate::labels::{Class, ClassId, VOID};
use crate::scene::{Camera, ColorImage, Scene};
use crate::session::FrameMap;

/// Columns of each frame.
pub(super) const WIDTH: u32 = 24;
/// Rows of each frame.
pub(super) const HEIGHT: u32 = 18;
/// Columns and rows.
pub(super) const SIZE: [u32; 2] = [WIDTH, HEIGHT];

/// What was exported, and from what.
pub(super) struct Exported {
    /// By their paths below the folder.
    pub(super) files: BTreeMap<String, Vec<u8>>,
    /// The label map of each frame, row-major `[height, width]`.
    pub(super) labels: Vec<Vec<ClassId>>,
}

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
    let mut scene = empty_scene(&["rgb_0", "rgb_1"]);
    for (number, frame) in scene.frames.iter_mut().enumerate() {
        let pixel = |index: u32| {
            let (x, y) = (index % WIDTH, index / WIDTH);
            [(x * 9) as u8, (y * 11) as u8, 60 + 40 * number as u8]
        };
        let rgb = (0..WIDTH * HEIGHT).flat_map(pixel).collect();
        frame.camera = Camera::with_horizontal_fov(WIDTH, HEIGHT, 90.0);
        frame.set_color(ColorImage::new(WIDTH, HEIGHT, rgb).unwrap());
    }
    scene
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

/// Exports the scene with the maps 2 and 3.
pub(super) fn exported(format: Format) -> Exported {
    let scene = scene();
    let labels = vec![labels(2), labels(3)];
    let map = |(frame, labels): (usize, &Vec<ClassId>)| {
        let map = FrameMap::new(frame, 1, SIZE, labels.clone(), vec![0; labels.len()]).unwrap();
        Arc::new(map)
    };
    let maps: Vec<Arc<FrameMap>> = labels.iter().enumerate().map(map).collect();
    let labelled = LabelledScene {
        scene: &scene,
        classes: &classes(),
        maps: &maps,
    };
    let write = |folder: &std::path::Path| {
        export(folder, labelled, format, &Options::default(), &|_, _| {
            ControlFlow::Continue(())
        })
        .unwrap();
        files(folder)
    };
    let (root, again) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let files = write(root.path());
    assert_eq!(files, write(again.path()), "the same maps give the same bytes");
    Exported { files, labels }
}
