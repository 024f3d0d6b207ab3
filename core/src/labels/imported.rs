//! Whole label images from elsewhere.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{ClassId, VOID};

/// Identifies an import of label images for the life of a project; later imports have larger ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ImportId(pub u64);

/// How far label images can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trust {
    /// Every labelled pixel is right, as a stroke is; there may be few of them.
    Trusted,
    /// Each pixel is a vote that may be wrong: noisy annotation, or the predictions of a network.
    Votes,
}

/// The label image of a frame, kept as runs of pixels of one class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedMap {
    /// Index of the frame.
    pub frame: usize,
    /// A class, and how many pixels in the order of the rows have it.
    runs: Vec<(ClassId, u16)>,
}

impl ImportedMap {
    /// Takes the class of every pixel of a frame, row-major `[height, width]`; [`VOID`] = nothing
    /// is said.
    pub fn new(frame: usize, labels: &[ClassId]) -> Self {
        let mut runs: Vec<(ClassId, u16)> = Vec::new();
        for &label in labels {
            match runs.last_mut() {
                Some((class, length)) if *class == label && *length < u16::MAX => *length += 1,
                _ => runs.push((label, 1)),
            }
        }
        runs.shrink_to_fit();
        Self { frame, runs }
    }

    /// The class of every pixel, row-major.
    pub fn labels(&self) -> Vec<ClassId> {
        let mut labels = Vec::with_capacity(self.pixels());
        for &(class, length) in &self.runs {
            labels.resize(labels.len() + usize::from(length), class);
        }
        labels
    }

    /// The runs of pixels of one class, in the order of the rows.
    pub fn runs(&self) -> impl Iterator<Item = (ClassId, usize)> + '_ {
        self.runs
            .iter()
            .map(|&(class, length)| (class, usize::from(length)))
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.runs().map(|(_, length)| length).sum()
    }

    /// The image with other classes.
    #[must_use]
    pub fn relabelled(&self, class: impl Fn(ClassId) -> ClassId) -> Self {
        let runs = self.runs.iter().map(|&(own, length)| (class(own), length));
        Self {
            frame: self.frame,
            runs: runs.collect(),
        }
    }
}

/// Label images from elsewhere, all of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedLabels {
    /// The images, at most one a frame.
    pub maps: Vec<ImportedMap>,
    /// How far they can be believed.
    pub trust: Trust,
}

impl ImportedLabels {
    /// The image of a frame.
    pub fn of_frame(&self, frame: usize) -> Option<&ImportedMap> {
        self.maps.iter().find(|map| map.frame == frame)
    }

    /// The classes of all pixels, void not among them.
    pub fn classes(&self) -> BTreeSet<ClassId> {
        let runs = self.maps.iter().flat_map(ImportedMap::runs);
        runs.map(|(class, _)| class)
            .filter(|&class| class != VOID)
            .collect()
    }

    /// The images with other classes.
    #[must_use]
    pub fn relabelled(&self, class: impl Fn(ClassId) -> ClassId) -> Self {
        Self {
            maps: self.maps.iter().map(|map| map.relabelled(&class)).collect(),
            trust: self.trust,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_back_from_runs_of_any_length() {
        let mut labels = vec![7; 70_000];
        labels.extend([0, 0, 3, 300, 300]);
        let map = ImportedMap::new(2, &labels);
        assert_eq!((map.labels(), map.pixels()), (labels, 70_005));
        let merged = map.relabelled(|class| if class == 3 { 300 } else { class });
        assert_eq!(merged.labels()[70_000..], [0, 0, 300, 300, 300]);
    }
}
