//! The worker thread: follows the labels first, trains the rest of the time.

use std::any::Any;
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use candle_core::Tensor;
use crossbeam_channel::Receiver;

use super::checking::Checking;
use super::importing::Importing;
use super::opening::open;
use super::opinion::Opinion;
use super::outbox::Outbox;
use super::reference::ReferenceWorker;
use super::rendering::Rendering;
use super::semantic_field::SemanticField;
use super::serve::{Task, serve};
use super::survey::Survey;
use super::{Command, Event, ModelState, Phase, SessionOptions, Status};
use crate::field::{FieldError, Preset, Trainer};
use crate::guide::suggest;
use crate::labels::LabelSet;
use crate::scene::{Scene, SceneError};
use crate::semantics::{Spread, Surface, SurfaceImport};

/// How long maps are published before commands are looked at again.
const PUBLISH_SLICE: Duration = Duration::from_millis(15);
pub(super) const STATUS_EVERY: Duration = Duration::from_millis(250);
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

/// Runs until it is told to stop; whatever happens, the end is told.
pub(super) fn run(options: SessionOptions, commands: &Receiver<Command>, outbox: &Outbox) {
    guarded(outbox, || {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads.max(1))
            .thread_name(|index| format!("inplace-pool-{index}"))
            .build()
            .map_err(|error| {
                WorkerError::Other(format!("the training threads could not be started: {error}"))
            })?;
        let threads = Arc::new(threads);
        let Some((scene, early)) = open(&options, commands, outbox, &threads)? else {
            return Ok(());
        };
        threads.install(|| match options.preset {
            Preset::Reference => serve(
                &mut ReferenceWorker::new(scene, &options, outbox)?,
                early,
                commands,
            ),
            Preset::Auto | Preset::Fast | Preset::Accurate => {
                serve(&mut Worker::new(scene, &options, outbox)?, early, commands)
            }
        })
    });
}

/// Does the work; an error or a panic becomes an event, and so does the end.
fn guarded(outbox: &Outbox, work: impl FnOnce() -> Result<(), WorkerError>) {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => {}
        Ok(Err(error)) => outbox.send(Event::Error(error.to_string())),
        Err(panic) => outbox.send(Event::Error(format!(
            "training stopped by an internal error ({}); your labels are safe, open the scene again to go on",
            panic_message(panic.as_ref())
        ))),
    }
    outbox.send(Event::Stopped);
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
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
    last_status: Instant,
    told_settled: bool,
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
        let mut trainer = Trainer::new(Arc::clone(&scene), options.preset, options.seed)?;
        let (mut opinion, mut semantic_field) = (Opinion::new(), SemanticField::new());
        if let Some(state) = &options.state {
            match restore(&mut trainer, state) {
                Ok(restored) => (opinion, semantic_field) = restored,
                Err(error) => outbox.send(Event::Warning(format!(
                    "the saved model does not fit this scene and was left out ({error}); training starts anew"
                ))),
            }
        }
        let survey = Survey::new(&scene, &trainer, options.threads.max(1));
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
            last_status: Instant::now(),
            told_settled: false,
            seconds: Seconds::default(),
        })
    }

    /// All maps are out of date: the frame in view comes first, then its neighbours.
    fn refresh_all(&mut self) {
        self.stale = (0..self.scene.frames.len()).collect();
        self.suggestions_due = false;
        self.sort_stale();
    }

    fn sort_stale(&mut self) {
        let view = self.view;
        self.stale
            .make_contiguous()
            .sort_by_key(|&frame| frame.abs_diff(view));
    }

    /// Publishes out-of-date maps for a slice of time; `false` when there was none.
    fn publish(&mut self) -> bool {
        let Some(spread) = &self.spread else {
            return false;
        };
        if self.stale.is_empty() {
            return false;
        }
        let start = Instant::now();
        while let Some(frame) = self.stale.pop_front() {
            let map = spread.map(&self.scene, frame, self.generation);
            // Somebody waits for this one; that thread shall not have to look it up.
            let is_in_view = frame == self.view;
            self.outbox.publish(if is_in_view {
                map.looked_up().into_owned()
            } else {
                map
            });
            if start.elapsed() >= PUBLISH_SLICE {
                break;
            }
        }
        self.seconds.render += start.elapsed().as_secs_f64();
        if self.stale.is_empty() {
            self.suggestions_due = true;
            let generation = self.generation;
            self.outbox.send(Event::AllMaps { generation });
        }
        true
    }

    fn suggest(&mut self) -> bool {
        let Some(spread) = self.spread.as_ref().filter(|_| self.suggestions_due) else {
            return false;
        };
        self.suggestions_due = false;
        let suggestions = suggest(&self.scene, spread, self.suggest_on.as_ref());
        self.outbox.send(Event::Suggestions {
            generation: self.generation,
            suggestions,
        });
        true
    }

    /// Has the strokes checked when all maps follow them, and tells what came of it.
    fn check(&mut self) {
        if let Some(spread) = &self.spread {
            self.checking.start_if_due(spread, &self.scene, self.generation);
        }
        if let Some((generation, verdicts)) = self.checking.ready() {
            self.outbox.send(Event::Verdicts {
                generation,
                verdicts: verdicts.strokes,
                accuracy: verdicts.accuracy,
            });
        }
    }

    /// Renders a slice of the view that is wished for; `false` when none is.
    fn render(&mut self) -> Result<bool, WorkerError> {
        let Some(rendering) = &mut self.rendering else {
            return Ok(false);
        };
        let start = Instant::now();
        if let Some(rendered) = rendering.advance(&self.scene, &self.trainer)? {
            self.outbox.send(Event::Rendered(Arc::new(rendered)));
        }
        if rendering.is_done() {
            self.rendering = None;
        }
        self.seconds.render += start.elapsed().as_secs_f64();
        Ok(true)
    }

    /// A slice of training; `false` when there is nothing to train.
    fn train(&mut self) -> Result<bool, WorkerError> {
        if self.survey.is_rendering() && (!self.paused || self.spread.is_none()) {
            timed(&mut self.seconds.geometry, || {
                self.survey.advance(&self.trainer, &self.labels)
            })?;
            return Ok(true);
        }
        if self.opinion.is_looking() && !self.paused {
            let start = Instant::now();
            self.look_on()?;
            self.seconds.semantics += start.elapsed().as_secs_f64();
            return Ok(true);
        }
        if self.paused || self.settling {
            return Ok(false);
        }
        if self.semantic_field.has_the_turn() && self.spread.is_some() {
            return self.train_semantics(self.opinion.taught.steps_due() > 0, true);
        }
        let field = !self.trainer.settled();
        if field {
            timed(&mut self.seconds.geometry, || self.trainer.step())?;
            self.survey.start_if_due(&self.trainer);
        }
        if self.spread.is_none() && !field && self.survey.is_done() {
            return Err(WorkerError::Other(format!(
                "{}: no surface was found; check that the frames overlap and that the poses belong to them",
                self.options.source
            )));
        }
        let wanted = self.spread.is_some() && self.semantics_are_wanted();
        // After the field's last step they still follow the labels.
        let opinion = wanted && self.opinion.is_due(&self.trainer, field);
        let semantic_field = wanted && self.semantic_field.is_due(&self.trainer, field);
        Ok(self.train_semantics(opinion, semantic_field)? || field)
    }

    /// A step of the opinion, and one of the semantic field towards the maps; whether there was any.
    fn train_semantics(&mut self, opinion: bool, semantic_field: bool) -> Result<bool, WorkerError> {
        let Some(spread) = &self.spread else {
            return Ok(false);
        };
        let start = Instant::now();
        let (scene, trainer, seed) = (&self.scene, &self.trainer, self.options.seed);
        if opinion {
            self.opinion.step(scene, trainer, spread, seed)?;
        }
        if semantic_field {
            self.semantic_field.step(scene, trainer, spread, seed)?;
        }
        self.seconds.semantics += start.elapsed().as_secs_f64();
        Ok(opinion || semantic_field)
    }

    /// Whether there is anything to tell apart.
    fn semantics_are_wanted(&self) -> bool {
        self.labels.classes.len() >= 2 && self.labels.says_anything()
    }

    /// What is trained on the labels has something new to follow.
    fn labels_changed(&mut self) {
        let wanted = self.semantics_are_wanted();
        self.opinion.taught.labels_changed(wanted);
        self.semantic_field.taught.labels_changed(wanted);
    }

    /// Goes on with the look at the opinion; at its end, that goes into the maps.
    fn look_on(&mut self) -> Result<(), WorkerError> {
        if let Some(spread) = &mut self.spread
            && let Some(weights) = self.opinion.look_on(&self.trainer, spread)?
        {
            spread.set_head(weights);
            self.refresh_all();
        }
        Ok(())
    }

    /// A surface that has become ready. While training is paused, one that is there stays: the maps follow
    /// the labels alone, so that an undo gives back those of before.
    fn new_spread(&mut self) -> Result<Option<Spread>, WorkerError> {
        if self.paused && self.spread.is_some() {
            return Ok(None);
        }
        let ready = self.survey.ready();
        ready.map_err(|reason| WorkerError::Other(reason.to_owned()))
    }

    fn take_spread(&mut self, mut spread: Spread) {
        timed(&mut self.seconds.semantics, || {
            spread.set_labels(&self.scene, &self.labels);
        });
        self.spread = Some(spread);
        self.checking.start_anew();
        self.opinion.start_look();
        self.refresh_all();
    }

    /// Starts to spread the imported images over this surface, beside the worker.
    fn import_onto(&self, surface: &Arc<Surface>) -> Importing {
        Importing::start(surface, &self.labels, self.options.threads.max(1))
    }

    /// Starts to spread imported images unless they are, or others are being spread.
    fn import_if_due(&mut self) {
        let due = |spread: &&Spread| self.labels.imported.is_some() && !spread.has_import_of(&self.labels);
        if self.importing.is_none()
            && let Some(spread) = self.spread.as_ref().filter(due)
        {
            self.importing = Some(self.import_onto(spread.surface()));
        }
    }

    /// Imported images have been spread: they go into the maps, with the surface that waited for them.
    fn take_import(&mut self, import: Option<SurfaceImport>) {
        self.importing = None;
        if let Some(spread) = self.waiting.take() {
            self.take_spread(spread);
        }
        // The labels may have changed meanwhile.
        let import = import.filter(|import| import.is_of(&self.labels));
        if let (Some(import), Some(spread)) = (import, &mut self.spread) {
            timed(&mut self.seconds.semantics, || spread.set_import(import));
            self.checking.start_anew();
            self.labels_changed();
            self.refresh_all();
        }
        self.import_if_due();
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
                self.told_settled = false;
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
                self.told_settled = false;
                self.survey.finish();
            }
            Command::Save => {
                let state = self.save()?;
                self.outbox.send(Event::State(Arc::new(state)));
            }
            Command::Stop => return Ok(false),
        }
        Ok(true)
    }

    fn tell_status(&mut self) {
        self.last_status = Instant::now();
        let settled = self.is_settled();
        self.told_settled = settled;
        let phase = match (self.paused, &self.spread) {
            (true, _) => Phase::Paused,
            (false, None) => Phase::FindingSurface,
            (false, Some(_)) => Phase::Training,
        };
        let semantics = self.opinion.taught.parameters() + self.semantic_field.taught.parameters();
        let held_out = self.trainer.error();
        self.outbox.send(Event::Status(Status {
            phase,
            steps: self.trainer.steps(),
            field_settled: self.trainer.settled(),
            work: self.trainer.work(),
            geometry_seconds: self.seconds.geometry,
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
            settled,
        }));
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
        if self.last_status.elapsed() >= STATUS_EVERY {
            self.tell_status();
        }
        if self.publish() || self.suggest() {
            return Ok(true);
        }
        self.check();
        if self.render()? || self.train()? {
            return Ok(true);
        }
        if !self.told_settled && self.is_settled() {
            self.tell_status();
        }
        Ok(false)
    }
}

/// Takes a saved model over; returns its head and its semantic field where it has some that fit.
fn restore(
    trainer: &mut Trainer,
    state: &ModelState,
) -> Result<(Opinion, SemanticField), candle_core::Error> {
    let tensors: HashMap<String, Tensor> =
        candle_core::safetensors::load_buffer(&state.tensors, &candle_core::Device::Cpu)?;
    trainer.restore(&tensors, state.steps)?;
    let opinion = Opinion::restored(&tensors, trainer);
    Ok((opinion, SemanticField::restored(&tensors, trainer)))
}

#[cfg(test)]
mod tests;
