//! The baselines beside our own way.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::baseline::Task;
use super::{Annotator, Baseline, Experiment, Policy, SimulatedPoint};
use crate::learnt::{pool, surface};
use crate::{EvalError, SceneTruth};
use inplace_core::scene::Scene;
use inplace_core::session::SessionOptions;

/// One run of the experiment: a scene that has been learnt with one seed.
pub(super) struct Run<'a> {
    pub(super) experiment: &'a Experiment,
    /// With the learnt field.
    pub(super) options: &'a SessionOptions,
    pub(super) scene: &'a Arc<Scene>,
    pub(super) annotator: &'a Annotator<'a>,
    pub(super) truth: &'a SceneTruth,
    /// Seconds until the scene was open.
    pub(super) opening_s: f64,
    /// Seconds until it was open and learnt.
    pub(super) learnt_s: f64,
}

impl Run<'_> {
    /// The baselines on the clicks of [`Policy::Random`]; `own` are our points, this seed's among them.
    pub(super) fn compared(
        &self,
        own: &[SimulatedPoint],
        progress: &mut dyn FnMut(&str),
    ) -> Result<Vec<SimulatedPoint>, EvalError> {
        let (options, scene, test) = (self.options, self.scene, &self.truth.test);
        let Some(state) = &options.state else {
            return Ok(Vec::new());
        };
        let pool = pool(options.threads)?;
        let surface = pool.install(|| {
            let trainer = state.field(scene, options.preset, options.seed)?;
            surface(scene, &trainer, 1.0)
        })?;
        let batches = self.experiment.batches();
        let most = batches.last().copied().unwrap_or(0);
        let planned = self.annotator.clicks(Policy::Random, most, options.seed);
        let mut points = Vec::new();
        for &baseline in &self.experiment.baselines {
            let before = match baseline {
                Baseline::Nearest | Baseline::JointMlp => self.learnt_s,
                Baseline::Pixels => self.opening_s,
                // It opens the scene itself.
                Baseline::Reference => 0.0,
            };
            for &clicks_per_class in &batches {
                let name = format!("{}/{}", Policy::Random.name(), baseline.name());
                let seed = options.seed;
                progress(&format!("seed {seed}, {name}: {clicks_per_class} clicks a class"));
                let most = clicks_per_class * self.annotator.classes().len();
                let given = &planned[..planned.len().min(most)];
                let same = |point: &&SimulatedPoint| {
                    (point.policy.as_str(), point.seed, point.clicks_per_class)
                        == (Policy::Random.name(), seed, clicks_per_class)
                };
                let wall_s = own.iter().find(same).map_or(0.0, |point| point.wall_s);
                let task = Task {
                    scene,
                    surface: &surface,
                    options,
                    clicks: given,
                    labels: self.annotator.labels(given),
                    frames: test,
                    wall: Duration::from_secs_f64(wall_s),
                };
                let start = Instant::now();
                let maps = pool.install(|| baseline.maps(&task))?;
                let wall_s = before + start.elapsed().as_secs_f64();
                points.push(SimulatedPoint {
                    scene: scene.name(),
                    policy: name,
                    seed,
                    clicks_per_class,
                    strokes: given.len(),
                    scores: self.truth.scores_of_maps(scene, maps)?,
                    calibration: None,
                    wall_s,
                });
            }
        }
        Ok(points)
    }
}
