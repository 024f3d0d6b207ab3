//! What the worker publishes: maps, previews of strokes, suggestions, checks of the strokes, and views of the field.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::Worker;
use crate::guide::suggest;
use crate::session::Event;
use crate::session::background::Background;
use crate::session::serve::WorkerError;

/// How long maps are published between two looks at the commands.
const PUBLISH_SLICE: Duration = Duration::from_millis(15);

impl Worker<'_> {
    /// All maps are out of date: the frame in view comes first, then its neighbours.
    pub(super) fn refresh_all(&mut self) {
        self.stale = (0..self.scene.frames.len()).collect();
        self.suggestions_due = false;
        self.suggesting = None;
        (self.seen, self.foreseen) = (None, None);
        self.sort_stale();
    }

    pub(super) fn sort_stale(&mut self) {
        let view = self.view;
        self.stale
            .make_contiguous()
            .sort_by_key(|&frame| frame.abs_diff(view));
    }

    /// Publishes out-of-date maps for a slice of time; `false` when there was none.
    pub(super) fn publish(&mut self) -> bool {
        let Some(propagation) = &self.propagation else {
            return false;
        };
        if self.stale.is_empty() {
            return false;
        }
        let start = Instant::now();
        while let Some(frame) = self.stale.pop_front() {
            if self.seen == Some(frame) {
                continue;
            }
            let map = propagation.map(&self.scene, frame, self.generation);
            // The map in view is looked up here, so that the thread that shows it does not have to.
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

    /// Tells what the stroke that was asked about would win; `false` when there is none.
    pub(super) fn preview(&mut self) -> bool {
        let Some(propagation) = &self.propagation else {
            return false;
        };
        let Some(stroke) = self.asked.take() else {
            return false;
        };
        let start = Instant::now();
        if let Some(map) = self.outbox.map(stroke.frame) {
            let now = match self.looked_up.take() {
                _ if map.is_looked_up() => Arc::clone(&map),
                Some([of, looked_up]) if Arc::ptr_eq(&of, &map) => looked_up,
                _ => Arc::new(map.looked_up().into_owned()),
            };
            let tell = |preview| {
                self.outbox.send(Event::Preview {
                    generation: self.generation,
                    preview: Arc::new(preview),
                });
            };
            let foreseen = propagation.preview(&self.scene, &stroke, &now, tell);
            self.looked_up = Some([map, now]);
            self.foreseen = foreseen.map(|map| (stroke, map));
        }
        self.seconds.render += start.elapsed().as_secs_f64();
        true
    }

    /// Has places suggested once all maps follow the labels, and reports them.
    pub(super) fn suggest(&mut self) {
        // Maps that an evaluation is about to change are not searched.
        let stands = self.paused || !self.semantics.is_evaluating();
        let is_due = self.suggestions_wanted && self.suggestions_due && stands;
        if let Some(propagation) = self.propagation.as_ref().filter(|_| is_due) {
            self.suggestions_due = false;
            let (scene, propagation) = (Arc::clone(&self.scene), propagation.clone());
            let only = self.suggest_on.clone();
            let search =
                move |cancelled: &AtomicBool| suggest(&scene, &propagation, only.as_ref(), cancelled);
            // Without a GPU, the window draws the new labels with the other half.
            let threads = self.options.threads.div_ceil(2).max(1);
            self.suggesting = Some(Background::start(
                "inplace-suggestions",
                threads,
                self.generation,
                search,
            ));
        }
        if let Some((generation, suggestions)) = Background::take_ready(&mut self.suggesting) {
            let died = suggestions.is_none();
            // Whoever waits for places waits no longer.
            self.outbox.send(Event::Suggestions {
                generation,
                suggestions: suggestions.unwrap_or_default(),
            });
            if died {
                self.warn_of_end("no places are suggested");
            }
        }
    }

    /// Has the strokes checked once all maps follow them, and reports the result.
    pub(super) fn check(&mut self) {
        let is_due = self.checks_wanted && self.checks_due;
        if let Some(propagation) = self.propagation.as_ref().filter(|_| is_due) {
            self.checks_due = false;
            let validation = propagation.cross_validation(&self.scene);
            let run = |cancelled: &AtomicBool| validation.run(cancelled);
            // One thread: training runs at the same time, and nobody waits for the answer.
            self.checking = Some(Background::start("inplace-checking", 1, self.generation, run));
        }
        if let Some((generation, checks)) = Background::take_ready(&mut self.checking) {
            let died = checks.is_none();
            let checks = checks.unwrap_or_default();
            self.outbox.send(Event::StrokeChecks {
                generation,
                checks: checks.strokes,
                accuracy: checks.accuracy,
            });
            if died {
                self.warn_of_end("the strokes are not checked");
            }
        }
    }

    /// Says what there is not since the work on it panicked.
    fn warn_of_end(&self, what: &str) {
        self.outbox.send(Event::Warning(format!(
            "{what} because of an internal error; the next change of the labels tries again"
        )));
    }

    /// The labels or the surface have changed: cancels the check under way and starts another one later.
    pub(super) fn check_anew(&mut self) {
        self.checks_due = true;
        self.checking = None;
    }

    /// Renders a slice of the requested view; `false` when there is none.
    pub(super) fn render(&mut self) -> Result<bool, WorkerError> {
        let Some(rendering) = &mut self.rendering else {
            return Ok(false);
        };
        let start = Instant::now();
        if let Some(rendered) = rendering.advance(&self.trainer, (&self.semantics, self.generation))? {
            self.outbox.send(Event::Rendered(Arc::new(rendered)));
        }
        if rendering.is_done() {
            self.rendering = None;
        }
        self.seconds.render += start.elapsed().as_secs_f64();
        Ok(true)
    }
}
