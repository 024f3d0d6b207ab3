//! Taking over what jobs, the session and the project file have told.

use std::sync::Arc;

use inplace_core::project::JournalEvent;
use inplace_core::session::Event;

use crate::jobs::Done;
use crate::messages::About;
use crate::model::{Model, Stage};
use crate::opening::Refusal;
use crate::project_session::Results;

impl Model {
    /// A job has come further, or has ended.
    pub(crate) fn job_done(&mut self, done: Done) {
        match done {
            Done::Picked(purpose, path) => self.picked(purpose, path),
            Done::Prepared(ticket, prepared) => match *prepared {
                Ok(prepared) => self.start_session(ticket, prepared),
                Err(Refusal::Sentence(sentence)) => self.opening_failed(ticket, sentence),
                Err(Refusal::SceneGone { project, missing }) => self.scene_gone(ticket, project, missing),
            },
            Done::Attached(ticket, scene, attached) => match *attached {
                Ok(attached) => self.show_workspace(ticket, scene, attached),
                Err(error) => self.other_scene(ticket, &scene.source, format!("{error}.")),
            },
            Done::Kept(attempt, project) => self.project_made(attempt, *project),
            Done::Exported(progress) => self.exported(progress),
            Done::Imported(ticket, images) => self.imported(ticket, *images),
            Done::ComparisonGoesOn(ticket, words) => self.comparison_goes_on(ticket, words),
            Done::OtherRead(ticket, read) => self.other_read(ticket, *read),
            Done::DifferencesCounted(serial, matching, counted) => {
                self.differences_counted(serial, matching, counted);
            }
            Done::Summarised(serial, made) => self.summarised(serial, made),
            Done::AuditDrawn(serial, audit) => self.audit_drawn(serial, audit),
            Done::LookedAt(Ok(target)) => self.open_at_once(target),
            Done::LookedAt(Err(sentence)) => self.state.messages.error(sentence),
            Done::PosesChecked(serial, problems) => self.poses_checked(serial, problems),
            Done::ClassesRead(read) => self.classes_read(read),
            Done::ClassesSaved(count, path) => self.classes_saved(count, &path),
            Done::NotKept(attempt, sentence) => self.not_kept(attempt, sentence),
            Done::IsThere(attempt, path) => self.is_there(Some(attempt), path),
            Done::Failed(sentence) => self.state.messages.error(sentence),
        }
    }

    /// The worker told something.
    pub(crate) fn session_event(&mut self, event: Event) {
        match &mut self.state.stage {
            Stage::Open(workspace) => {
                match event {
                    Event::Opened(scene) => return self.scene_opened(scene),
                    Event::Error(sentence) if workspace.reading.is_some() => {
                        self.state.messages.error(sentence);
                        // What is on no disk stays until the person gives it up.
                        if !self.loses_labels() {
                            return self.leave();
                        }
                        return self.with_workspace(|workspace| {
                            (workspace.reading, workspace.ended) = (None, true);
                        });
                    }
                    _ => {}
                }
                if let (Event::State(state), Some(project)) = (&event, &self.state.project) {
                    project.keep(Results {
                        state: Some(state.clone()),
                        ..Results::default()
                    });
                }
                let maps_are_made = matches!(event, Event::AllMaps { .. } | Event::Stopped);
                let guided = workspace.suggestions().is_active();
                let told = workspace.on_event(event);
                let ended = guided && !workspace.suggestions().is_active();
                if let Some(sentence) = told {
                    self.state.messages.error(sentence);
                }
                if ended {
                    self.state.messages.info("There is nothing left to suggest.");
                }
                if maps_are_made {
                    self.go_on_with_export();
                }
            }
            Stage::Opening(opening) => match event {
                Event::Opening { done, total } => opening.progress = (done, total),
                Event::Listed(scene) => {
                    let prepared = opening.prepared.as_ref();
                    if prepared.is_some_and(|prepared| prepared.is_of(&scene)) {
                        self.attach(scene);
                    }
                }
                Event::Opened(scene) => {
                    opening.opened = Some(Arc::clone(&scene));
                    self.attach(scene);
                }
                Event::Error(sentence) => {
                    let ticket = opening.ticket;
                    self.opening_failed(ticket, sentence);
                }
                _ => {}
            },
            Stage::Start => {}
        }
    }

    /// The project file's journal told something.
    pub(crate) fn journal_event(&mut self, event: JournalEvent) {
        let unnamed = self.state.project.as_ref().is_some_and(|project| !project.named);
        let before = unnamed.then(|| self.state.place()).flatten();
        if let Some(project) = &mut self.state.project {
            project.on_event(&event);
        }
        match event {
            JournalEvent::Saved { path } => self.saved_to(&path, before),
            JournalEvent::IsThere(path) => self.is_there(None, path),
            JournalEvent::Failed(sentence) => self.state.messages.error_about(About::Saving, sentence),
            JournalEvent::NotSavedAs(sentence) | JournalEvent::Problem(sentence) => {
                self.state.messages.error(sentence);
            }
            JournalEvent::Recovered { path } => {
                self.state.messages.withdraw(About::Saving);
                let sentence = format!("{} can be written again.", path.display());
                self.state.messages.info(sentence);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::scene::{Scene, SceneSource};

    use super::*;
    use crate::model::Start;
    use crate::preferences::Preferences;
    use crate::workspace::Workspace;
    use crate::{Command, Input};

    #[test]
    fn what_an_import_that_was_cancelled_read_and_what_is_wrong_with_another_scene_is_dropped() {
        let mut model = Model::new(Start::default(), Preferences::default());
        let workspace = Workspace::of_test(Scene::new(SceneSource::Demo, "test", Vec::new()));
        model.state.stage = Stage::Open(Box::new(workspace));
        model.state.importing = Some(7);
        model.update(Input::Command(Command::CancelImport));
        for done in [
            Done::Imported(7, Box::new(Err("There are no images.".to_owned()))),
            Done::PosesChecked(1, vec!["These poses are inverted.".to_owned()]),
            Done::PosesChecked(2, vec!["Another scene's are.".to_owned()]),
        ] {
            model.update(Input::Done(done));
        }
        let shown = model.messages.shown.iter().map(|message| &message.text);
        assert!(shown.eq(["Nothing was imported.", "These poses are inverted."]));
    }
}
