//! A session without the window, from opening the scene to the final maps.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;
use inplace_core::labels::LabelSet;
use inplace_core::scene::Scene;
use inplace_core::session::{Command, Event, FrameMap, ModelState, Phase, Session, SessionOptions, Status};

use super::Failure;
use super::budget::{Budget, Rehearsed, sample};
use super::progress::Progress;

/// Generation of the labels: they never change here.
const GENERATION: u64 = 1;
/// How often deadlines are looked at.
const TICK: Duration = Duration::from_millis(50);
/// How long a rehearsal waits for training to pause: it disturbs the rehearsal, no more.
const PAUSE_PATIENCE: Duration = Duration::from_secs(2);

/// How long the files of the frames of these maps take to be made.
pub(super) type Rehearse<'a> = dyn Fn(&[Arc<FrameMap>]) -> Result<Duration, Failure> + 'a;

/// A budget, and how it is kept.
pub(super) struct Pacing<'a> {
    pub(super) budget: Budget,
    /// Seconds that opening the scene took.
    pub(super) opening: f64,
    /// `None` where training cannot pause for it, and when it was done.
    pub(super) rehearse: Option<&'a Rehearse<'a>>,
}

/// A session that is followed until its maps are final.
pub(super) struct Run {
    session: Session,
    progress: Progress,
    start: Instant,
    status: Status,
    enough: Option<u64>,
}

impl Run {
    /// Starts a session; `start` is when the command itself began.
    pub(super) fn start(options: SessionOptions, start: Instant) -> Self {
        Self {
            session: Session::start(options, || {}),
            progress: Progress::new(),
            start,
            status: Status::default(),
            enough: None,
        }
    }

    /// How training goes.
    pub(super) fn status(&self) -> &Status {
        &self.status
    }

    /// Gives the labels that the maps follow from.
    pub(super) fn label(&self, labels: LabelSet) {
        self.session.send(Command::Labels {
            labels,
            generation: GENERATION,
        });
    }

    /// Trains no further than this many steps: a field that was saved after them stays as it is.
    pub(super) fn train_to(&mut self, steps: u64) {
        self.enough = Some(steps);
    }

    /// Waits for the scene.
    pub(super) fn opened(&mut self) -> Result<Arc<Scene>, Failure> {
        loop {
            match self.session.events().recv()? {
                Event::Opening { done, total } => {
                    self.progress.show(&format!("reading frame {done} of {total}"));
                }
                Event::Opened(scene) => return Ok(scene),
                Event::Error(reason) => return Err(reason.into()),
                _ => {}
            }
        }
    }

    /// Waits until the maps are final, or for as long as the budget allows; then returns them.
    ///
    /// With a budget, `rehearse` makes the files of some frames as soon as there are maps and tells how long that took,
    /// so that enough of the budget is kept for all; where it cannot be enough, a sentence on stderr says so. Where depth was
    /// measured, which is enough for a surface, training waits for those maps: there is nothing to write without them.
    pub(super) fn maps(
        &mut self,
        scene: &Scene,
        mut pacing: Option<Pacing<'_>>,
    ) -> Result<Vec<Arc<FrameMap>>, Failure> {
        let mut settling = false;
        let mut keyframes = scene.frames.iter().filter(|frame| frame.is_keyframe());
        let has_surface = keyframes.any(|frame| frame.depth_coverage().is_some_and(|share| share > 0.0));
        let mut is_waiting = has_surface && pacing.as_ref().is_some_and(|pacing| pacing.rehearse.is_some());
        if is_waiting {
            self.session.send(Command::Pause);
        }
        loop {
            if let Some(pacing) = &mut pacing
                && let Some(samples) = self.samples(scene, pacing)
            {
                let first_maps = self.start.elapsed().as_secs_f64();
                self.rehearse(pacing, &samples)?;
                (settling, is_waiting) = (false, false);
                let problem = pacing
                    .budget
                    .problem(pacing.opening, first_maps, scene.frames.len());
                if let Some(problem) = problem {
                    eprintln!("inplace: {problem}");
                }
            }
            if let (Some(pacing), Some(seconds)) = (&mut pacing, self.status.seconds_to_settle) {
                pacing.budget.looked(seconds);
            }
            let elapsed = self.start.elapsed().as_secs_f64();
            let budget = pacing.as_ref().map(|pacing| &pacing.budget);
            let is_late = budget.is_some_and(|budget| elapsed >= budget.settle_at());
            let is_enough = self.enough.is_some_and(|steps| self.status.steps >= steps);
            if (is_late || is_enough) && !settling {
                settling = true;
                if std::mem::take(&mut is_waiting) {
                    self.session.send(Command::Resume);
                }
                self.session.send(Command::Settle);
            }
            let is_over = budget.is_some_and(|budget| elapsed >= budget.write_at());
            // While it pauses it may say so of what it was asked before.
            let is_final = self.status.phase != Phase::Paused && self.status.is_final(GENERATION);
            if (is_over || is_final)
                && let Some(maps) = self.all_maps(scene)
            {
                return Ok(maps);
            }
            self.listen(TICK)?;
        }
    }

    /// Follows the next event, if one comes in time.
    fn listen(&mut self, patience: Duration) -> Result<(), Failure> {
        match self.session.events().recv_timeout(patience) {
            Ok(Event::Status(status)) => {
                self.progress.show(&describe(&status));
                self.status = status;
            }
            Ok(Event::Warning(sentence)) => eprintln!("inplace: {sentence}"),
            Ok(Event::Error(reason)) => return Err(reason.into()),
            Ok(Event::Stopped) | Err(RecvTimeoutError::Disconnected) => {
                return Err("training ended before the maps were made".into());
            }
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
        }
        Ok(())
    }

    /// The maps of some keyframes and of some other frames, with the number of all of each kind, once all of them are
    /// there; `None` when they were rehearsed before, or are not to be.
    fn samples(&self, scene: &Scene, pacing: &Pacing<'_>) -> Option<Vec<(usize, Vec<Arc<FrameMap>>)>> {
        pacing.rehearse?;
        let is_keyframe = |&frame: &usize| scene.frames[frame].is_keyframe();
        let (keyframes, others): (Vec<usize>, Vec<usize>) = (0..scene.frames.len()).partition(is_keyframe);
        let maps = |frames: Vec<usize>| {
            let sample = sample(&frames, rayon::current_num_threads()).into_iter();
            let maps: Option<_> = sample.map(|frame| self.map(frame)).collect();
            maps.map(|maps| (frames.len(), maps))
        };
        [keyframes, others].into_iter().map(maps).collect()
    }

    /// Learns what writing takes, while training pauses.
    fn rehearse(
        &mut self,
        pacing: &mut Pacing<'_>,
        samples: &[(usize, Vec<Arc<FrameMap>>)],
    ) -> Result<(), Failure> {
        let Some(rehearse) = pacing.rehearse.take() else {
            return Ok(());
        };
        self.session.send(Command::Pause);
        let end = Instant::now() + PAUSE_PATIENCE;
        while self.status.phase != Phase::Paused && Instant::now() < end {
            self.listen(TICK)?;
        }
        let rehearsed = samples.iter().map(|(frames, maps)| {
            // As many at once as there are threads that write.
            let batch = rayon::current_num_threads().clamp(1, maps.len().max(1));
            let seconds = maps
                .chunks_exact(batch)
                .map(|maps| rehearse(maps).map(|took| took.as_secs_f64()));
            let seconds = seconds.collect::<Result<_, _>>()?;
            Ok(Rehearsed::of_batches(*frames, batch, seconds))
        });
        pacing
            .budget
            .rehearsed(&rehearsed.collect::<Result<Vec<_>, Failure>>()?);
        self.session.send(Command::Resume);
        // What is final is told anew.
        self.status.settled = false;
        Ok(())
    }

    /// Ends the session's work, so that writing has the machine for itself; how it went stays known.
    pub(super) fn stop(&self) {
        self.session.send(Command::Stop);
    }

    /// The model as it is.
    pub(super) fn saved(&self) -> Result<Arc<ModelState>, Failure> {
        self.session.send(Command::Save);
        loop {
            match self.session.events().recv()? {
                Event::State(state) => return Ok(state),
                Event::Error(reason) => return Err(reason.into()),
                Event::Stopped => return Err("training ended before the model was saved".into()),
                _ => {}
            }
        }
    }

    /// The maps of all frames, where every frame has one of these labels.
    fn all_maps(&self, scene: &Scene) -> Option<Vec<Arc<FrameMap>>> {
        (0..scene.frames.len()).map(|frame| self.map(frame)).collect()
    }

    /// The map of a frame, where it has one of these labels.
    fn map(&self, frame: usize) -> Option<Arc<FrameMap>> {
        let map = self.session.maps().get(frame);
        map.filter(|map| map.generation == GENERATION)
    }
}

fn describe(status: &Status) -> String {
    let psnr = status
        .held_out_psnr
        .map_or(String::new(), |psnr| format!(", {psnr:.1} dB"));
    let entropy = status
        .mean_entropy
        .map_or(String::new(), |entropy| format!(", entropy {entropy:.2}"));
    format!("training: step {}{psnr}{entropy}", status.steps)
}
