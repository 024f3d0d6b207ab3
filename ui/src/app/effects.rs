//! What goes into the model, and what it wants done outside: threads, the session, the project file, the window.

use std::sync::Arc;

use egui::{ThemePreference, ViewportCommand};
use inplace_core::session::{self, Session};
use inplace_model::jobs::{Done, JobTools};
use inplace_model::model::Stage;
use inplace_model::preferences::Theme;
use inplace_model::project_session::{Ending, ProjectSession};
use inplace_model::{Command, Effect, Input};

use super::App;
use crate::background::wake;
use crate::input_order::InputOrder;
use crate::jobs::Outcome;
use crate::keys;

/// Most worker events looked at in one frame.
const EVENTS_A_FRAME: usize = 256;

impl App {
    /// Tells the model something, such as what a view or a key asks for, and carries out what it wants done.
    pub fn update(&mut self, input: impl Into<Input>) {
        let had_dialog = self.model.dialog.is_some();
        for effect in self.model.update(input) {
            self.carry_out(effect);
        }
        if self.model.dialog.is_some() != had_dialog {
            InputOrder::wait_a_frame(&self.ctx);
        }
        self.wear_preferences();
    }

    fn carry_out(&mut self, effect: Effect) {
        match effect {
            Effect::StartSession(options) => {
                let ctx = self.ctx.clone();
                let session = (self.sessions)(*options, Box::new(move || wake(&ctx)));
                self.update(Input::SessionStarted(session));
            }
            Effect::Session(command) => {
                if let (Some(stats), session::Command::Preview(stroke)) = (&mut self.stats, &command) {
                    stats.asked(stroke.clone());
                }
                if let Some(session) = self.session() {
                    session.send(command);
                }
            }
            Effect::CloseProject(project, session) => {
                self.endings.retain(|ending| !ending.is_done());
                self.endings.extend(project.end(session));
            }
            Effect::Start(job) => self.jobs.start(job, self.job_tools()),
            Effect::Browse(purpose) => self.jobs.browse(purpose),
            Effect::ShowFolder(folder) => self.jobs.show_folder(folder),
            Effect::TakePicture(place, source) => self.jobs.take_picture(place, source),
            Effect::ForgetPicture(place) => {
                self.panels.pictures.forget(&place);
                self.jobs.forget_picture(place);
            }
            // Whatever has it, a field for text or not.
            Effect::GiveUpFocus => self.ctx.memory_mut(egui::Memory::stop_text_input),
            Effect::CloseWindow => self.ctx.send_viewport_cmd(ViewportCommand::Close),
            Effect::KeepWindowOpen => self.ctx.send_viewport_cmd(ViewportCommand::CancelClose),
            Effect::WakeIn(wait) => self.ctx.request_repaint_after(wait),
            Effect::Labelled { generation, frame } => {
                if let Some(stats) = &mut self.stats {
                    stats.clicked(generation, frame);
                }
            }
        }
    }

    fn job_tools(&self) -> JobTools {
        let ctx = self.ctx.clone();
        JobTools {
            autosave: Arc::clone(&self.autosave),
            wake: Arc::new(move || wake(&ctx)),
            endings: self.endings.clone(),
        }
    }

    fn session(&self) -> Option<&Session> {
        match &self.model.stage {
            Stage::Start => None,
            Stage::Opening(opening) => opening.session.as_ref(),
            Stage::Open(workspace) => Some(&workspace.session),
        }
    }

    /// Tells the model what jobs, the session and the project file have told since the last frame.
    pub(super) fn drain(&mut self) {
        while let Some(outcome) = self.jobs.next() {
            match outcome {
                Outcome::Done(done) => self.update(Input::Done(done)),
                Outcome::Seen(seen) => self.panels.pictures.take(&self.ctx, seen),
            }
        }
        for drained in 0.. {
            let Some(event) = self.session().and_then(next_event) else {
                break;
            };
            self.update(Input::Session(event));
            if drained == EVENTS_A_FRAME {
                self.ctx.request_repaint();
                break;
            }
        }
        while let Some(event) = self.model.project.as_ref().and_then(ProjectSession::next_event) {
            self.update(Input::Journal(event));
        }
        while let Some(problem) = self.store.problem() {
            self.update(Input::Done(Done::Failed(problem)));
        }
    }

    /// Makes the window look and work as preferred.
    pub(super) fn wear_preferences(&self) {
        let preferences = &self.model.preferences;
        let theme = match preferences.theme {
            Theme::Dark => ThemePreference::Dark,
            Theme::Light => ThemePreference::Light,
            Theme::System => ThemePreference::System,
        };
        if self.ctx.options(|options| options.theme_preference) != theme {
            self.ctx.set_theme(theme);
        }
        self.ctx.set_zoom_factor(f32::from(preferences.scale) / 100.0);
        if *keys::map_of(&self.ctx) != preferences.keys {
            keys::install(&self.ctx, preferences.keys.clone());
        }
    }

    /// Waits for the disk: the window is gone.
    pub(super) fn end(&mut self) {
        for effect in self.model.update(Command::End) {
            match effect {
                Effect::TakePicture(place, source) => self.jobs.take_last_picture(&place, &source),
                effect => self.carry_out(effect),
            }
        }
        // Also the files of what was closed before.
        self.endings.iter().for_each(Ending::wait);
        self.store.keep(&self.model.preferences);
        self.store.finish();
    }
}

/// The next thing that the worker told, if any.
fn next_event(session: &Session) -> Option<session::Event> {
    session.events().try_recv().ok()
}
