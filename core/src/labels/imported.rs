//! Whole label images from elsewhere.

mod probabilities;

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

pub use probabilities::{Likeliest, Probabilities};

use super::{ClassId, Label, ObjectId, VOID};

/// Identifies an import of label images for the life of a project; later imports have larger ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ImportId(pub u64);

/// How far label images can be believed beside strokes, from 0 to 1.
///
/// Below 1 each pixel is a vote that may be wrong: votes outvote each other, and the larger the trust, the nearer a
/// stroke has to be to overrule them. At 0 they fill in what no stroke leads to. At 1 every labelled pixel is right,
/// as a stroke is; there may be few of them.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Trust(f32);

impl Trust {
    /// Votes that strokes correct on what they are connected with: noisy annotation, or the predictions of a network.
    pub const VOTES: Self = Self(0.5);
    /// Every labelled pixel is right.
    pub const RIGHT: Self = Self(1.0);

    /// A trust from 0 to 1; `None` for any other number.
    pub fn new(trust: f32) -> Option<Self> {
        (0.0..=1.0).contains(&trust).then_some(Self(trust))
    }

    /// The number, from 0 to 1.
    pub fn value(self) -> f32 {
        self.0
    }

    /// Whether every labelled pixel is right.
    pub fn is_right(self) -> bool {
        self == Self::RIGHT
    }
}

/// What is said of the pixels of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Said {
    Labels(Runs),
    Probabilities(Probabilities),
}

/// A label for every pixel. There may be millions of runs, so they stay as they are when labels become others.
#[derive(Clone, Debug)]
struct Runs {
    /// A label, and how many pixels in the order of the rows had it at first.
    runs: Arc<Vec<(Label, u16)>>,
    /// What each of these labels is now.
    now: FxHashMap<Label, Label>,
}

impl Runs {
    fn new(labels: &[Label]) -> Self {
        let same = labels.chunk_by(|a, b| a == b);
        let runs = same.flat_map(|run| run.chunks(u16::MAX.into()));
        let mut runs: Vec<(Label, u16)> = runs.map(|run| (run[0], run.len() as u16)).collect();
        runs.shrink_to_fit();
        Self {
            now: runs.iter().map(|&(label, _)| (label, label)).collect(),
            runs: Arc::new(runs),
        }
    }

    /// The label of every pixel, row-major.
    fn pixels(&self) -> impl Iterator<Item = Label> + '_ {
        let run = move |(own, length): &(Label, u16)| std::iter::repeat_n(self.now[own], (*length).into());
        self.runs.iter().flat_map(run)
    }

    fn relabelled(&self, label: impl Fn(Label) -> Label) -> Self {
        let now = self.now.iter();
        Self {
            runs: Arc::clone(&self.runs),
            now: now.map(|(&own, &now)| (own, label(now))).collect(),
        }
    }
}

impl PartialEq for Runs {
    fn eq(&self, other: &Self) -> bool {
        self.pixels().eq(other.pixels())
    }
}

impl Eq for Runs {}

/// The label image of a frame, kept as runs of pixels of one label, or its probabilities.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedMap {
    /// Index of the frame.
    pub frame: usize,
    said: Said,
}

impl ImportedMap {
    /// Takes the class of every pixel of a frame, row-major `[height, width]`; [`VOID`] = nothing
    /// is said.
    pub fn new(frame: usize, labels: &[ClassId]) -> Self {
        let labels: Vec<Label> = labels.iter().map(|&class| class.into()).collect();
        Self::with_objects(frame, &labels)
    }

    /// Takes the class and object of every pixel of a frame, row-major `[height, width]`.
    pub fn with_objects(frame: usize, labels: &[Label]) -> Self {
        Self {
            frame,
            said: Said::Labels(Runs::new(labels)),
        }
    }

    /// Takes class probabilities of a frame.
    pub fn of_probabilities(frame: usize, probabilities: Probabilities) -> Self {
        Self {
            frame,
            said: Said::Probabilities(probabilities),
        }
    }

    /// The class of every pixel, row-major: where there are probabilities, the likeliest.
    pub fn labels(&self) -> Vec<ClassId> {
        match &self.said {
            Said::Labels(runs) => runs.pixels().map(|label| label.class).collect(),
            Said::Probabilities(probabilities) => probabilities.labels(),
        }
    }

    /// The object of every pixel, row-major; `None` where no pixel says one.
    pub fn objects(&self) -> Option<Vec<Option<ObjectId>>> {
        match &self.said {
            Said::Labels(runs) if runs.now.values().any(|label| label.object.is_some()) => {
                Some(runs.pixels().map(|label| label.object).collect())
            }
            _ => None,
        }
    }

    /// The class probabilities; `None` where each pixel has one class.
    pub fn probabilities(&self) -> Option<&Probabilities> {
        match &self.said {
            Said::Labels(_) => None,
            Said::Probabilities(probabilities) => Some(probabilities),
        }
    }

    /// Number of pixels of the frame.
    pub fn pixels(&self) -> usize {
        match &self.said {
            Said::Labels(runs) => runs.runs.iter().map(|&(_, length)| usize::from(length)).sum(),
            Said::Probabilities(probabilities) => probabilities.frame_pixels(),
        }
    }

    /// The classes of all pixels, with whatever probability, void not among them.
    pub fn classes(&self) -> BTreeSet<ClassId> {
        match &self.said {
            Said::Labels(runs) => {
                let classes = runs.now.values().map(|label| label.class);
                classes.filter(|&class| class != VOID).collect()
            }
            Said::Probabilities(probabilities) => distinct(probabilities.classes()),
        }
    }

    /// The classes that are the likeliest of any pixel, void not among them.
    pub(super) fn likeliest_classes(&self) -> BTreeSet<ClassId> {
        match &self.said {
            Said::Labels(_) => self.classes(),
            Said::Probabilities(probabilities) => {
                distinct(probabilities.cells().iter().map(Likeliest::class))
            }
        }
    }

    /// The image with other labels; probabilities have classes alone.
    #[must_use]
    pub fn relabelled(&self, label: impl Fn(Label) -> Label) -> Self {
        let said = match &self.said {
            Said::Labels(runs) => Said::Labels(runs.relabelled(label)),
            Said::Probabilities(probabilities) => {
                Said::Probabilities(probabilities.relabelled(|class| label(class.into()).class))
            }
        };
        Self {
            frame: self.frame,
            said,
        }
    }
}

/// The different classes among many, void left out.
fn distinct(classes: impl Iterator<Item = ClassId>) -> BTreeSet<ClassId> {
    let mut seen = vec![false; usize::from(ClassId::MAX) + 1];
    classes.for_each(|class| seen[usize::from(class)] = true);
    (0..=ClassId::MAX)
        .filter(|&class| class != VOID && seen[usize::from(class)])
        .collect()
}

/// Label images from elsewhere, all of one trust.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedLabels {
    /// The images, at most one a frame.
    pub maps: Vec<ImportedMap>,
    /// How far they can be believed.
    pub trust: Trust,
}

impl ImportedLabels {
    /// Images, at most one a frame, and how far they can be believed.
    pub fn new(maps: Vec<ImportedMap>, trust: Trust) -> Self {
        Self { maps, trust }
    }

    /// The image of a frame.
    pub fn of_frame(&self, frame: usize) -> Option<&ImportedMap> {
        self.maps.iter().find(|map| map.frame == frame)
    }

    /// The classes of all pixels, void not among them.
    pub fn classes(&self) -> BTreeSet<ClassId> {
        self.maps.iter().flat_map(ImportedMap::classes).collect()
    }

    /// The objects of all pixels.
    pub fn objects(&self) -> BTreeSet<ObjectId> {
        let labels = self.maps.iter().filter_map(|map| match &map.said {
            Said::Labels(runs) => Some(runs.now.values()),
            Said::Probabilities(_) => None,
        });
        labels.flatten().filter_map(|label| label.object).collect()
    }

    /// The images with other labels; probabilities have classes alone.
    #[must_use]
    pub fn relabelled(&self, label: impl Fn(Label) -> Label) -> Self {
        Self {
            maps: self.maps.iter().map(|map| map.relabelled(&label)).collect(),
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
        assert_eq!(map.classes(), [3, 7, 300].into());
        let merged = map.relabelled(|label| if label.class == 3 { Label::from(300) } else { label });
        assert_eq!(merged.labels()[70_000..], [0, 0, 300, 300, 300]);
        assert_eq!(merged.objects(), None);
        assert_eq!(merged.classes(), [7, 300].into());
        assert_eq!(merged, ImportedMap::new(2, &merged.labels()));
        assert_ne!(merged, map);
        let (Said::Labels(own), Said::Labels(shared)) = (&map.said, &merged.said) else {
            panic!("both have labels");
        };
        assert!(Arc::ptr_eq(&own.runs, &shared.runs));
        let chair = Label::new(7, ObjectId::new(2));
        let told = ImportedMap::with_objects(0, &[Label::from(7), chair, chair, VOID.into()]);
        assert_eq!(told.labels(), [7, 7, 7, VOID]);
        assert_eq!(told.objects().unwrap(), [None, chair.object, chair.object, None]);
    }
}
