//! What is told to the worker, and what becomes of its answers.

use std::sync::Arc;
use std::time::Instant;

use inplace_core::session::{Command, Event};

use super::{LabelledSurface, Reading, Workspace};
use crate::versioned::Versioned;

impl Workspace {
    /// Takes what the worker told into account; returns a sentence about what failed.
    pub fn on_event(&mut self, event: Event) -> Option<String> {
        match event {
            Event::Map { frame, .. } => {
                if let Some(version) = self.map_versions.get_mut(frame) {
                    *version += 1;
                }
                self.take_surface(frame);
            }
            Event::Suggestions {
                generation,
                mut suggestions,
            } => {
                let frames = self.scene.frames.len();
                suggestions.retain(|suggestion| suggestion.frame < frames);
                let newest = self.document.generation();
                if let Some(index) = self.suggestions.take_list(generation, suggestions, newest) {
                    self.show_suggestion(index);
                }
            }
            Event::AllMaps { generation } => {
                self.followed = Some(generation);
                self.take_surface(self.frame_index);
            }
            Event::Status(status) => {
                let strokes = self.document.labels().strokes.len();
                let accuracy = self.overview.accuracy;
                self.overview.log.note(Instant::now(), strokes, accuracy, &status);
                self.status = status;
            }
            Event::Preview { generation, preview } => {
                if generation == self.document.generation() {
                    self.hover.take(preview);
                }
            }
            Event::StrokeChecks { checks, accuracy, .. } => {
                self.overview.take_stroke_checks(checks, accuracy);
            }
            Event::Rendered(view) => self.rendered = Some(Versioned::new(view)),
            Event::State(state) => self.state = Some(state),
            Event::Warning(sentence) | Event::Error(sentence) => return Some(sentence),
            Event::Stopped => self.ended = true,
            Event::Opening { done, total } => self.read(Reading::Frames(done, total)),
            Event::Estimating { share } => self.read(Reading::Depth(share)),
            Event::Listed(_) | Event::Opened(_) => {}
        }
        None
    }

    /// Takes over how far the reading is, unless it was farther: threads overtake each other.
    fn read(&mut self, now: Reading) {
        if let Some(before) = self.reading.as_mut().filter(|before| **before < now) {
            *before = now;
        }
    }

    /// All maps follow from one surface: the newest of any frame tells the newest of it.
    fn take_surface(&mut self, frame: usize) {
        let map = self.newest_map(frame);
        let Some(map) = map.filter(|map| map.generation >= self.surface_generation) else {
            return;
        };
        if let Some((surface, posterior)) = map.surface() {
            self.surface_generation = map.generation;
            self.surface = Some(LabelledSurface {
                surface: Arc::clone(surface),
                posterior: Arc::clone(posterior),
            });
        }
    }

    pub(super) fn send_labels(&mut self) {
        self.outbox.push(Command::Labels {
            labels: self.document.labels().clone(),
            generation: self.document.generation(),
        });
    }
}
