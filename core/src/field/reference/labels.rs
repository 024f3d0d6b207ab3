//! Labelled pixels as the network is trained on them.

use std::collections::BTreeMap;

use crate::labels::{ClassId, LabelSet, VOID, rasterise};
use crate::scene::Scene;

/// The labelled pixels of a scene, with the classes counted from 0; void is not among them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PixelLabels {
    classes: Vec<ClassId>,
    /// Row-major pixel index to index of the class, for each frame that has any.
    frames: BTreeMap<usize, BTreeMap<u32, u32>>,
    /// All of them: (frame, pixel).
    pixels: Vec<(usize, u32)>,
}

impl PixelLabels {
    /// The pixels that strokes cover.
    pub fn new(scene: &Scene, labels: &LabelSet) -> Self {
        let classes: Vec<ClassId> = labels.classes.iter().map(|class| class.id).collect();
        let index = |class: ClassId| classes.iter().position(|&known| known == class);
        let mut frames = BTreeMap::new();
        for (number, frame) in scene.frames.iter().enumerate() {
            let painted = rasterise(labels, number, frame.camera.width, frame.camera.height);
            let known: BTreeMap<u32, u32> = painted
                .into_iter()
                .filter(|(_, (class, _))| *class != VOID)
                .filter_map(|(pixel, (class, _))| Some((pixel, index(class)? as u32)))
                .collect();
            if !known.is_empty() {
                frames.insert(number, known);
            }
        }
        let pixels = frames
            .iter()
            .flat_map(|(&frame, known)| known.keys().map(move |&pixel| (frame, pixel)))
            .collect();
        Self {
            classes,
            frames,
            pixels,
        }
    }

    /// The classes, in the order of the logits.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Index of a pixel's class, where it is labelled.
    pub fn class_of(&self, frame: usize, pixel: usize) -> Option<u32> {
        self.frames.get(&frame)?.get(&(pixel as u32)).copied()
    }

    /// All labelled pixels: (frame, row-major index).
    pub fn pixels(&self) -> &[(usize, u32)] {
        &self.pixels
    }
}
