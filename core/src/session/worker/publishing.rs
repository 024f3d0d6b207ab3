//! What the worker publishes: maps, suggestions, verdicts on the strokes, and views of the field.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{Worker, WorkerError};
use crate::guide::suggest;
use crate::session::Event;

/// How long maps are published before commands are looked at again.
const PUBLISH_SLICE: Duration = Duration::from_millis(15);

impl Worker<'_> {
    /// All maps are out of date: the frame in view comes first, then its neighbours.
    pub(super) fn refresh_all(&mut self) {
        self.stale = (0..self.scene.frames.len()).collect();
        self.suggestions_due = false;
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

    pub(super) fn suggest(&mut self) -> bool {
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
    pub(super) fn check(&mut self) {
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
    pub(super) fn render(&mut self) -> Result<bool, WorkerError> {
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
}
