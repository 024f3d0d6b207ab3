//! One method on one scene with one seed, measured as time passes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Method, MethodRun, ParetoPoint, Part, Stop};
use crate::learnt::{learn, pool, surface};
use crate::simulate::baseline::{Task, published_course};
use crate::simulate::{Annotator, Baseline, Click, Policy};
use crate::{Failure, SceneTruth, unusable_scene};
use inplace_core::export::peak_memory;
use inplace_core::field::{Preset, Trainer};
use inplace_core::labels::{ClassId, LabelSet};
use inplace_core::scene::Scene;
use inplace_core::semantics::{LabelPropagation, Surface};
use inplace_core::session::SurfaceRefiner;
use inplace_core::session::{Client, Command, Event, Phase, SessionOptions};

const GENERATION: u64 = 1;

/// What is measured. Peak memory is that of the whole process: measure each in a process of its own.
#[derive(Clone, Debug)]
pub struct ParetoRun {
    /// The capture and how it is learnt; the method takes the place of its preset.
    pub session: SessionOptions,
    /// What labels it.
    pub method: Method,
    /// Random clicks of every class on the training frames, given as soon as the scene is open.
    pub clicks: usize,
    /// Wall seconds since the start at which the maps are measured, ascending; the last one ends the run.
    pub marks: Vec<f64>,
    /// Measures a preset's model by itself instead of a session, with this part so many times as large as chosen, once,
    /// when training has stopped or the last mark came.
    pub scaled: Option<(Part, f32)>,
}

/// What is known of a scene before its run: found out beforehand, so that it takes none of the run's time.
struct Prepared {
    truth: SceneTruth,
    clicks: Vec<Click>,
    labels: LabelSet,
    /// Whether there is a surface without a field.
    depth_is_complete: bool,
}

impl ParetoRun {
    /// Labels the scene in this process and measures.
    ///
    /// # Errors
    /// A scene that cannot be read, or without ground truth; a run without marks, and whatever stops a session.
    pub fn measure(&self) -> Result<MethodRun, Failure> {
        let Some(&last) = self.marks.last() else {
            return Err("there is no mark to measure at; give one".into());
        };
        let last = Duration::from_secs_f64(last);
        let prepared = self.prepared()?;
        match self.method {
            Method::Preset(Preset::Reference) | Method::Baseline(Baseline::Reference) => {
                self.of_reference(&prepared, last)
            }
            Method::Preset(preset) => match self.scaled {
                Some(scaled) => self.of_size(preset, scaled, &prepared, last),
                None => self.of_session(preset, &prepared),
            },
            Method::Baseline(baseline) => self.of_baseline(baseline, &prepared, last),
        }
    }

    fn prepared(&self) -> Result<Prepared, Failure> {
        let options = &self.session;
        let scene = Scene::open(&options.source, options.open, &|_, _| {})?;
        let truth = SceneTruth::read(&scene)?;
        let annotator = Annotator::new(&scene, &truth);
        let clicks = annotator.clicks(Policy::Random, self.clicks, options.seed);
        let labels = annotator.labels(&clicks);
        Ok(Prepared {
            depth_is_complete: SurfaceRefiner::is_complete(&scene),
            truth,
            clicks,
            labels,
        })
    }

    /// A session that is paused while it is measured.
    fn of_session(&self, preset: Preset, prepared: &Prepared) -> Result<MethodRun, Failure> {
        let start = Instant::now();
        let mut run = Client::start(SessionOptions {
            preset,
            ..self.session.clone()
        });
        let scene = run.opened()?;
        run.label(prepared.labels.clone(), GENERATION);
        let (mut points, mut stop) = (Vec::new(), None);
        let mut measuring = Duration::ZERO;
        let marks = self.marks.iter().copied().map(Duration::from_secs_f64);
        let mut marks = marks.peekable();
        while let Some(mark) = marks.next() {
            // Marks that passed while the scene was being opened have nothing to measure.
            if start.elapsed() - measuring > mark && marks.peek().is_some() {
                continue;
            }
            let settled = run.settled(GENERATION, Some(start + measuring + mark))?;
            if !settled {
                run.send(Command::Pause);
                let is_paused =
                    |event: &Event| matches!(event, Event::Status(status) if status.phase == Phase::Paused);
                run.wait_until(None, is_paused)?;
            }
            let begin = Instant::now();
            let wall_s = (begin - start - measuring).as_secs_f64();
            points.push(self.point(&scene, prepared, &run, wall_s)?);
            if settled {
                let status = run.status();
                stop = status.training_end.map(|reason| Stop {
                    wall_s,
                    steps: status.steps,
                    reason,
                });
                break;
            }
            measuring += begin.elapsed();
            run.send(Command::Resume);
        }
        Ok(ended(&run, points, stop))
    }

    /// A field and a surface by themselves: the field trains, and then the labels are propagated over its surface. The
    /// semantic field that a session trains besides takes no part.
    fn of_size(
        &self,
        preset: Preset,
        (part, factor): (Part, f32),
        prepared: &Prepared,
        last: Duration,
    ) -> Result<MethodRun, Failure> {
        let start = Instant::now();
        let of = |own: Part| if own == part { factor } else { 1.0 };
        pool(self.session.threads)?.install(|| {
            let scene = Arc::new(Scene::open(&self.session.source, self.session.open, &|_, _| {})?);
            let mut trainer =
                Trainer::scaled(Arc::clone(&scene), preset, of(Part::Field), self.session.seed)?;
            while start.elapsed() < last && !trainer.settled() {
                trainer.step()?;
            }
            let surface = surface(&scene, &trainer, of(Part::Surface))?;
            let mut propagation = LabelPropagation::new(Arc::clone(&surface));
            propagation.set_labels(&scene, &prepared.labels);
            let map = |&frame: &usize| propagation.map(&scene, frame, GENERATION).labels().into_owned();
            let maps = prepared.truth.test.iter().map(map).collect();
            self.alone(&scene, prepared, start, &surface, maps, Some(&trainer))
        })
    }

    /// The published network has no maps before it stops training: they are measured once, at the last mark.
    fn of_reference(&self, prepared: &Prepared, last: Duration) -> Result<MethodRun, Failure> {
        let start = Instant::now();
        let (run, scene) = published_course(&self.session, &prepared.labels, last)?;
        let point = self.point(&scene, prepared, &run, start.elapsed().as_secs_f64())?;
        Ok(ended(&run, vec![point], None))
    }

    /// The other baselines answer once. Those that need a surface get that of a session: at once where depth is
    /// measured everywhere, else when it is learnt, at the last mark at the latest.
    fn of_baseline(
        &self,
        baseline: Baseline,
        prepared: &Prepared,
        last: Duration,
    ) -> Result<MethodRun, Failure> {
        let start = Instant::now();
        let pool = pool(self.session.threads)?;
        let (scene, surface): (Arc<Scene>, Arc<Surface>) = if baseline == Baseline::Pixels {
            let open = || Scene::open(&self.session.source, self.session.open, &|_, _| {});
            (Arc::new(pool.install(open)?), Arc::default())
        } else {
            let mut run = Client::start(self.session.clone());
            let scene = run.opened()?;
            let limit = if prepared.depth_is_complete {
                Duration::ZERO
            } else {
                last.saturating_sub(start.elapsed())
            };
            learn(&mut run, Some(limit))?;
            let map = run.map(0);
            let surface = map.and_then(|map| map.surface().map(|(surface, _)| Arc::clone(surface)));
            let none = "no surface was found in this time; give later marks";
            let surface = surface.ok_or_else(|| unusable_scene(&scene, none))?;
            (scene, surface)
        };
        let task = Task {
            scene: &scene,
            surface: &surface,
            options: &self.session,
            clicks: &prepared.clicks,
            labels: prepared.labels.clone(),
            frames: &prepared.truth.test,
            wall: last,
        };
        let maps = pool.install(|| baseline.maps(&task))?;
        self.alone(&scene, prepared, start, &surface, maps, None)
    }

    /// Maps of the test frames that were made without a session, just now: on this surface, with this field.
    fn alone(
        &self,
        scene: &Scene,
        prepared: &Prepared,
        start: Instant,
        surface: &Surface,
        maps: Vec<Vec<ClassId>>,
        trainer: Option<&Trainer>,
    ) -> Result<MethodRun, Failure> {
        let wall_s = start.elapsed().as_secs_f64();
        let peak_mb = megabytes(peak_memory());
        let held_out = trainer.and_then(Trainer::error);
        let parameters = trainer.map(|trainer| trainer.field().parameters());
        let point = ParetoPoint {
            scene: scene.name(),
            method: self.method.name().to_owned(),
            seed: self.session.seed,
            wall_s,
            miou: prepared.truth.scores_of_maps(scene, maps)?.miou,
            depth_error_m: held_out.and_then(|error| error.depth_error).map(f64::from),
            psnr_db: held_out.map(|error| f64::from(error.psnr)),
            parameters,
            peak_mb,
        };
        Ok(MethodRun {
            points: vec![point],
            stop: None,
            voxels: surface.graph.len(),
            bytes: size_of::<f32>() * parameters.unwrap_or(0) + surface.graph.bytes(),
        })
    }

    /// The maps of a session as they are now.
    fn point(
        &self,
        scene: &Scene,
        prepared: &Prepared,
        run: &Client,
        wall_s: f64,
    ) -> Result<ParetoPoint, Failure> {
        // Before the maps are looked up, which takes memory of its own.
        let peak_mb = megabytes(peak_memory());
        let status = &run.status();
        Ok(ParetoPoint {
            scene: scene.name(),
            method: self.method.name().to_owned(),
            seed: self.session.seed,
            wall_s,
            miou: prepared.truth.scores_of(run, scene)?.miou,
            depth_error_m: status.depth_error.map(f64::from),
            psnr_db: status.held_out_psnr.map(f64::from),
            parameters: Some(status.parameters).filter(|&count| count > 0),
            peak_mb,
        })
    }
}

fn megabytes(bytes: Option<u64>) -> Option<f64> {
    bytes.map(|bytes| bytes as f64 / 1e6)
}

fn ended(run: &Client, points: Vec<ParetoPoint>, stop: Option<Stop>) -> MethodRun {
    let map = run.map(0);
    let surface = map.as_deref().and_then(|map| map.surface());
    let graph = surface.map_or(0, |(surface, _)| surface.graph.bytes());
    MethodRun {
        points,
        stop,
        voxels: run.status().surface_nodes,
        bytes: size_of::<f32>() * run.status().parameters + graph,
    }
}
