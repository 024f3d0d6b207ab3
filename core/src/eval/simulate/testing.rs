//! A small capture with ground truth for the tests of measurements.

use crate::labels::{Class, ClassId};
use crate::scene::testing::wall;
use crate::scene::{GroundTruth, write_replica};

/// Writes six frames of a wall that is dark on the left and bright on the right, each a class of its own; every
/// other frame is held out.
pub fn capture(folder: &std::path::Path) {
    let scene = wall(6, 64, 48);
    let labels: Vec<Vec<ClassId>> = scene
        .frames
        .iter()
        .map(|frame| {
            let class = |pixel| 1 + ClassId::from(frame.color().pixel(pixel)[0] > 128);
            (0..frame.camera.pixels()).map(class).collect()
        })
        .collect();
    let truth = GroundTruth {
        classes: &[Class::new(1, "dark"), Class::new(2, "bright")],
        labels: &|frame| labels[frame].clone(),
        held_out: &[1, 3, 5],
    };
    write_replica(&scene, folder, Some(&truth)).unwrap();
}
