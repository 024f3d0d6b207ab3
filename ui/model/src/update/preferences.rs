//! Changing what the person prefers, and noting what was opened.

use crate::effect::Effect;
use crate::model::Model;
use crate::preferences::{PreferenceChange, Recent, now};
use crate::settings::Settings;
use crate::workspace::source::FrameSource;

impl Model {
    /// Changes what the person prefers.
    pub(crate) fn prefer(&mut self, change: PreferenceChange) {
        if let PreferenceChange::Forget(place) = &change {
            self.effects.push(Effect::ForgetPicture(place.clone()));
        }
        self.state.preferences.change(change);
    }

    /// Notes what is open among what was opened lately, and has its picture taken.
    pub(crate) fn note_recent(&mut self) {
        let (Some(workspace), Some(place)) = (self.state.workspace(), self.state.place()) else {
            return;
        };
        let labels = workspace.document.labels();
        let recent = Recent {
            place: place.clone(),
            name: self.state.document_name().unwrap_or_default(),
            opened: now(),
            frames: workspace.scene.frames.len(),
            classes: labels.classes.len(),
            strokes: labels.strokes.len(),
        };
        let look = Settings::default().look();
        let source = FrameSource::new(workspace, workspace.frame_index, look);
        self.state.preferences.recents.add(recent);
        self.effects.push(Effect::TakePicture(place, source));
    }
}
