//! One method on one scene with one seed, measured as time passes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Method, ParetoPoint, Part};
use crate::learnt::{learn, pool, surface, surface_of};
use crate::simulate::baseline::{Task, published_course};
use crate::simulate::{Annotator, Baseline, Click, Policy};
use crate::{Failure, SceneTruth};
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
    /// Labels the scene in this process and measures, at the marks and where it stops by itself.
    ///
    /// # Errors
    /// A scene that cannot be read, or without ground truth; a run without marks, and whatever stops a session.
    pub fn measure(&self) -> Result<Vec<ParetoPoint>, Failure> {
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
    fn of_session(&self, preset: Preset, prepared: &Prepared) -> Result<Vec<ParetoPoint>, Failure> {
        let start = Instant::now();
        let mut run = Client::start(SessionOptions {
            preset,
            ..self.session.clone()
        });
        let scene = run.opened()?;
        run.label(prepared.labels.clone(), GENERATION);
        let mut points = Vec::new();
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
            let point = self.of_maps_now(&scene, prepared, &run, wall_s)?;
            if settled {
                let stop = run.status().training_end;
                points.push(ParetoPoint { stop, ..point });
                break;
            }
            points.push(point);
            measuring += begin.elapsed();
            run.send(Command::Resume);
        }
        Ok(points)
    }

    /// A field and a surface by themselves: the field trains, and then the labels are propagated over its surface. The
    /// semantic field that a session trains besides takes no part.
    fn of_size(
        &self,
        preset: Preset,
        (part, factor): (Part, f32),
        prepared: &Prepared,
        last: Duration,
    ) -> Result<Vec<ParetoPoint>, Failure> {
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
    fn of_reference(&self, prepared: &Prepared, last: Duration) -> Result<Vec<ParetoPoint>, Failure> {
        let start = Instant::now();
        let (run, scene) = published_course(&self.session, &prepared.labels, last)?;
        let wall_s = start.elapsed().as_secs_f64();
        Ok(vec![self.of_maps_now(&scene, prepared, &run, wall_s)?])
    }

    /// The other baselines answer once. Those that need a surface get that of a session: at once where depth is
    /// measured everywhere, else when it is learnt, at the last mark at the latest.
    fn of_baseline(
        &self,
        baseline: Baseline,
        prepared: &Prepared,
        last: Duration,
    ) -> Result<Vec<ParetoPoint>, Failure> {
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
            let surface = surface_of(&run, &scene)?;
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
    ) -> Result<Vec<ParetoPoint>, Failure> {
        let begun = self.begun(scene, start.elapsed().as_secs_f64());
        let held_out = trainer.and_then(Trainer::error);
        let parameters = trainer.map(|trainer| trainer.field().parameters());
        Ok(vec![ParetoPoint {
            miou: prepared.truth.scores_of_maps(scene, maps)?.miou,
            depth_error_m: held_out.and_then(|error| error.depth_error).map(f64::from),
            psnr_db: held_out.map(|error| f64::from(error.psnr)),
            parameters,
            voxels: surface.graph.len(),
            bytes: size_of::<f32>() * parameters.unwrap_or(0) + surface.graph.bytes(),
            ..begun
        }])
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
        let map = run.map(0);
        let surface = map.as_deref().and_then(|map| map.surface());
        let graph = surface.map_or(0, |(surface, _)| surface.graph.bytes());
        Ok(ParetoPoint {
            miou: prepared.truth.scores_of(run, scene)?.miou,
            depth_error_m: status.depth_error.map(f64::from),
            psnr_db: status.held_out_psnr.map(f64::from),
            parameters: Some(status.parameters).filter(|&count| count > 0),
            voxels: status.surface_nodes,
            bytes: size_of::<f32>() * status.parameters + graph,
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
