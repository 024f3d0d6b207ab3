//! Actions that change what the person prefers, and keeping that.

use serde_json::{Map, Value};

use crate::app::App;
use crate::jobs::Done;
use crate::keymap::KeyMap;
use crate::pictures::{Found, Portrait, Seen, look_at, remove};
use crate::preferences::{Change, Place, Recent, now};
use crate::state::Settings;
use crate::thumbnails::Source;

impl App {
    /// Changes what the person prefers.
    pub(super) fn prefer(&mut self, change: Change) {
        if let Change::Forget(place) = &change {
            let (place, folder) = (place.clone(), self.pictures.clone());
            self.state.found.remove(&place);
            self.jobs.spawn("forget", move |_| remove(&place, &folder));
        }
        self.state.preferences.change(change);
        self.wear_preferences();
    }

    pub(super) fn set_theme(&mut self, theme: egui::ThemePreference) {
        self.state.preferences.theme = theme;
        self.wear_preferences();
    }

    /// Makes the window look and work as preferred.
    pub(crate) fn wear_preferences(&self) {
        let preferences = &self.state.preferences;
        self.ctx.set_theme(preferences.theme);
        self.ctx.set_zoom_factor(f32::from(preferences.scale) / 100.0);
        if *KeyMap::of(&self.ctx) != preferences.keys {
            preferences.keys.clone().install(&self.ctx);
        }
    }

    /// The settings that a scene without settings of its own starts with.
    pub(crate) fn preferred_settings(&self) -> Settings {
        let mut settings = Settings::default();
        settings.take_json(&Value::Object(self.state.preferences.look.clone()).to_string());
        settings
    }

    /// Takes over the settings of a scene that was opened; that is no change of what is preferred.
    pub(crate) fn take_settings(&mut self, settings: Settings) {
        self.state.settings = settings;
        self.settings_seen = settings;
    }

    /// Notices what the person changed and has it written; once a frame.
    pub(crate) fn keep_preferences(&mut self) {
        if self.state.settings != self.settings_seen {
            let before = entries(self.settings_seen);
            for (key, value) in entries(self.state.settings) {
                if before.get(&key) != Some(&value) {
                    self.state.preferences.look.insert(key, value);
                }
            }
            self.settings_seen = self.state.settings;
        }
        let scale = self.ctx.zoom_factor();
        let size = self.ctx.input(|input| {
            let viewport = input.viewport();
            let whole = viewport.maximized == Some(true) || viewport.fullscreen == Some(true);
            viewport
                .inner_rect
                .filter(|_| !whole)
                .map(|inner| inner.size() * scale)
        });
        if let Some(size) = size {
            self.state.preferences.window = Some([size.x.round(), size.y.round()]);
        }
        self.store.keep(&self.state.preferences);
        while let Some(problem) = self.store.problem() {
            self.state.toasts.error(problem);
        }
    }

    /// Notes what is open among what was opened lately, and has its picture taken. Returns what it needs.
    fn recent(&self) -> Option<(Recent, Portrait)> {
        let workspace = self.state.workspace()?;
        let place = self.state.place()?;
        let labels = workspace.document().labels();
        let recent = Recent {
            place,
            name: self.state.document_name().unwrap_or_default(),
            opened: now(),
            frames: workspace.scene().frames.len(),
            classes: labels.classes.len(),
            strokes: labels.strokes.len(),
        };
        let frame = workspace.frame_index();
        let portrait = Portrait {
            frame,
            source: Source::of_frame(workspace, frame, Settings::default().look()),
        };
        Some((recent, portrait))
    }

    /// Notes what is open among what was opened lately; its picture is taken on a thread.
    pub(crate) fn note_recent(&mut self) {
        let Some((recent, portrait)) = self.recent() else {
            return;
        };
        let (place, folder) = (recent.place.clone(), self.pictures.clone());
        self.state.preferences.recents.add(recent);
        self.jobs.spawn("picture", move |tell| {
            // A picture that cannot be kept is only missing from the start page.
            let _ = portrait.write(&place, &folder);
            tell(Done::Seen(vec![look_at(place, &folder)]));
        });
    }

    /// Like [`App::note_recent`] at the end of the program: the picture is taken here.
    pub(crate) fn note_recent_last(&mut self) {
        if let Some((recent, portrait)) = self.recent() {
            // As above.
            let _ = portrait.write(&recent.place, &self.pictures);
            self.state.preferences.recents.add(recent);
        }
        self.store.keep(&self.state.preferences);
        self.store.finish();
    }

    /// The work got a name: its scene is no longer what goes on with it.
    pub(crate) fn note_named(&mut self, before: Option<Place>) {
        if let Some(before) = before {
            self.state.preferences.recents.forget(&before);
        }
        self.note_recent();
    }

    /// Looks at everything that was opened lately, on a thread.
    pub(crate) fn look_at_recents(&self) {
        let recents = &self.state.preferences.recents;
        if recents.is_empty() {
            return;
        }
        let places: Vec<Place> = recents.iter().map(|recent| recent.place.clone()).collect();
        let folder = self.pictures.clone();
        self.jobs.spawn("recent", move |tell| {
            tell(Done::Seen(
                places.into_iter().map(|place| look_at(place, &folder)).collect(),
            ));
        });
    }

    /// A job looked at what was opened lately.
    pub(crate) fn seen(&mut self, seen: Vec<Seen>) {
        for Seen {
            place,
            there,
            picture,
        } in seen
        {
            let options = egui::TextureOptions::LINEAR;
            let picture = picture.map(|picture| self.ctx.load_texture("picture", picture, options));
            self.state.found.insert(place, Found { there, picture });
        }
    }
}

fn entries(settings: Settings) -> Map<String, Value> {
    // What is not an object has no entries.
    serde_json::from_str(&settings.to_json()).unwrap_or_default()
}
