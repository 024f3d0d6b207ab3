//! Taking over what jobs, the session and the project file have told since the last frame.

use inplace_core::project::JournalEvent;
use inplace_core::session;

use super::App;
use crate::english;
use crate::jobs::Done;
use crate::keeper::Keeper;
use crate::opening::Refusal;
use crate::session_link::Running;
use crate::state::Stage;

/// Most worker events looked at in one frame.
const EVENTS_A_FRAME: usize = 256;

impl App {
    pub(super) fn drain_jobs(&mut self) {
        while let Some(done) = self.jobs.next() {
            match done {
                Done::Picked(purpose, path) => self.picked(purpose, path),
                Done::Prepared(ticket, prepared) => match *prepared {
                    Ok(prepared) => self.start_session(ticket, prepared),
                    Err(Refusal::Sentence(sentence)) => self.opening_failed(ticket, sentence),
                    Err(Refusal::SceneGone { project, missing }) => {
                        self.scene_gone(ticket, project, missing);
                    }
                },
                Done::Attached(ticket, scene, attached) => match *attached {
                    Ok(attached) => self.show_workspace(ticket, scene, attached),
                    Err(sentence) => self.other_scene(ticket, &scene.source, sentence),
                },
                Done::Seen(seen) => self.seen(seen),
                Done::Kept(serial, keeper) => self.kept(serial, *keeper),
                Done::Exported(progress) => self.exported(progress),
                Done::Imported(ticket, images) => self.imported(ticket, *images),
                Done::Summarised(serial, made) => self.summarised(serial, made),
                Done::ClassesRead(read) => self.classes_read(read),
                Done::ClassesSaved(count, path) => self.classes_saved(count, &path),
                Done::Failed(sentence) => self.state.toasts.error(sentence),
            }
        }
    }

    /// The work in memory has a file from now on.
    fn kept(&mut self, serial: u64, mut keeper: Keeper) {
        if let Some(workspace) = self.state.workspace()
            && workspace.serial() == serial
        {
            keeper.catch_up(self.state.keeper.take());
            let path = keeper.path().to_path_buf();
            let before = self.state.place();
            self.state.keeper = Some(keeper);
            self.keep_results();
            self.note_named(before);
            self.state.toasts.info(english::saving::saved_to(&path));
        }
    }

    pub(super) fn drain_session(&mut self) {
        for _ in 0..EVENTS_A_FRAME {
            let event = match &self.state.stage {
                Stage::Start => None,
                Stage::Opening(opening) => opening.session.as_ref().and_then(Running::next_event),
                Stage::Open(workspace) => workspace.session().next_event(),
            };
            let Some(event) = event else {
                return;
            };
            self.on_session_event(event);
        }
        self.ctx.request_repaint();
    }

    fn on_session_event(&mut self, event: session::Event) {
        match &mut self.state.stage {
            Stage::Open(workspace) => {
                if let (session::Event::State(state), Some(keeper)) = (&event, &self.state.keeper) {
                    keeper.keep_model(state);
                }
                let (frame, guided) = (workspace.frame_index(), workspace.guidance().is_active());
                let told = workspace.on_event(event);
                let moved = workspace.frame_index() != frame;
                let ended = guided && !workspace.guidance().is_active();
                if let Some(sentence) = told {
                    self.state.toasts.error(sentence);
                }
                if moved {
                    self.looked_away();
                }
                if ended {
                    self.state.toasts.info(english::guidance::NOTHING_LEFT);
                }
            }
            Stage::Opening(opening) => match event {
                session::Event::Opening { done, total } => opening.progress = (done, total),
                session::Event::Opened(scene) => self.attach(scene),
                session::Event::Error(sentence) => {
                    let ticket = opening.ticket;
                    self.opening_failed(ticket, sentence);
                }
                _ => {}
            },
            Stage::Start => {}
        }
    }

    pub(super) fn drain_keeper(&mut self) {
        loop {
            let unnamed = self
                .state
                .keeper
                .as_ref()
                .is_some_and(|keeper| !keeper.is_named());
            let before = unnamed.then(|| self.state.place()).flatten();
            let Some(event) = self.state.keeper.as_mut().and_then(Keeper::next_event) else {
                return;
            };
            match event {
                JournalEvent::Saved { path } => {
                    self.keep_results();
                    self.note_named(before);
                    self.state.toasts.info(english::saving::saved_to(&path));
                }
                JournalEvent::Failed(sentence) | JournalEvent::NotBackedUp(sentence) => {
                    self.state.toasts.error(sentence);
                }
                JournalEvent::Recovered { path } => {
                    self.state.toasts.info(english::saving::writable_again(&path));
                }
            }
        }
    }
}
