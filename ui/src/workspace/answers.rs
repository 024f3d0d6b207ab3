//! What is told to the worker, and what becomes of its answers.

use std::sync::Arc;
use std::time::Instant;

use inplace_core::session::{Command, Event, FrameMap};

use super::Workspace;
use crate::guidance::Arrival;
use crate::view3d::Answer;

impl Workspace {
    /// Takes what the worker told into account; returns a sentence about what failed.
    pub fn on_event(&mut self, event: Event) -> Option<String> {
        match event {
            Event::Map { frame, .. } => {
                if let Some(version) = self.map_versions.get_mut(frame) {
                    *version += 1;
                }
                if frame == self.frame {
                    self.shown.take_map(self.newest_map());
                }
                self.take_answer(frame);
            }
            Event::Suggestions {
                generation,
                mut suggestions,
            } => {
                let frames = self.scene.frames.len();
                suggestions.retain(|suggestion| suggestion.frame < frames);
                let newest = self.document.generation();
                match self.guidance.take_list(generation, suggestions, newest) {
                    Arrival::Next(index) => self.show_suggestion(index),
                    Arrival::Quiet | Arrival::NothingLeft => {}
                }
            }
            Event::AllMaps { generation } => self.followed = Some(generation),
            Event::Status(status) => {
                let strokes = self.document.labels().strokes.len();
                self.overview.note(&status, strokes, Instant::now());
                self.status = status;
            }
            Event::StrokeChecks { checks, accuracy, .. } => {
                self.overview.take_stroke_checks(checks, accuracy);
            }
            Event::Rendered(view) => self.shown.take_view(view),
            Event::NotRendered(reason) => self.shown.take_no_view(reason),
            Event::State(state) => self.state = Some(state),
            Event::Warning(sentence) | Event::Error(sentence) => return Some(sentence),
            Event::Stopped => self.ended = true,
            Event::Opening { .. } | Event::Opened(_) => {}
        }
        None
    }

    pub(super) fn newest_map(&self) -> Option<Arc<FrameMap>> {
        self.session.maps().and_then(|maps| maps.get(self.frame))
    }

    /// All maps follow from one surface: the newest of any frame tells the newest answer.
    fn take_answer(&mut self, frame: usize) {
        let map = self.session.maps().and_then(|maps| maps.get(frame));
        let Some(map) = map.filter(|map| map.generation >= self.answer_generation) else {
            return;
        };
        if let Some((surface, posterior)) = map.surface() {
            self.answer_generation = map.generation;
            self.answer = Some(Answer {
                scene: self.serial,
                surface: Arc::clone(surface),
                posterior: Arc::clone(posterior),
            });
        }
    }

    pub(super) fn send_labels(&self) {
        self.session.send(Command::Labels {
            labels: self.document.labels().clone(),
            generation: self.document.generation(),
        });
    }
}
