//! Opening a scene or a project: prepare, start a session, fit what is kept to the scene, show it.

use std::sync::Arc;

use inplace_core::scene::Scene;
use inplace_core::session::SessionOptions;

use super::App;
use crate::class_view::ClassView;
use crate::document::Document;
use crate::jobs::Done;
use crate::opening::{self, Attached, Prepared, Target};
use crate::session_link::Running;
use crate::state::{Opening, Stage};
use crate::workspace::Workspace;

impl App {
    /// Starts opening something; what was open is kept and closed.
    pub(crate) fn open(&mut self, target: Target) {
        self.close();
        self.last_ticket += 1;
        let ticket = self.last_ticket;
        self.state.stage = Stage::Opening(Box::new(Opening {
            ticket,
            target: target.clone(),
            progress: (0, 0),
            session: None,
            prepared: None,
        }));
        let (open, autosave) = (self.state.open, Arc::clone(&self.autosave));
        self.endings.retain(|ending| !ending.is_done());
        let endings = self.endings.clone();
        self.jobs.spawn("open", move |tell| {
            let prepared = opening::prepare(target, open, autosave.as_ref(), &endings);
            tell(Done::Prepared(ticket, Box::new(prepared)));
        });
    }

    /// Threads of the worker's pool: as the command line says, as preferred, or all cores but one.
    fn threads(&self) -> usize {
        let preferred = self.state.preferences.threads;
        let chosen = self
            .threads
            .or(preferred.map(|threads| threads.min(crate::run::cores())));
        chosen.unwrap_or_else(crate::run::usual_threads).max(1)
    }

    pub(super) fn start_session(&mut self, ticket: u64, prepared: Prepared) {
        let options = SessionOptions {
            source: prepared.source.clone(),
            open: prepared.open,
            preset: self.state.preset,
            threads: self.threads(),
            seed: self.seed,
            state: prepared.state(),
        };
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        if opening.ticket != ticket {
            return;
        }
        let ctx = self.ctx.clone();
        let session = (self.sessions)(options, Box::new(move || ctx.request_repaint()));
        self.state.read = prepared.open;
        opening.session = Some(Running::new(session));
        opening.prepared = Some(prepared);
    }

    /// The scene is read: fit what is kept to it, on a thread.
    pub(super) fn attach(&mut self, scene: Arc<Scene>) {
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        let Some(prepared) = opening.prepared.take() else {
            return;
        };
        let maps = opening
            .session
            .as_ref()
            .and_then(|session| session.maps().cloned());
        let (ticket, ctx) = (opening.ticket, self.ctx.clone());
        self.jobs.spawn("attach", move |tell| {
            let wake = move || ctx.request_repaint();
            let attached = opening::attach(prepared, &scene, maps.as_ref(), wake);
            tell(Done::Attached(ticket, scene, Box::new(attached)));
        });
    }

    pub(super) fn show_workspace(&mut self, ticket: u64, scene: Arc<Scene>, attached: Attached) {
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        if opening.ticket != ticket {
            return;
        }
        let Some(session) = opening.session.take() else {
            return;
        };
        for warning in &scene.warnings {
            self.state.toasts.info(warning);
        }
        for note in attached.notes {
            self.state.toasts.info(note);
        }
        if let Some(damage) = attached.damage {
            self.state.toasts.error(damage);
        }
        if let Some(problem) = attached.problem {
            self.state.toasts.error(problem);
        }
        let mut settings = self.preferred_settings();
        if let Some(view) = &attached.view {
            settings.take_json(view);
        }
        self.take_settings(settings);
        let document = Document::new(attached.history, attached.generation);
        let mut workspace = Workspace::new(scene, ticket, session, document, &self.ctx);
        if let Some(view) = &attached.view {
            workspace.overview_mut().log_mut().take_view(view);
        }
        self.state.keeper = Some(attached.keeper);
        if let Some(view) = &attached.view {
            workspace.change_class_view(|classes| *classes = ClassView::of_json(view));
        }
        self.state.stage = Stage::Open(Box::new(workspace));
        // Another scene is exported elsewhere, in the same way.
        self.state.export_choice.path.clear();
        self.note_recent();
    }
}
