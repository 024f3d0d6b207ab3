//! The semantic field by itself: the labels that it renders, measured beside what the surface says.

mod clicks;
mod noise;

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use super::learnt::{learn, surface};
use super::table::csv;
use super::{ConfusionMatrix, EvalError, SceneTruth};
use inplace_core::field::{Ray, Trainer};
use inplace_core::labels::{ClassId, VOID};
use inplace_core::scene::Scene;
use inplace_core::semantics::{SemanticField, Surface};
use inplace_core::session::{Client, SessionOptions, sampling};

/// What is measured.
#[derive(Clone, Debug)]
pub struct FieldExperiment {
    /// The capture and how it is learnt; the seed is that of the labels, too.
    pub session: SessionOptions,
    /// Most seconds of learning the geometry before there are labels; without, until it is learnt.
    pub geometry: Option<Duration>,
    /// Clicks on random pixels of each class.
    pub clicks: usize,
    /// Shares of the training frames' pixels that get a random class, each in a run of its own.
    pub noise: Vec<f64>,
    /// Seconds after the labels at which the answers are measured, ascending.
    pub marks: Vec<f64>,
    /// Every so many pixels along each axis are measured.
    pub stride: usize,
}

/// A scene whose geometry a session has learnt.
struct Learnt {
    /// Those of a session that goes on from there.
    options: SessionOptions,
    scene: Arc<Scene>,
    truth: SceneTruth,
    trainer: Trainer,
    surface: Arc<Surface>,
}

impl Learnt {
    fn of(experiment: &FieldExperiment) -> Result<Self, EvalError> {
        let mut options = experiment.session.clone();
        let mut run = Client::start(options.clone());
        let scene = run.opened()?;
        let truth = SceneTruth::read(&scene)?;
        learn(&mut run, experiment.geometry)?;
        let state = run.saved()?;
        drop(run);
        let trainer = state.field(&scene, options.preset, options.seed)?;
        let surface = surface(&scene, &trainer, 1.0)?;
        options.state = Some(state);
        Ok(Self {
            options,
            scene,
            truth,
            trainer,
            surface,
        })
    }
}

/// Measures the semantic field of a scene: trained by clicks in a session that goes on training, and by noisy
/// label images. It takes the threads that it is run in; the session has its own.
///
/// # Errors
/// A scene without ground truth or without a surface, and whatever stops a session.
pub fn semantic_field(
    experiment: &FieldExperiment,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<FieldPoint>, EvalError> {
    progress("learning the scene");
    let mut learnt = Learnt::of(experiment)?;
    let mut points = Vec::new();
    for &share in &experiment.noise {
        progress(&format!("{:.0}% pixel noise", 100.0 * share));
        points.extend(noise::points(experiment, &learnt, share)?);
    }
    progress("labelling by clicks");
    points.extend(clicks::points(experiment, &mut learnt)?);
    Ok(points)
}

/// How good an answer was so long after its labels were given.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FieldPoint {
    /// Name of the scene.
    pub scene: String,
    /// Whether depth was read.
    pub depth: bool,
    /// The labels that were given, such as `5 clicks a class` or `90% pixel noise`.
    pub labels: String,
    /// Whose answer: `graph`, `maps`, `majority`, `diffusion`, `field` (as from any pose) or
    /// `field, known depth` (rays end at the frame's measured depth, as they do for the others).
    pub answer: &'static str,
    /// Seed of the labels and of the training.
    pub seed: u64,
    /// Seconds since the last label; not a number where the answer does not change.
    pub seconds: f64,
    /// Mean intersection over union on the test frames, every so many pixels along each axis.
    pub miou: f64,
}

/// The points as comma-separated values, `field.csv`.
pub fn table(points: &[FieldPoint]) -> serde_json::Result<String> {
    csv(points, "scene depth labels answer seed seconds miou:4")
}

/// The pixels of the test frames that answers are measured on, and what the points have in common.
struct Measured<'a> {
    scene: &'a Scene,
    truth: &'a SceneTruth,
    /// Every so many pixels along each axis.
    stride: usize,
    labels: String,
    seed: u64,
}

impl<'a> Measured<'a> {
    fn new(experiment: &FieldExperiment, scene: &'a Scene, truth: &'a SceneTruth, labels: String) -> Self {
        Self {
            scene,
            truth,
            stride: experiment.stride.max(1),
            labels,
            seed: experiment.session.seed,
        }
    }

    fn point(&self, answer: &'static str, seconds: f64, miou: f64) -> FieldPoint {
        FieldPoint {
            scene: self.scene.name(),
            depth: self.scene.has_depth(),
            labels: self.labels.clone(),
            answer,
            seed: self.seed,
            seconds,
            miou,
        }
    }

    /// Row-major indices of the pixels of a frame, each with its true class.
    fn pixels(&self, number: usize) -> Vec<(usize, ClassId)> {
        let frame = &self.scene.frames[number];
        let labels = self.truth.in_frame(self.scene, number);
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let first = self.stride / 2;
        let rows = (first..height).step_by(self.stride);
        rows.flat_map(|y| (first..width).step_by(self.stride).map(move |x| y * width + x))
            .map(|pixel| (pixel, labels[pixel]))
            .collect()
    }

    /// mIoU of the classes that `answer` gives for the pixels (by index) of each test frame.
    fn miou(
        &self,
        mut answer: impl FnMut(usize, &[usize]) -> Result<Vec<ClassId>, EvalError>,
    ) -> Result<f64, EvalError> {
        let mut matrix = ConfusionMatrix::default();
        for &frame in &self.truth.test {
            let (pixels, truth): (Vec<usize>, Vec<ClassId>) = self.pixels(frame).into_iter().unzip();
            matrix.add(&truth, &answer(frame, &pixels)?)?;
        }
        let void = "all pixels of the test frames are void; measure on a capture with classes";
        matrix.miou().ok_or_else(|| EvalError::scene(self.scene, void))
    }

    /// The same of a map with a class for every pixel.
    fn miou_of_maps(&self, mut map: impl FnMut(usize) -> Vec<ClassId>) -> Result<f64, EvalError> {
        self.miou(|frame, pixels| {
            let map = map(frame);
            let at = |&pixel: &usize| map.get(pixel).copied().unwrap_or(VOID);
            Ok(pixels.iter().map(at).collect())
        })
    }

    /// mIoU of the labels that a semantic field renders; where `known`, rays end at the frame's measured
    /// depth.
    fn miou_of_field(
        &self,
        semantics: &SemanticField,
        trainer: &Trainer,
        known: bool,
    ) -> Result<f64, EvalError> {
        let classes = semantics.classes();
        let best = |row: &[f32]| {
            let better = |best: usize, index: usize| if row[index] > row[best] { index } else { best };
            classes[(1..row.len()).fold(0, better)]
        };
        self.miou(|frame, pixels| {
            let frame = &self.scene.frames[frame];
            let ray = |&pixel: &usize| {
                let ray = Ray::through(frame, pixel);
                let length = ray.length.filter(|_| known);
                Ray { length, ..ray }
            };
            let rays: Vec<Ray> = pixels.iter().map(ray).collect();
            let (field, occupancy) = (trainer.field(), trainer.occupancy());
            let probabilities = semantics.along_rays(field, occupancy, &rays, sampling(trainer, None))?;
            Ok(probabilities.chunks_exact(classes.len()).map(best).collect())
        })
    }

    /// The points of a field at one time: as from any pose, and where there is depth, with it.
    fn field_points(
        &self,
        semantics: &SemanticField,
        trainer: &Trainer,
        seconds: f64,
    ) -> Result<Vec<FieldPoint>, EvalError> {
        let any_pose = self.miou_of_field(semantics, trainer, false)?;
        let mut points = vec![self.point("field", seconds, any_pose)];
        if self.scene.has_depth() {
            let known = self.miou_of_field(semantics, trainer, true)?;
            points.push(self.point("field, known depth", seconds, known));
        }
        Ok(points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{capture_of, options};
    use inplace_core::labels::Class;
    use inplace_core::scene::SceneSource;

    #[test]
    fn every_answer_is_measured_at_every_time() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("wall");
        capture_of(
            &folder,
            (48, 36),
            [Class::new(1, "dark"), Class::new(2, "bright")],
        );
        let experiment = FieldExperiment {
            session: options(SceneSource::Folder(folder)),
            geometry: Some(Duration::from_millis(500)),
            clicks: 2,
            noise: vec![0.4],
            marks: vec![0.5, 1.0],
            stride: 2,
        };
        let points = semantic_field(&experiment, &mut |_| {}).unwrap();
        let of = |labels: &str, answer: &str| -> Vec<&FieldPoint> {
            let is = |point: &&FieldPoint| point.labels == labels && point.answer == answer;
            points.iter().filter(is).collect()
        };
        let (noise, clicks) = ("40% pixel noise", "2 clicks a class");
        for (labels, answer) in [(noise, "majority"), (noise, "diffusion"), (clicks, "graph")] {
            let [only] = of(labels, answer)[..] else {
                panic!("{points:?}");
            };
            assert!(only.seconds.is_nan() && only.miou > 0.9, "{only:?}");
        }
        for answer in ["field", "field, known depth"] {
            let trained = of(noise, answer);
            let seconds: Vec<f64> = trained.iter().map(|point| point.seconds).collect();
            assert_eq!(seconds, [0.5, 1.0]);
        }
        assert_eq!(of(clicks, "maps").len(), 2);
        let rows = table(&points).unwrap();
        assert_eq!(rows.lines().count(), 1 + points.len());
        assert!(rows.contains(",graph,4,,"));
    }
}
