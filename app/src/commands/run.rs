//! A session without the window, from opening the scene to the final maps.

use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::labels::LabelSet;
use inplace_core::scene::Scene;
use inplace_core::session::{Command, Event, FrameMap, ModelState, Session, SessionOptions, Status};

use super::Failure;
use super::progress::Progress;

/// Generation of the labels: they never change here.
const GENERATION: u64 = 1;
/// Seconds that writing takes, for each million pixels and in any case; measured generously.
const WRITE_SECONDS_PER_MEGAPIXEL: f64 = 0.12;
const WRITE_SECONDS: f64 = 0.5;

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

    /// Waits until the maps are final, or for as long as the budget allows, with a share of it kept for what
    /// follows training; then returns them.
    pub(super) fn maps(
        &mut self,
        scene: &Scene,
        budget: Option<f64>,
        kept: f64,
    ) -> Result<Vec<Arc<FrameMap>>, Failure> {
        let megapixels = scene
            .frames
            .iter()
            .map(|frame| frame.camera.pixels())
            .sum::<usize>() as f64
            / 1e6;
        let writing = WRITE_SECONDS + WRITE_SECONDS_PER_MEGAPIXEL * megapixels;
        // When to train no more, and when to write whatever there is.
        let at = |seconds: f64| self.start + Duration::from_secs_f64(seconds.max(0.0));
        let deadlines = budget.map(|budget| (at(budget - writing - kept * budget), at(budget - writing)));
        let mut settling = false;
        loop {
            let now = Instant::now();
            let is_late = deadlines.is_some_and(|(settle, _)| now >= settle);
            let is_enough = self.enough.is_some_and(|steps| self.status.steps >= steps);
            if (is_late || is_enough) && !settling {
                settling = true;
                self.session.send(Command::Settle);
            }
            if deadlines.is_some_and(|(_, end)| now >= end)
                && let Some(maps) = self.all_maps(scene)
            {
                return Ok(maps);
            }
            match self.session.events().recv_timeout(Duration::from_millis(50)) {
                Ok(Event::Status(status)) => {
                    self.progress.show(&describe(&status));
                    let done = status.is_final(GENERATION);
                    self.status = status;
                    if done && let Some(maps) = self.all_maps(scene) {
                        return Ok(maps);
                    }
                }
                Ok(Event::Warning(sentence)) => eprintln!("inplace: {sentence}"),
                Ok(Event::Error(reason)) => return Err(reason.into()),
                Ok(Event::Stopped) | Err(crossbeam_channel::RecvTimeoutError::Disconnected) => {
                    return Err("training ended before the maps were made".into());
                }
                Ok(_) | Err(crossbeam_channel::RecvTimeoutError::Timeout) => {}
            }
        }
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
        let slots = self.session.maps();
        (0..scene.frames.len())
            .map(|frame| slots.get(frame).filter(|map| map.generation == GENERATION))
            .collect()
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
