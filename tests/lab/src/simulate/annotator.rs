//! Where a simulated annotator clicks.

use std::sync::Arc;

use clap::ValueEnum;
use rand::seq::IndexedRandom;
use rand::{SeedableRng, rngs::SmallRng};

use crate::SceneTruth;
use inplace_core::labels::{Class, ClassId, LabelSet, Object, ObjectId, Pixel, Stroke, VOID};
use inplace_core::scene::Scene;

/// How the annotator chooses pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Policy {
    /// One random pixel of every class, then the program's own suggestions.
    Guided,
    /// Equally many random pixels of every class.
    Random,
    /// Random pixels, whatever their class.
    Uniform,
    /// The clicks that a capture brings along whose training frames have no label images.
    Own,
}

impl Policy {
    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Guided => "guided",
            Self::Random => "random",
            Self::Uniform => "uniform",
            Self::Own => "own",
        }
    }
}

/// A labelled pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Click {
    /// Index of the frame.
    pub frame: usize,
    /// The pixel, in the frame (not in its image on disk).
    pub pixel: Pixel,
    /// Its true class; void where the truth has none.
    pub class: ClassId,
}

/// A person who knows the truth of the training frames.
pub struct Annotator<'a> {
    scene: &'a Scene,
    truth: &'a SceneTruth,
    classes: Vec<ClassId>,
}

impl<'a> Annotator<'a> {
    /// Knows the truth of a scene.
    pub fn new(scene: &'a Scene, truth: &'a SceneTruth) -> Self {
        Self {
            classes: truth.classes(),
            scene,
            truth,
        }
    }

    /// The classes that the training frames show.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// The clicks that are chosen without the program's help, for so many clicks a class; those for fewer
    /// are the first of them. Of [`Policy::Guided`] only one click a class is so.
    pub fn clicks(&self, policy: Policy, clicks_per_class: usize, seed: u64) -> Vec<Click> {
        let mut rng = SmallRng::seed_from_u64(seed);
        match policy {
            Policy::Random => self.of_every_class(clicks_per_class, &mut rng),
            Policy::Guided => self.of_every_class(clicks_per_class.min(1), &mut rng),
            Policy::Uniform => {
                let any = |class: ClassId| class != VOID;
                let all = 0..clicks_per_class * self.classes.len();
                all.filter_map(|_| self.random(&self.truth.train, any, &mut rng))
                    .collect()
            }
            Policy::Own => {
                let round = |nth| self.classes.iter().filter_map(move |&class| self.own(class, nth));
                (0..clicks_per_class).flat_map(round).collect()
            }
        }
    }

    /// The n-th of a capture's own clicks on a class.
    fn own(&self, class: ClassId, nth: usize) -> Option<Click> {
        let is_own = |click: &&Click| click.class == class;
        self.truth.clicks.iter().filter(is_own).nth(nth).copied()
    }

    /// Rounds of a random pixel of every class: of a random one of the frames that show it.
    fn of_every_class(&self, rounds: usize, rng: &mut SmallRng) -> Vec<Click> {
        let showing = |class: &ClassId| -> Vec<usize> {
            let shows = |frame: &&usize| self.truth.images[frame].labels.contains(class);
            self.truth.train.iter().filter(shows).copied().collect()
        };
        let showing: Vec<Vec<usize>> = self.classes.iter().map(showing).collect();
        let mut clicks = Vec::new();
        for _ in 0..rounds {
            for (&class, frames) in self.classes.iter().zip(&showing) {
                clicks.extend(self.random(frames, |other| other == class, rng));
            }
        }
        clicks
    }

    /// A random pixel with a fitting class of a random frame; `None` where that frame has none.
    pub fn random(
        &self,
        frames: &[usize],
        fits: impl Fn(ClassId) -> bool,
        rng: &mut SmallRng,
    ) -> Option<Click> {
        let &frame = frames.choose(rng)?;
        let image = &self.truth.images[&frame];
        let fitting: Vec<u32> = (0..image.labels.len() as u32)
            .filter(|&pixel| fits(image.labels[pixel as usize]))
            .collect();
        let &index = fitting.choose(rng)?;
        Some(Click {
            frame,
            pixel: self.scene.frames[frame].of_image([index % image.width, index / image.width])?,
            class: image.labels[index as usize],
        })
    }

    /// Labels a pixel of a frame truly; `None` where the truth does not reach.
    pub fn answer(&self, frame: usize, pixel: Pixel) -> Option<Click> {
        let image = self.truth.images.get(&frame)?;
        let [x, y] = self.scene.frames.get(frame)?.to_image(pixel)?;
        let class = *image.labels.get((y * image.width + x) as usize)?;
        Some(Click { frame, pixel, class })
    }

    /// The clicks as strokes of classes with their true names, later ones over earlier ones.
    pub fn labels(&self, clicks: &[Click]) -> LabelSet {
        let class = |&id: &ClassId| {
            let listed = self.truth.listed.iter().find(|class| class.id == id);
            listed
                .cloned()
                .unwrap_or_else(|| Class::new(id, format!("class {id}")))
        };
        let mut labels = LabelSet::of_classes(self.classes.iter().map(class).collect());
        for click in clicks {
            let stroke = Stroke::click(click.frame, click.class, click.pixel);
            labels.strokes.insert(labels.next_stroke_id(), stroke.into());
        }
        labels
    }
}

/// Has each stroke say an object of its own; all classes become things.
pub fn name_objects(labels: &mut LabelSet) {
    labels.classes.iter_mut().for_each(|class| class.thing = true);
    for (number, stroke) in (1..).zip(labels.strokes.values_mut()) {
        let Some(id) = ObjectId::new(number) else {
            return;
        };
        let (class, name) = (stroke.class, format!("object {number}"));
        labels.objects.push(Object { id, class, name });
        Arc::make_mut(stroke).object = Some(id);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::LabelImage;
    use crate::testing::wall;

    /// Four frames with class 1 on the left, class 2 on the right and void at the top; class 7 is a single
    /// pixel of frame 2.
    pub fn truth(width: u32, height: u32) -> SceneTruth {
        let image = |frame: usize| {
            let class = |index: u32| match (index % width, index / width) {
                (_, 0) => VOID,
                (3, 3) if frame == 2 => 7,
                (x, _) => 1 + ClassId::from(x >= width / 2),
            };
            let labels = (0..width * height).map(class).collect();
            LabelImage::new([width, height], labels)
        };
        SceneTruth {
            images: (0..4).map(|frame| (frame, image(frame))).collect(),
            train: vec![0, 2],
            test: vec![1, 3],
            listed: vec![Class::new(2, "floor")],
            clicks: Vec::new(),
        }
    }

    #[test]
    fn random_clicks_are_balanced_true_and_on_training_frames() {
        let (scene, truth) = (wall(4, 16, 12), truth(16, 12));
        let annotator = Annotator::new(&scene, &truth);
        assert_eq!(annotator.classes(), [1, 2, 7]);
        let clicks = annotator.clicks(Policy::Random, 5, 3);
        for class in [1, 2, 7] {
            assert_eq!(clicks.iter().filter(|click| click.class == class).count(), 5);
        }
        for click in &clicks {
            assert!(truth.train.contains(&click.frame));
            assert_eq!(annotator.answer(click.frame, click.pixel), Some(*click));
        }
        assert!(clicks.iter().any(|click| click.frame == 0));
        let labels = annotator.labels(&clicks);
        assert_eq!(labels.strokes.len(), 15);
        let named = labels
            .classes
            .iter()
            .map(|class| (class.name.as_str(), class.thing));
        assert!(named.eq([("class 1", true), ("floor", false), ("class 7", true)]));
    }

    #[test]
    fn fewer_clicks_are_the_first_of_more() {
        let (scene, truth) = (wall(4, 16, 12), truth(16, 12));
        let annotator = Annotator::new(&scene, &truth);
        for policy in [Policy::Random, Policy::Uniform] {
            let (few, many) = (annotator.clicks(policy, 1, 9), annotator.clicks(policy, 4, 9));
            assert_eq!((few.len(), many.len()), (3, 12));
            assert_eq!(few, many[..3]);
            assert_ne!(few, annotator.clicks(policy, 1, 10));
        }
        let first = annotator.clicks(Policy::Random, 1, 9);
        assert_eq!(annotator.clicks(Policy::Guided, 4, 9), first);
        let uniform = annotator.clicks(Policy::Uniform, 30, 9);
        assert!(uniform.iter().all(|click| click.class != VOID));
    }
}
