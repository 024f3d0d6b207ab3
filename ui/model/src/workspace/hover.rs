//! Asking what a click at the pointer would win.

use inplace_core::labels::{Stroke, VOID};
use inplace_core::session::Command;

use super::Workspace;
use crate::hover::Question;
use crate::settings::Settings;
use crate::tool::Tool;

impl Workspace {
    /// Asks about the click that a press would be now, unless that was asked.
    pub(crate) fn follow_hover(&mut self, settings: &Settings) {
        let question = self.question(settings);
        if let Some(stroke) = self.hover.ask(question) {
            self.outbox.push(Command::Preview(stroke));
        }
    }

    /// The click that a press would be now, once the map of the frame in view follows the newest labels; `None` where it
    /// would spread no class.
    fn question(&self, settings: &Settings) -> Option<Question> {
        let pixel = self.hover.pixel.filter(|_| settings.preview)?;
        let class = self
            .class
            .filter(|&class| class != VOID && !self.is_locked(class))?;
        let map = self.newest_map(self.frame_index)?;
        let is_new = map.generation == self.document.generation();
        (settings.tool == Tool::Brush && self.reading.is_none() && is_new).then(|| Question {
            stroke: Stroke::drawn(self.frame_index, class, settings.brush, vec![vec![pixel]]),
            map: self.map_version(self.frame_index),
        })
    }
}
