//! How far the radiance field of a session is trained: as far as something reads it, and no further than its readers
//! gain from it.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::semantic_trainer::Readers;
use crate::field::{Preset, Trainer};
use crate::labels::ClassId;
use crate::scene::{Frame, Scene};
use crate::semantics::LabelPropagation;

/// How long training goes on after a view of the field was asked for.
const VIEWED: Duration = Duration::from_secs(10);
/// The depth that fills holes stands when its held-out error, measured every so many steps, has fallen by less than
/// this share since the measurement before.
const DEPTH_GAIN: f32 = 0.1;
/// The labels stand when all further training is expected to change the mean IoU between maps by less than this.
const LABEL_GAIN: f32 = 0.02;
/// How much smaller each change of the maps is than the one before, where only one was seen; and at most.
const USUAL_RATIO: f32 = 0.5;
const MOST_RATIO: f32 = 0.8;
/// Every so many pixels of a frame are compared.
const COMPARED_EVERY: usize = 31;

/// Why the field is trained no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainingEnd {
    /// Depth is measured everywhere: nothing reads the field.
    NotNeeded,
    /// Its depth, which fills holes in the measured depth, has stopped improving.
    DepthStands,
    /// More training would hardly change the labels.
    LabelsStand,
    /// It has learnt what it can.
    Learnt,
}

impl TrainingEnd {
    /// The reason, for people.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::NotNeeded => "depth was measured everywhere, so nothing had to be learnt",
            Self::DepthStands => "the learnt depth that fills holes in the measured depth stopped improving",
            Self::LabelsStand => "more training would hardly change the labels",
            Self::Learnt => "the scene has been learnt",
        }
    }
}

/// How much of the keyframes' pixels has measured depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// All of every keyframe, or nearly.
    All,
    /// At least half: the field fills holes.
    Most,
    /// Less, so that most of the surface is the field's, and the labels gain from the semantic field.
    Little,
}

impl Measured {
    /// What is measured of a scene.
    pub fn of(scene: &Scene) -> Self {
        let keyframes = || scene.frames.iter().filter(|frame| frame.is_keyframe());
        let covered: f32 = keyframes().filter_map(Frame::depth_coverage).sum();
        if keyframes().all(Frame::has_complete_depth) {
            Self::All
        } else if 2.0 * covered >= keyframes().count() as f32 {
            Self::Most
        } else {
            Self::Little
        }
    }
}

/// What reads the field, and what it still gains.
#[derive(Debug)]
pub(super) struct Demand {
    /// Whether views of the field will be wanted, and whether it is to be as good as it can be, whoever reads it.
    views: bool,
    to_the_end: bool,
    /// How much of the surface is measured.
    measured: Measured,
    /// The newest relative error of the depth.
    depth: Option<f32>,
    depth_stands: bool,
    /// By how much the newest surface changed the maps, 1 - mean IoU.
    change: Option<f32>,
    labels_stand: bool,
    viewed: Option<Instant>,
}

impl Demand {
    /// Of a scene.
    pub(super) fn new(scene: &Scene, preset: Preset, views: bool) -> Self {
        Self {
            views,
            to_the_end: views || preset == Preset::Accurate,
            measured: Measured::of(scene),
            depth: None,
            depth_stands: false,
            change: None,
            labels_stand: false,
            viewed: None,
        }
    }

    /// Who reads the semantic field. The maps do where little depth is measured; along it, labels spread better without.
    pub(super) fn readers(&self) -> Readers {
        Readers {
            maps: self.measured == Measured::Little,
            views: self.views || self.is_viewed(),
        }
    }

    fn is_viewed(&self) -> bool {
        self.viewed.is_some_and(|viewed| viewed.elapsed() < VIEWED)
    }

    /// Somebody looks at a view of the field.
    pub(super) fn view(&mut self) {
        self.viewed = Some(Instant::now());
    }

    /// There are other labels: whether they stand is not known.
    pub(super) fn labels_changed(&mut self) {
        self.change = None;
        self.labels_stand = false;
    }

    /// Takes notice of a training step.
    pub(super) fn stepped(&mut self, trainer: &Trainer) {
        let error = trainer.error().and_then(|error| error.relative_depth_error);
        // It is measured anew only now and then.
        if let Some(error) = error.filter(|_| error != self.depth) {
            let before = self.depth.replace(error);
            self.depth_stands |= before.is_some_and(|before| error > (1.0 - DEPTH_GAIN) * before);
        }
    }

    /// Takes notice of a better surface with the same labels as the one before.
    pub(super) fn surface_changed(&mut self, before: &LabelPropagation, after: &LabelPropagation) {
        let is_read = self.measured == Measured::Little;
        let Some(now) = is_read.then(|| change(before, after)).flatten() else {
            return;
        };
        let earlier = self.change.replace(now);
        let ratio = earlier.map_or(USUAL_RATIO, |earlier| (now / earlier).min(MOST_RATIO));
        // The changes to come are a geometric series.
        self.labels_stand = now * ratio / (1.0 - ratio) < LABEL_GAIN;
    }

    /// Why training has ended, if it has.
    pub(super) fn end(&self, trainer: &Trainer) -> Option<TrainingEnd> {
        if trainer.settled() {
            return Some(TrainingEnd::Learnt);
        }
        if self.to_the_end || self.is_viewed() {
            return None;
        }
        match self.measured {
            Measured::All => Some(TrainingEnd::NotNeeded),
            Measured::Most => self.depth_stands.then_some(TrainingEnd::DepthStands),
            Measured::Little => self.labels_stand.then_some(TrainingEnd::LabelsStand),
        }
    }
}

/// 1 - mean IoU between the maps of two surfaces of one scene, over the classes of either; `None` without labels.
fn change(before: &LabelPropagation, after: &LabelPropagation) -> Option<f32> {
    let label = |propagation: &LabelPropagation, frame: usize, pixel: usize| {
        let node = propagation.surface().pixels[frame].node(pixel)?;
        Some(propagation.posterior().labels[node as usize])
    };
    // Pixels of each class before, after, and in both.
    let mut counts: BTreeMap<ClassId, [u32; 3]> = BTreeMap::new();
    for (frame, pixels) in after.surface().pixels.iter().enumerate() {
        for pixel in (0..pixels.len()).step_by(COMPARED_EVERY) {
            let labels = (label(before, frame, pixel), label(after, frame, pixel));
            if let (Some(old), Some(new)) = labels {
                counts.entry(old).or_default()[0] += 1;
                counts.entry(new).or_default()[1] += 1;
                counts.entry(new).or_default()[2] += u32::from(old == new);
            }
        }
    }
    let iou = |[old, new, both]: &[u32; 3]| *both as f32 / (old + new - both) as f32;
    let classes = counts.len();
    (classes > 1).then(|| 1.0 - counts.values().map(iou).sum::<f32>() / classes as f32)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::labels::testing::clicked;
    use crate::scene::testing::wall;
    use crate::semantics::testing::propagated;

    /// A wall in five frames, of which the first so many have measured depth.
    fn measured_in(frames: usize) -> Arc<Scene> {
        let mut scene = wall(5, 64, 48);
        scene.frames[frames..]
            .iter_mut()
            .for_each(|frame| frame.set_depth(None));
        Arc::new(scene)
    }

    fn demand(scene: &Scene) -> Demand {
        Demand::new(scene, Preset::Fast, false)
    }

    #[test]
    fn the_less_is_measured_the_more_reads_the_field() {
        for (frames, needs_training, prior) in [(5, false, false), (3, true, false), (2, true, true)] {
            let scene = measured_in(frames);
            let trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
            let mut demand = demand(&scene);
            assert_eq!(demand.end(&trainer).is_none(), needs_training, "{frames}");
            assert_eq!(demand.readers().maps, prior, "{frames}");
            demand.depth_stands = true;
            let stands = (!prior).then_some(match needs_training {
                true => TrainingEnd::DepthStands,
                false => TrainingEnd::NotNeeded,
            });
            assert_eq!(demand.end(&trainer), stands, "{frames}");
            for (preset, views) in [(Preset::Accurate, false), (Preset::Fast, true)] {
                assert_eq!(Demand::new(&scene, preset, views).end(&trainer), None, "{frames}");
            }
            demand.view();
            assert_eq!(demand.end(&trainer), None, "{frames}");
        }
    }

    #[test]
    fn labels_stand_when_a_new_surface_hardly_changes_them_until_there_are_others() {
        let scene = wall(5, 64, 48);
        let labelled = |clicks: &[_]| propagated(&scene, clicked(&["dark", "bright"], clicks).labels());
        let [dark, bright] = [(0, 1, [10, 20]), (4, 2, [50, 30])];
        let (both, moved) = (labelled(&[dark, bright]), labelled(&[dark, (4, 2, [60, 30])]));
        let mut demand = demand(&measured_in(0));
        demand.surface_changed(&labelled(&[]), &labelled(&[]));
        assert!(!demand.labels_stand, "there are no labels");
        demand.surface_changed(&both, &labelled(&[dark]));
        assert!(!demand.labels_stand);
        demand.surface_changed(&both, &moved);
        assert!(demand.labels_stand);
        demand.labels_changed();
        assert!(!demand.labels_stand);
    }
}
