//! Ground truth of objects, and how good the objects of maps are.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::truth::read_json;
use super::{Failure, LabelImage, SceneTruth, mean, unless_equal, unusable_scene};
use inplace_core::labels::{Class, ClassId, VOID};
use inplace_core::scene::demo::{self, Shot};
use inplace_core::scene::{Scene, SceneSource, numbered_images};

/// An object of the ground truth: a line of `objects.json`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct TrueObject {
    /// Its value in the images of `semantic_instance/`; 0 is void there.
    pub id: u16,
    /// Its class.
    pub class_id: ClassId,
    /// Name of the class.
    pub class_name: String,
    /// Whether it can be counted; all objects of a class that is stuff are one.
    pub thing: bool,
}

/// The objects of a scene, with their images.
#[derive(Clone, Debug)]
pub struct ObjectTruth {
    /// The images hold ids of objects in place of classes.
    pub images: SceneTruth,
    /// All objects by their ids.
    pub objects: BTreeMap<u16, TrueObject>,
}

impl ObjectTruth {
    /// Reads `semantic_instance/` and `objects.json` of a scene's folder, for the frames that have class labels; the demo has
    /// its own.
    ///
    /// # Errors
    /// A scene without them, and files that cannot be used.
    pub fn read(scene: &Scene) -> Result<Self, Failure> {
        let SceneSource::Folder(folder) = &scene.source else {
            return Self::of_demo(scene);
        };
        let expected = "[{\"id\", \"class_id\", \"class_name\", \"thing\"}]";
        let objects: Vec<TrueObject> = read_json(&folder.join("objects.json"), expected)?;
        let objects: BTreeMap<u16, TrueObject> =
            objects.into_iter().map(|object| (object.id, object)).collect();
        let mut images = SceneTruth::read(scene)?;
        let files = numbered_images(&folder.join("semantic_instance"))?;
        for (&frame, classes) in &mut images.images {
            let stem = &scene.frames[frame].stem;
            let own = LabelImage::read(&files, stem)?;
            let own = own.filter(|own| [own.width, own.height] == [classes.width, classes.height]);
            *classes = own.ok_or_else(|| {
                let reason = format!("frame \"{stem}\" has class labels, but no objects of the same size");
                unusable_scene(scene, reason)
            })?;
            let unlisted = |id: &&u16| **id != VOID && !objects.contains_key(id);
            if let Some(id) = classes.labels.iter().find(unlisted) {
                let reason = format!("frame \"{stem}\" shows object {id}, which objects.json does not list");
                return Err(unusable_scene(scene, reason));
            }
        }
        Ok(Self { images, objects })
    }

    fn of_demo(scene: &Scene) -> Result<Self, Failure> {
        let (listed, of_frame) = Shot::default().objects();
        let mut images = SceneTruth::read(scene)?;
        for (&frame, classes) in &mut images.images {
            classes.labels = of_frame(frame);
        }
        let all = demo::classes();
        let object = |(id, class_id)| {
            let class = all.iter().find(|class| class.id == class_id)?;
            let object = TrueObject {
                id,
                class_id,
                class_name: class.name.clone(),
                thing: class.thing,
            };
            Some((id, object))
        };
        let objects = listed.into_iter().filter_map(object).collect();
        Ok(Self { images, objects })
    }

    /// The classes of the objects.
    pub fn classes(&self) -> Vec<Class> {
        let classes: BTreeMap<ClassId, Class> = self
            .objects
            .values()
            .map(|object| {
                let class = Class::new(object.class_id, object.class_name.as_str());
                let thing = object.thing;
                (object.class_id, Class { thing, ..class })
            })
            .collect();
        classes.into_values().collect()
    }

    /// What is compared of a pixel with this value of `semantic_instance`.
    pub fn segment(&self, id: u16) -> Option<Segment> {
        let object = self.objects.get(&id)?;
        Some(Segment {
            class: object.class_id,
            object: if object.thing { id } else { 0 },
        })
    }
}

/// What is compared: an object of a thing class, or all of a class that is stuff.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Segment {
    /// The class.
    pub class: ClassId,
    /// Number of the object; 0 of stuff.
    pub object: u16,
}

/// Pixels by true and predicted segment, over all frames that are measured. Where the truth is void nothing counts.
#[derive(Clone, Debug, Default)]
pub struct SegmentCounts {
    pairs: BTreeMap<(Segment, Option<Segment>), u64>,
    /// Pixels of predicted segments where the truth is void.
    void: BTreeMap<Segment, u64>,
}

/// Intersections over union at which a segment is good, as interactive segmentation counts clicks to them.
pub const GOOD: [f64; 3] = [0.8, 0.85, 0.9];

/// How good segments are, each 0..=1; `None` where there are none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SegmentScores {
    /// Mean over the true segments of the intersection over union with the predicted segment of the same class and number.
    pub iou: Option<f64>,
    /// Shares of the true segments for which that is at least each of [`GOOD`].
    pub good: [f64; 3],
    /// Panoptic quality (Kirillov et al. 2019), pooled over the segments; true and predicted segments match where their
    /// class is the same and their intersection over union is more than one half.
    pub pq: Option<f64>,
    /// Mean intersection over union of the matches.
    pub sq: Option<f64>,
    /// Their share: matches / (matches + half of the others).
    pub rq: Option<f64>,
}

impl SegmentCounts {
    /// Counts the pixels of a frame.
    ///
    /// # Errors
    /// When the two have not the same number of pixels.
    pub fn add(&mut self, truth: &[Option<Segment>], predicted: &[Option<Segment>]) -> Result<(), Failure> {
        unless_equal(truth.len(), predicted.len())?;
        let pairs: Vec<_> = truth.iter().copied().zip(predicted.iter().copied()).collect();
        for run in pairs.chunk_by(|a, b| a == b) {
            let pixels = run.len() as u64;
            match run[0] {
                (Some(truth), predicted) => *self.pairs.entry((truth, predicted)).or_default() += pixels,
                (None, Some(predicted)) => *self.void.entry(predicted).or_default() += pixels,
                (None, None) => {}
            }
        }
        Ok(())
    }

    /// The scores of the segments of some classes.
    pub fn scores(&self, counts: &dyn Fn(ClassId) -> bool) -> SegmentScores {
        let (mut of_truth, mut of_predicted) = (BTreeMap::new(), BTreeMap::new());
        for (&(truth, predicted), &pixels) in &self.pairs {
            *of_truth.entry(truth).or_insert(0) += pixels;
            if let Some(predicted) = predicted {
                *of_predicted.entry(predicted).or_insert(0) += pixels;
            }
        }
        let iou = |truth: Segment, predicted: Segment| {
            let both = self.pairs.get(&(truth, Some(predicted))).copied().unwrap_or(0);
            let sizes =
                [of_truth.get(&truth), of_predicted.get(&predicted)].map(|size| size.copied().unwrap_or(0));
            both as f64 / (sizes[0] + sizes[1] - both).max(1) as f64
        };
        let own: Vec<Segment> = of_truth
            .keys()
            .copied()
            .filter(|truth| counts(truth.class))
            .collect();
        let ious: Vec<f64> = own.iter().map(|&truth| iou(truth, truth)).collect();
        let overlapping = self
            .pairs
            .keys()
            .filter_map(|&(truth, predicted)| Some((truth, predicted?)));
        let matches: Vec<(Segment, f64)> = overlapping
            .filter(|(truth, predicted)| truth.class == predicted.class && counts(truth.class))
            .map(|(truth, predicted)| (predicted, iou(truth, predicted)))
            .filter(|&(_, iou)| iou > 0.5)
            .collect();
        let matched: BTreeSet<Segment> = matches.iter().map(|&(predicted, _)| predicted).collect();
        // What lies mostly in the void is no error.
        let is_wrong = |&(predicted, pixels): &(&Segment, &u64)| {
            let void = self.void.get(predicted).copied().unwrap_or(0);
            counts(predicted.class) && !matched.contains(predicted) && void <= *pixels
        };
        let wrong = of_predicted.iter().filter(is_wrong).count();
        let all = matches.len() as f64 + 0.5 * (own.len() - matches.len() + wrong) as f64;
        let sum: f64 = matches.iter().map(|&(_, iou)| iou).sum();
        let known = |value: f64| (all > 0.0).then_some(value);
        SegmentScores {
            good: GOOD.map(|least| {
                let reached = ious.iter().filter(|&&iou| iou >= least).count();
                reached as f64 / ious.len().max(1) as f64
            }),
            iou: (!ious.is_empty()).then(|| mean(ious)),
            pq: known(sum / all),
            sq: known(sum / matches.len().max(1) as f64),
            rq: known(matches.len() as f64 / all),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two chairs (class 2) and floor (class 1), ten pixels each, then two of void:
    ///
    /// - chair 1: eight pixels right, two of chair 7
    /// - chair 2: all of them of chair 7
    /// - floor: nine right, one of chair 1
    /// - void: a chair 9 of its own
    #[test]
    fn scores_are_those_worked_out_by_hand() {
        let segment = |class, object| Some(Segment { class, object });
        let (floor, [one, two, seven, nine]) = (segment(1, 0), [1, 2, 7, 9].map(|object| segment(2, object)));
        let repeated = |of: &[(Option<Segment>, usize)]| -> Vec<Option<Segment>> {
            of.iter()
                .flat_map(|&(segment, pixels)| vec![segment; pixels])
                .collect()
        };
        let truth = repeated(&[(one, 10), (two, 10), (floor, 10), (None, 2)]);
        let predicted = repeated(&[(one, 8), (seven, 12), (floor, 9), (one, 1), (nine, 2)]);
        let mut counts = SegmentCounts::default();
        counts.add(&truth, &predicted).unwrap();
        assert!(counts.add(&truth, &[]).is_err());
        let close = |found: Option<f64>, expected: f64| {
            assert!((found.unwrap() - expected).abs() < 1e-12, "{found:?}");
        };
        let things = counts.scores(&|class| class == 2);
        // Chair 1: 8 of 11; chair 2 has no prediction of its number, and matches chair 7: 10 of 12.
        close(things.iou, 8.0 / 11.0 / 2.0);
        assert_eq!(things.good, [0.0; 3]);
        assert_eq!(counts.scores(&|class| class == 1).good, [1.0; 3]);
        close(things.pq, (8.0 / 11.0 + 10.0 / 12.0) / 2.0);
        close(things.rq, 1.0);
        close(counts.scores(&|class| class == 1).sq, 0.9);
        assert_eq!(counts.scores(&|class| class == 3).pq, None);
    }
}
