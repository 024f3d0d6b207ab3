//! One method on one scene with one seed, measured as time passes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Method, ParetoPoint, SIZES};
use crate::learnt::{pool, refine_poses, surface};
use crate::simulate::{Annotator, Policy};
use crate::{Failure, SceneTruth};
use inplace_core::export::peak_memory;
use inplace_core::field::{Preset, Trainer, Volume};
use inplace_core::labels::{ClassId, LabelSet};
use inplace_core::scene::Scene;
use inplace_core::semantics::{FieldDepth, LabelPropagation, Surface};
use inplace_core::session::{Client, Command, Event, Phase, SessionOptions};
use inplace_core::stereo::{StereoDepth, estimate};

const GENERATION: u64 = 1;

/// What is measured. Peak memory is that of the whole process: measure each in a process of its own.
#[derive(Clone, Debug)]
pub struct ParetoRun {
    /// The capture and how it is learnt; the method takes the place of its preset.
    pub session: SessionOptions,
    /// What labels it.
    pub method: Method,
    /// Random clicks of every class on the training frames, or the capture's own, given as soon as the scene is open.
    pub clicks: usize,
    /// Wall seconds since the start at which the maps are measured, ascending; the last one ends the run.
    pub marks: Vec<f64>,
}

/// What is known of a scene before its run: found out beforehand, so that it takes none of the run's time.
struct Prepared {
    truth: SceneTruth,
    labels: LabelSet,
}

/// Wall time without that of measuring.
struct Clock {
    start: Instant,
}

impl Clock {
    fn start() -> Self {
        Self {
            start: Instant::now(),
        }
    }

    fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Leaves out what came after so long.
    fn back_to(&mut self, elapsed: Duration) {
        self.start = Instant::now() - elapsed;
    }
}

/// The maps of the test frames by the labels on a surface.
fn spread(scene: &Arc<Scene>, prepared: &Prepared, surface: &Arc<Surface>) -> Vec<Vec<ClassId>> {
    let mut propagation = LabelPropagation::new(Arc::clone(surface));
    propagation.set_labels(scene, &prepared.labels);
    let map = |&frame: &usize| propagation.map(scene, frame, GENERATION).labels().into_owned();
    prepared.truth.test.iter().map(map).collect()
}

impl ParetoRun {
    /// Labels the scene in this process and measures, at the marks and where it stops by itself.
    ///
    /// # Errors
    /// A scene that cannot be read, or without ground truth, and whatever stops a session.
    pub fn measure(&self) -> Result<Vec<ParetoPoint>, Failure> {
        let prepared = self.prepared()?;
        match self.method {
            Method::Preset(preset) => self.of_session(preset, &prepared),
            Method::Stereo => self.of_stereo(&prepared),
            Method::Sized(size) => self.of_field(SIZES[size].1, &prepared),
        }
    }

    fn marks(&self) -> Vec<Duration> {
        let marks = self.marks.iter().copied();
        marks.map(Duration::from_secs_f64).collect()
    }

    fn prepared(&self) -> Result<Prepared, Failure> {
        let options = &self.session;
        let scene = Scene::open(&options.source, options.open, &|_, _| {})?;
        let truth = SceneTruth::read_or_clicks(&scene)?;
        let annotator = Annotator::new(&scene, &truth);
        let (policy, count) = match truth.clicks.len() {
            0 => (Policy::Random, self.clicks),
            all => (Policy::Own, all),
        };
        let clicks = annotator.clicks(policy, count, options.seed);
        let labels = annotator.labels(&clicks);
        Ok(Prepared { truth, labels })
    }

    /// A session that is paused while it is measured, first when all frames have maps: before, there is nothing to measure.
    fn of_session(&self, preset: Preset, prepared: &Prepared) -> Result<Vec<ParetoPoint>, Failure> {
        let mut clock = Clock::start();
        let mut run = Client::start(SessionOptions {
            preset,
            ..self.session.clone()
        });
        let scene = run.opened()?;
        run.label(prepared.labels.clone(), GENERATION);
        run.mapped(GENERATION)?;
        let first = clock.elapsed();
        let later = self.marks().into_iter().filter(|&mark| mark > first);
        let mut points = Vec::new();
        for mark in std::iter::once(first).chain(later) {
            let settled = run.settled(GENERATION, Some(clock.start + mark))?;
            if !settled {
                run.send(Command::Pause);
                let is_paused =
                    |event: &Event| matches!(event, Event::Status(status) if status.phase == Phase::Paused);
                run.wait_until(None, is_paused)?;
            }
            let wall = clock.elapsed();
            let point = self.of_maps_now(&scene, prepared, &run, wall.as_secs_f64())?;
            if settled {
                let stop = run.status().training_end;
                points.push(ParetoPoint { stop, ..point });
                break;
            }
            points.push(point);
            clock.back_to(wall);
            run.send(Command::Resume);
        }
        Ok(points)
    }

    /// A field and a surface by themselves, so many times as large as chosen: the field trains until each mark, and then the
    /// labels are propagated over its surface. The semantic field that a session trains besides takes no part.
    fn of_field(&self, [rows, voxels]: [f32; 2], prepared: &Prepared) -> Result<Vec<ParetoPoint>, Failure> {
        let mut clock = Clock::start();
        pool(self.session.threads)?.install(|| {
            let scene = Arc::new(Scene::open(&self.session.source, self.session.open, &|_, _| {})?);
            let mut trainer = Trainer::scaled(Arc::clone(&scene), Preset::Auto, rows, self.session.seed)?;
            let mut points = Vec::new();
            for mark in self.marks() {
                while clock.elapsed() < mark && !trainer.settled() {
                    trainer.step()?;
                }
                let wall = clock.elapsed();
                let surface = surface(&scene, &trainer, voxels)?;
                let maps = spread(&scene, prepared, &surface);
                points.push(self.alone(&scene, prepared, clock.elapsed(), &surface, maps, Some(&trainer))?);
                clock.back_to(wall);
                if trainer.settled() {
                    break;
                }
            }
            Ok(points)
        })
    }

    /// The surfaces that stereo finds by its first look and in the end, and the labels propagated over each.
    fn of_stereo(&self, prepared: &Prepared) -> Result<Vec<ParetoPoint>, Failure> {
        let mut clock = Clock::start();
        pool(self.session.threads)?.install(|| {
            let mut scene = Scene::open(&self.session.source, self.session.open, &|_, _| {})?;
            refine_poses(&mut scene);
            let scene = Arc::new(scene);
            let extent = Volume::around(&scene.bounds()).side;
            let mut points = Vec::new();
            let mut measure = |estimated: Vec<StereoDepth>| -> Result<(), Failure> {
                let mut depth = vec![None; scene.frames.len()];
                for own in &estimated {
                    depth[own.frame] = Some(Arc::new(FieldDepth::from(own)));
                }
                let Some(surface) = Surface::build(&scene, &depth, extent).map(Arc::new) else {
                    return Ok(());
                };
                let maps = spread(&scene, prepared, &surface);
                let wall = clock.elapsed();
                points.push(self.alone(&scene, prepared, wall, &surface, maps, None)?);
                clock.back_to(wall);
                Ok(())
            };
            let mut measured = Ok(());
            let mut first = |depth| measured = measure(depth);
            let full = estimate(&scene, Some(&mut first), &|_| true)?;
            measured?;
            measure(full)?;
            Ok(points)
        })
    }

    /// Maps of the test frames that were made without a session, after so long: on this surface, with this field.
    fn alone(
        &self,
        scene: &Scene,
        prepared: &Prepared,
        wall: Duration,
        surface: &Surface,
        maps: Vec<Vec<ClassId>>,
        trainer: Option<&Trainer>,
    ) -> Result<ParetoPoint, Failure> {
        let begun = self.begun(scene, wall.as_secs_f64());
        let held_out = trainer.and_then(Trainer::error);
        let parameters = trainer.map(|trainer| trainer.field().parameters());
        Ok(ParetoPoint {
            miou: prepared.truth.scores_of_maps(scene, maps)?.miou,
            depth_error_m: held_out.and_then(|error| error.depth_error).map(f64::from),
            psnr_db: held_out.map(|error| f64::from(error.psnr)),
            parameters,
            voxels: surface.graph.len(),
            ..begun
        })
    }

    /// The maps of a session as they are now.
    fn of_maps_now(
        &self,
        scene: &Scene,
        prepared: &Prepared,
        run: &Client,
        wall_s: f64,
    ) -> Result<ParetoPoint, Failure> {
        let begun = self.begun(scene, wall_s);
        let status = &run.status();
        Ok(ParetoPoint {
            miou: prepared.truth.scores_of(run, scene)?.miou,
            depth_error_m: status.depth_error.map(f64::from),
            psnr_db: status.held_out_psnr.map(f64::from),
            parameters: Some(status.parameters).filter(|&count| count > 0),
            voxels: status.surface_nodes,
            ..begun
        })
    }

    /// A point of which only the time and the memory are known: maps that are looked up take memory of their own.
    fn begun(&self, scene: &Scene, wall_s: f64) -> ParetoPoint {
        ParetoPoint {
            scene: scene.name(),
            method: self.method.name().to_owned(),
            seed: self.session.seed,
            wall_s,
            peak_mb: peak_memory().map(|bytes| bytes as f64 / 1e6),
            ..ParetoPoint::default()
        }
    }
}
