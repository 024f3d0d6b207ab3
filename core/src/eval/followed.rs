//! A session that a measurement follows event by event.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;

use super::{EvalError, SceneTruth, Scores};
use crate::labels::VOID;
use crate::scene::Scene;
use crate::semantics::FrameMap;
use crate::session::{Command, Event, ModelState, Session, SessionOptions, Status};

/// How long a session may say nothing.
const PATIENCE: Duration = Duration::from_secs(600);

/// A session and its newest status.
pub(super) struct Followed {
    pub(super) session: Session,
    pub(super) status: Status,
}

impl Followed {
    pub(super) fn start(options: SessionOptions) -> Self {
        Self {
            session: Session::start(options, || {}),
            status: Status::default(),
        }
    }

    /// The same on a scene that is open already.
    pub(super) fn on(scene: &Arc<Scene>, options: SessionOptions) -> Self {
        Self {
            session: Session::on(Arc::clone(scene), options, || {}),
            status: Status::default(),
        }
    }

    /// Waits for the scene.
    pub(super) fn opened(&mut self) -> Result<Arc<Scene>, EvalError> {
        let mut opened = None;
        self.follow(|event, _| {
            if let Event::Opened(scene) = event {
                opened = Some(Arc::clone(scene));
            }
            opened.is_some()
        })?;
        opened.ok_or_else(ended)
    }

    /// Learns the geometry, for so long at most; then its surface is final.
    pub(super) fn learn(&mut self, limit: Option<Duration>) -> Result<(), EvalError> {
        let deadline = limit.map(|limit| Instant::now() + limit);
        let learnt = |event: &Event, status: &_| is_settled(event, status, 0);
        if !self.follow_until(deadline, learnt)? {
            self.session.send(Command::Settle);
            self.follow(learnt)?;
        }
        Ok(())
    }

    /// How good the test frames' maps are that there are now; a frame without one is void all over.
    pub(super) fn scores(&self, scene: &Scene, truth: &SceneTruth) -> Result<Scores, EvalError> {
        // All at once, as the session goes on meanwhile.
        let maps: BTreeMap<usize, Arc<FrameMap>> = truth
            .test
            .iter()
            .filter_map(|&frame| Some((frame, self.session.maps().get(frame)?)))
            .collect();
        truth.scores(&truth.test, |frame| match maps.get(&frame) {
            Some(map) => map.in_image(&scene.frames[frame]).labels().into_owned(),
            None => vec![VOID; truth.images[&frame].labels.len()],
        })
    }

    /// The model as it is.
    pub(super) fn saved(&mut self) -> Result<Arc<ModelState>, EvalError> {
        self.session.send(Command::Save);
        let mut state = None;
        self.follow(|event, _| {
            if let Event::State(saved) = event {
                state = Some(Arc::clone(saved));
            }
            state.is_some()
        })?;
        state.ok_or_else(|| EvalError::Session("the model could not be saved".to_owned()))
    }

    /// Follows the events until one of them (with the newest status) is the one that is waited for.
    pub(super) fn follow(&mut self, is_it: impl FnMut(&Event, &Status) -> bool) -> Result<(), EvalError> {
        self.follow_until(None, is_it).map(|_| ())
    }

    /// The same, but not past the deadline; whether what was waited for came.
    pub(super) fn follow_until(
        &mut self,
        deadline: Option<Instant>,
        mut is_it: impl FnMut(&Event, &Status) -> bool,
    ) -> Result<bool, EvalError> {
        loop {
            let patience = Instant::now() + PATIENCE;
            let end = deadline.map_or(patience, |deadline| deadline.min(patience));
            match self.session.events().recv_deadline(end) {
                Ok(Event::Error(reason)) => return Err(EvalError::Session(reason)),
                Ok(Event::Stopped) | Err(RecvTimeoutError::Disconnected) => return Err(ended()),
                Ok(event) => {
                    if let Event::Status(status) = &event {
                        self.status = status.clone();
                    }
                    if is_it(&event, &self.status) {
                        return Ok(true);
                    }
                }
                Err(RecvTimeoutError::Timeout) if deadline.is_some_and(|deadline| end == deadline) => {
                    return Ok(false);
                }
                Err(RecvTimeoutError::Timeout) => {
                    let reason = "nothing happened for ten minutes; try a smaller capture";
                    return Err(EvalError::Session(reason.to_owned()));
                }
            }
        }
    }
}

/// Whether an event tells that the maps of these labels are final.
pub(super) fn is_settled(event: &Event, status: &Status, generation: u64) -> bool {
    matches!(event, Event::Status(_)) && status.is_final(generation)
}

fn ended() -> EvalError {
    EvalError::Session("the session ended before it was measured".to_owned())
}
