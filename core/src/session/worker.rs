//! The worker thread: keeps the maps in step with the labels, and trains the rest of the time.

mod features;
mod following;
mod publishing;
mod training;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use crossbeam_channel::Receiver;

use super::background::Background;
use super::demand::Demand;
use super::estimating::{Estimated, Estimation};
use super::outbox::Outbox;
use super::rendering::ViewRendering;
use super::semantic_trainer::SemanticTrainer;
use super::serve::{WorkerError, saved, timed};
use super::status_reporter::StatusReporter;
use super::surface_refiner::SurfaceRefiner;
use super::{Command, Event, ModelState, Phase, SessionOptions, Status, TrainingEnd};
use crate::field::Trainer;
use crate::guide::Suggestion;
use crate::labels::{LabelSet, Stroke};
use crate::scene::{Scene, in_one_line};
use crate::semantics::{FrameMap, LabelPropagation, LeaveOneOut, SurfaceImport};
use features::FeatureSearch;

pub(super) struct Worker<'a> {
    scene: Arc<Scene>,
    options: &'a SessionOptions,
    outbox: &'a Outbox,
    trainer: Trainer,
    refiner: SurfaceRefiner,
    /// The estimation of depth that the first surface comes before; nothing is trained until it ends.
    estimation: Option<Estimation>,
    propagation: Option<LabelPropagation>,
    /// Training steps when that was taken over.
    surface_steps: u64,
    semantics: SemanticTrainer,
    demand: Demand,
    /// Imported images that are being propagated over a surface.
    importing: Option<Receiver<Option<SurfaceImport>>>,
    features: FeatureSearch,
    /// A newer surface, until the imported images are propagated over it too.
    waiting: Option<LabelPropagation>,
    labels: LabelSet,
    generation: u64,
    view: usize,
    paused: bool,
    /// No more training; only finish what is under way.
    settling: bool,
    /// The stroke that was asked about, until the answer is told.
    asked: Option<Stroke>,
    /// The map that was looked up for the last answer, as it was published and looked up.
    looked_up: Option<[Arc<FrameMap>; 2]>,
    /// The stroke that was asked about last, and the map that it would lead to, until that would be another one.
    foreseen: Option<(Stroke, FrameMap)>,
    /// The requested view of the field, until it is rendered.
    rendering: Option<ViewRendering>,
    /// Frames whose maps are out of date, in the order in which they are made.
    stale: VecDeque<usize>,
    /// The stale frame whose map has been told before the rest of the scene followed.
    seen: Option<usize>,
    /// Whether places are to be suggested whenever the maps have changed.
    suggestions_wanted: bool,
    suggestions_due: bool,
    suggesting: Option<Background<Vec<Suggestion>>>,
    /// The frames that suggestions are shown in; `None` = all.
    suggest_on: Option<BTreeSet<usize>>,
    /// Whether the strokes are to be checked whenever the labels or the surface change.
    checks_wanted: bool,
    checks_due: bool,
    checking: Option<Background<LeaveOneOut>>,
    reporter: StatusReporter,
    seconds: Seconds,
}

/// Wall time by kind of work.
#[derive(Clone, Copy, Default)]
struct Seconds {
    geometry: f64,
    semantics: f64,
    render: f64,
}

impl<'a> Worker<'a> {
    pub(super) fn new(
        Estimated { scene, depth, .. }: Estimated,
        estimation: Option<Estimation>,
        options: &'a SessionOptions,
        outbox: &'a Outbox,
    ) -> Result<Self, WorkerError> {
        let mut trainer = Trainer::new(Arc::clone(&scene), options.preset, options.seed)?;
        let (mut saved, mut is_final) = (HashMap::new(), false);
        // A model without a step knows nothing.
        if let Some(state) = options.state.as_ref().filter(|state| state.model.steps > 0) {
            let restored = state.model.load().and_then(|tensors| {
                trainer.restore(&tensors, state.model.steps)?;
                Ok(tensors)
            });
            match restored {
                Ok(tensors) => (saved, is_final) = (tensors, state.is_final),
                Err(error) => outbox.send(Event::Warning(format!(
                    "the saved model does not fit this scene and was left out ({}); training starts anew",
                    in_one_line(error)
                ))),
            }
        }
        let threads = options.threads.max(1);
        let refiner = match is_final {
            true => SurfaceRefiner::of_learnt(depth, &scene, &trainer, threads),
            false => SurfaceRefiner::beginning_with(depth, &scene, &trainer, 1.0, threads),
        };
        Ok(Self {
            semantics: SemanticTrainer::restored(&saved, &trainer),
            demand: Demand::new(&scene, options.preset, options.views),
            scene,
            options,
            outbox,
            trainer,
            refiner,
            estimation,
            propagation: None,
            surface_steps: 0,
            importing: None,
            features: FeatureSearch::new(options.features.clone()),
            waiting: None,
            labels: LabelSet::default(),
            generation: 0,
            view: 0,
            paused: false,
            settling: is_final,
            asked: None,
            looked_up: None,
            foreseen: None,
            rendering: None,
            stale: VecDeque::new(),
            seen: None,
            suggestions_wanted: false,
            suggestions_due: false,
            suggesting: None,
            suggest_on: None,
            checks_wanted: false,
            checks_due: false,
            checking: None,
            reporter: StatusReporter::new(),
            seconds: Seconds::default(),
        })
    }

    fn is_settled(&self) -> bool {
        let end = self.demand.end(&self.trainer);
        let trained = self.settling || (end.is_some() && self.semantics.is_done());
        let stands = end == Some(TrainingEnd::LabelsStand) && self.refiner.is_idle();
        let up_to_date = (self.refiner.is_done() || stands) && !self.semantics.is_evaluating();
        let idle = up_to_date && self.importing.is_none() && self.stale.is_empty();
        let has_surface = self.propagation.is_some() && self.estimation.is_none();
        trained && idle && !self.features.is_open() && has_surface
    }

    /// Has the estimation of depth go on once all maps follow from its first look, and goes on with all of the depth once
    /// it is there.
    fn take_estimated_if_ready(&mut self) -> Result<(), WorkerError> {
        if !self.refiner.is_building() && self.stale.is_empty() {
            self.estimation.iter().for_each(Estimation::go_on);
        }
        let estimated = self.estimation.as_ref().map(Estimation::ready);
        let Some(Estimated { scene, depth, .. }) = estimated.transpose()?.flatten() else {
            return Ok(());
        };
        self.estimation = None;
        self.trainer = Trainer::new(Arc::clone(&scene), self.options.preset, self.options.seed)?;
        let threads = self.options.threads.max(1);
        let superpixels = Arc::clone(&self.refiner.superpixels);
        self.refiner = SurfaceRefiner::beginning_with(depth, &scene, &self.trainer, 1.0, threads);
        // The images are the same.
        self.refiner.superpixels = superpixels;
        if self.settling {
            self.refiner.finish(&self.trainer);
        }
        self.semantics = SemanticTrainer::restored(&HashMap::new(), &self.trainer);
        self.scene = scene;
        self.labels_changed();
        Ok(())
    }

    fn save(&self) -> Result<ModelState, WorkerError> {
        let mut tensors = self.trainer.state()?;
        tensors.extend(self.semantics.state()?);
        saved(&tensors, self.trainer.steps())
    }
}

impl Worker<'_> {
    /// Carries out a command; `false` = stop.
    pub(super) fn handle(&mut self, command: Command) -> Result<bool, WorkerError> {
        match command {
            Command::Labels { labels, generation } => {
                tracing::info!(generation, strokes = labels.strokes.len(), "labels are received");
                let foreseen = self.foreseen.take();
                let foreseen = foreseen.filter(|(stroke, _)| labels.is_one_more(&self.labels, stroke));
                self.labels = labels;
                self.generation = generation;
                self.reporter.repeat_next();
                self.labels_changed();
                self.check_anew();
                if let Some(propagation) = &mut self.propagation {
                    let said = (&self.scene, &self.labels);
                    let tell = |map| self.outbox.publish(map);
                    let told = timed(&mut self.seconds.semantics, || match foreseen {
                        Some((stroke, map)) => {
                            propagation.set_labels_foreseen(said, generation, map, tell);
                            Some(stroke.frame)
                        }
                        None => {
                            let is_told = propagation.set_labels_seen_in(said, (self.view, generation), tell);
                            is_told.then_some(self.view)
                        }
                    });
                    self.refresh_all();
                    self.seen = told;
                }
                self.import_if_due();
            }
            Command::View { frame } => {
                self.view = frame.min(self.scene.frames.len().saturating_sub(1));
                self.sort_stale();
            }
            Command::Suggest { only } => {
                self.suggest_on = only;
                (self.suggestions_wanted, self.suggestions_due) = (true, true);
            }
            Command::Preview(stroke) => self.asked = Some(stroke),
            Command::CheckStrokes => (self.checks_wanted, self.checks_due) = (true, true),
            Command::Render(viewpoint) => {
                self.rendering = Some(ViewRendering::new(viewpoint));
                self.demand.view();
                let wanted = self.semantics_are_wanted();
                self.semantics.is_looked_at(wanted, self.demand.readers());
            }
            Command::Pause => {
                self.paused = true;
                self.put_back_waiting();
                self.report_status();
            }
            Command::Resume => {
                self.paused = false;
                self.settling = false;
                self.report_status();
            }
            Command::Settle => {
                self.settling = true;
                self.reporter.repeat_next();
                if self.estimation.is_none() {
                    self.refiner.finish(&self.trainer);
                }
            }
            Command::Save => {
                let state = self.save()?;
                self.outbox.send(Event::State(Arc::new(state)));
            }
            Command::Stop => return Ok(false),
        }
        Ok(true)
    }

    /// Reports the status.
    pub(super) fn report_status(&mut self) {
        let phase = match (&self.propagation, &self.estimation) {
            _ if self.paused => Phase::Paused,
            (None, _) => Phase::FindingSurface,
            (Some(_), Some(estimation)) => Phase::Estimating {
                percent: estimation.percent(),
            },
            (Some(_), None) => Phase::Training,
        };
        let held_out = self.trainer.error();
        let status = Status {
            phase,
            steps: self.trainer.steps(),
            semantic_steps: self.semantics.steps(),
            training_end: self.demand.end(&self.trainer),
            geometry_seconds: self.seconds.geometry,
            seconds_to_settle: self.refiner.seconds_to_finish(),
            semantics_seconds: self.seconds.semantics,
            render_seconds: self.seconds.render,
            skipped_steps: self.trainer.skipped(),
            undone: self.trainer.undone(),
            held_out_psnr: held_out.map(|error| error.psnr),
            depth_error: held_out.and_then(|error| error.depth_error),
            mean_entropy: self.propagation.as_ref().map(LabelPropagation::mean_entropy),
            parameters: self.trainer.field().parameters() + self.semantics.parameters(),
            capacity: self.trainer.capacity().to_string(),
            surface_nodes: self
                .propagation
                .as_ref()
                .map_or(0, |propagation| propagation.surface().graph.len()),
            generation: self.generation,
            spreading_import: self.importing.is_some(),
            finding_features: self.features.is_open(),
            settled: self.is_settled(),
        };
        self.reporter.report(self.outbox, status);
    }

    /// Does a slice of work; `false` when there was nothing to do.
    pub(super) fn advance(&mut self) -> Result<bool, WorkerError> {
        self.take_estimated_if_ready()?;
        if let Some(propagation) = self.new_propagation()? {
            if self.labels.imported.is_some() && self.propagation.is_some() {
                // The surface of before stays until the images are propagated over this one too.
                self.importing = Some(self.import_onto(propagation.surface()));
                self.waiting = Some(propagation);
            } else {
                self.take_propagation(propagation, None);
            }
            self.import_if_due();
        }
        self.take_import_if_ready()?;
        self.take_features_if_ready();
        if self.reporter.is_due() {
            self.report_status();
        }
        if self.publish() || self.preview() {
            return Ok(true);
        }
        self.suggest();
        self.check();
        if self.render()? {
            // The view is looked at when it is there: what it takes is no time to learn in.
            self.demand.view();
            return Ok(true);
        }
        // Somebody waits for suggestions. Beside them a step takes several times as long, and a click waits for a step.
        if self.suggesting.is_none() && self.train()? {
            return Ok(true);
        }
        if !self.reporter.reported_settled() && self.is_settled() {
            self.report_status();
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests;
