//! The worker thread: follows the labels first, trains the rest of the time.

mod following;
mod publishing;
mod thread;
mod training;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use candle_core::Tensor;

pub(super) use thread::run;

use super::checking::Checking;
use super::importing::Importing;
use super::opinion::Opinion;
use super::outbox::Outbox;
use super::pulse::Pulse;
use super::rendering::Rendering;
use super::semantic_field::SemanticField;
use super::serve::Task;
use super::survey::Survey;
use super::{Command, Event, ModelState, Phase, SessionOptions, Status};
use crate::field::{FieldError, Trainer};
use crate::labels::LabelSet;
use crate::scene::{Scene, SceneError, in_one_line};
use crate::semantics::Spread;

/// Why the worker ended early.
#[derive(Debug, thiserror::Error)]
pub(super) enum WorkerError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Field(#[from] FieldError),
    #[error("{0}")]
    Other(String),
}

impl From<candle_core::Error> for WorkerError {
    fn from(error: candle_core::Error) -> Self {
        Self::Field(error.into())
    }
}

struct Worker<'a> {
    scene: Arc<Scene>,
    options: &'a SessionOptions,
    outbox: &'a Outbox,
    trainer: Trainer,
    survey: Survey,
    spread: Option<Spread>,
    /// What things look like, beside the graph's answer.
    opinion: Opinion,
    /// What the maps say, to be rendered from any pose.
    semantic_field: SemanticField,
    importing: Option<Importing>,
    checking: Checking,
    /// A newer surface that imported images are being spread over.
    waiting: Option<Spread>,
    labels: LabelSet,
    generation: u64,
    view: usize,
    paused: bool,
    /// Train no more: finish what is under way.
    settling: bool,
    /// The view of the field that is wished for, until it is rendered.
    rendering: Option<Rendering>,
    /// Frames whose maps are out of date, in the order in which they are made.
    stale: VecDeque<usize>,
    suggestions_due: bool,
    /// The frames that suggestions are shown in; all of them where there is nothing here.
    suggest_on: Option<BTreeSet<usize>>,
    pulse: Pulse,
    seconds: Seconds,
}

/// Wall time by what it was spent on.
#[derive(Clone, Copy, Default)]
struct Seconds {
    geometry: f64,
    semantics: f64,
    render: f64,
}

/// Adds the time that `work` takes to `seconds`.
pub(super) fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += start.elapsed().as_secs_f64();
    result
}

impl<'a> Worker<'a> {
    fn new(scene: Arc<Scene>, options: &'a SessionOptions, outbox: &'a Outbox) -> Result<Self, WorkerError> {
        let mut trainer = Trainer::scaled(
            Arc::clone(&scene),
            options.preset,
            options.size.field,
            options.seed,
        )?;
        let (mut opinion, mut semantic_field) = (Opinion::new(), SemanticField::new());
        if let Some(state) = &options.state {
            match restore(&mut trainer, state) {
                Ok(restored) => (opinion, semantic_field) = restored,
                Err(error) => outbox.send(Event::Warning(format!(
                    "the saved model does not fit this scene and was left out ({}); training starts anew",
                    in_one_line(error)
                ))),
            }
        }
        let survey = Survey::new(&scene, &trainer, options.size.surface, options.threads.max(1));
        Ok(Self {
            scene,
            options,
            outbox,
            trainer,
            survey,
            spread: None,
            opinion,
            semantic_field,
            importing: None,
            checking: Checking::default(),
            waiting: None,
            labels: LabelSet::default(),
            generation: 0,
            view: 0,
            paused: false,
            settling: false,
            rendering: None,
            stale: VecDeque::new(),
            suggestions_due: false,
            suggest_on: None,
            pulse: Pulse::new(),
            seconds: Seconds::default(),
        })
    }

    fn is_settled(&self) -> bool {
        let due = self.opinion.taught.steps_due() + self.semantic_field.taught.steps_due();
        let trained = self.settling || (self.trainer.settled() && due == 0);
        let looked = self.survey.is_done() && !self.opinion.is_looking();
        let idle = looked && self.importing.is_none() && self.stale.is_empty();
        trained && idle && self.spread.is_some()
    }

    fn save(&self) -> Result<ModelState, WorkerError> {
        let mut tensors = self.trainer.state()?;
        tensors.extend(self.opinion.taught.state()?);
        tensors.extend(self.semantic_field.taught.state()?);
        saved(&tensors, self.trainer.steps())
    }
}

/// A model state of these tensors after so many steps.
pub(super) fn saved(tensors: &HashMap<String, Tensor>, steps: u64) -> Result<ModelState, WorkerError> {
    let tensors = safetensors::serialize(tensors, None)
        .map_err(|error| WorkerError::Other(format!("the model could not be saved: {error}")))?;
    Ok(ModelState { steps, tensors })
}

impl Task for Worker<'_> {
    fn obey(&mut self, command: Command) -> Result<bool, WorkerError> {
        match command {
            Command::Labels { labels, generation } => {
                self.labels = labels;
                self.generation = generation;
                self.pulse.renew();
                self.labels_changed();
                self.checking.start_anew();
                if let Some(spread) = &mut self.spread {
                    timed(&mut self.seconds.semantics, || {
                        spread.set_labels(&self.scene, &self.labels);
                    });
                    self.refresh_all();
                }
                self.import_if_due();
            }
            Command::View { frame } => {
                self.view = frame.min(self.scene.frames.len().saturating_sub(1));
                self.sort_stale();
            }
            Command::SuggestOn { frames } => {
                self.suggest_on = Some(frames);
                self.suggestions_due = true;
            }
            Command::CheckStrokes => self.checking.want(),
            Command::Render { frame } => self.rendering = Rendering::new(&self.scene, frame),
            Command::Pause => {
                self.paused = true;
                self.tell_status();
            }
            Command::Resume => {
                self.paused = false;
                self.settling = false;
                self.tell_status();
            }
            Command::Settle => {
                self.settling = true;
                self.pulse.renew();
                self.survey.finish(&self.trainer);
            }
            Command::Save => {
                let state = self.save()?;
                self.outbox.send(Event::State(Arc::new(state)));
            }
            Command::Panic => panic!("a panic was asked for"),
            Command::Stop => return Ok(false),
        }
        Ok(true)
    }

    fn tell_status(&mut self) {
        let phase = match (self.paused, &self.spread) {
            (true, _) => Phase::Paused,
            (false, None) => Phase::FindingSurface,
            (false, Some(_)) => Phase::Training,
        };
        let semantics = self.opinion.taught.parameters() + self.semantic_field.taught.parameters();
        let held_out = self.trainer.error();
        let status = Status {
            phase,
            steps: self.trainer.steps(),
            field_settled: self.trainer.settled(),
            work: self.trainer.work(),
            geometry_seconds: self.seconds.geometry,
            seconds_to_settle: self.survey.seconds_to_finish(),
            semantics_seconds: self.seconds.semantics,
            render_seconds: self.seconds.render,
            skipped_steps: self.trainer.skipped(),
            undone: self.trainer.undone(),
            held_out_psnr: held_out.map(|error| error.psnr),
            depth_error: held_out.and_then(|error| error.depth_error),
            mean_entropy: self.spread.as_ref().map(Spread::mean_entropy),
            parameters: self.trainer.field().parameters() + semantics,
            capacity: self.trainer.capacity().to_string(),
            surface_nodes: self
                .spread
                .as_ref()
                .map_or(0, |spread| spread.surface().graph.len()),
            map_stride: None,
            generation: self.generation,
            spreading_import: self.importing.is_some(),
            settled: self.is_settled(),
        };
        self.pulse.tell(self.outbox, status);
    }

    fn advance(&mut self) -> Result<bool, WorkerError> {
        let failed = |reason: &str| WorkerError::Other(reason.to_owned());
        if let Some(spread) = self.new_spread()? {
            if self.labels.imported.is_some() && self.spread.is_some() {
                // The one before stays until the images are spread over this one too.
                self.importing = Some(self.import_onto(spread.surface()));
                self.waiting = Some(spread);
            } else {
                self.take_spread(spread);
            }
            self.import_if_due();
        }
        let imported = self.importing.as_ref().map(Importing::ready).transpose();
        if let Some(import) = imported.map_err(failed)?.flatten() {
            self.take_import(import);
        }
        if self.pulse.is_due() {
            self.tell_status();
        }
        if self.publish() || self.suggest() {
            return Ok(true);
        }
        self.check();
        if self.render()? || self.train()? {
            return Ok(true);
        }
        if !self.pulse.told_settled() && self.is_settled() {
            self.tell_status();
        }
        Ok(false)
    }
}

/// Takes a saved model over; returns its head and its semantic field where it has some that fit.
fn restore(trainer: &mut Trainer, state: &ModelState) -> Result<(Opinion, SemanticField), FieldError> {
    let tensors = state.load()?;
    trainer.restore(&tensors, state.steps)?;
    let opinion = Opinion::restored(&tensors, trainer);
    Ok((opinion, SemanticField::restored(&tensors, trainer)))
}

#[cfg(test)]
mod tests;
