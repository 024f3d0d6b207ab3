//! Actions that read and write files.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::session::Command;

use crate::app::App;
use crate::dialogs::{Dialog, Purpose};
use crate::english::saving;
use crate::jobs::Done;
use crate::keeper::SavedState;
use crate::opening::Target;

impl App {
    /// The system's dialog was answered. Without an answer the path fields are the way.
    pub(crate) fn picked(&mut self, purpose: Purpose, path: Option<PathBuf>) {
        let Some(path) = path else {
            return;
        };
        match (&mut self.state.dialog, purpose) {
            (
                Some(
                    dialog @ (Dialog::SaveAs { .. }
                    | Dialog::Export(_)
                    | Dialog::Import { .. }
                    | Dialog::Moved(_)),
                ),
                _,
            )
            | (Some(dialog @ Dialog::SaveClasses { .. }), Purpose::SaveClasses) => {
                dialog.take_path(&path);
            }
            (Some(dialog @ Dialog::AddClasses(_)), Purpose::Classes) => {
                dialog.take_path(&path);
                self.read_classes(path);
            }
            (_, Purpose::Scene) => {
                self.open(Target::Scene(inplace_core::scene::SceneSource::Folder(path)));
            }
            (_, Purpose::Project) => self.open(Target::Project(path)),
            (
                _,
                Purpose::SaveAs
                | Purpose::Export
                | Purpose::Import
                | Purpose::Moved
                | Purpose::Classes
                | Purpose::SaveClasses,
            ) => {}
        }
    }

    pub(super) fn save(&mut self) {
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        if !keeper.is_named() || keeper.saved_state() == SavedState::MemoryOnly {
            self.show(Some(Dialog::SaveAs { path: String::new() }));
            return;
        }
        workspace.session().send(Command::Save);
        let path = keeper.path().to_path_buf();
        let failing = keeper.saved_state() == SavedState::Failing;
        self.keep_results();
        if failing {
            self.state.toasts.error(saving::still_failing(&path));
        } else {
            self.state.toasts.info(saving::saved_to(&path));
        }
    }

    pub(super) fn save_to(&mut self, path: PathBuf) {
        self.state.dialog = None;
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        workspace.session().send(Command::Save);
        if !keeper.save_to(path.clone()) {
            self.write_new_project(path);
        }
    }

    /// There was no file to keep the work in so far: make one.
    pub(super) fn write_new_project(&mut self, path: PathBuf) {
        if let Some(keeper) = &mut self.state.keeper {
            keeper.begin_snapshot();
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (scene, history) = (
            Arc::clone(workspace.scene()),
            workspace.document().history().clone(),
        );
        let (open, ctx, serial) = (self.state.read, self.ctx.clone(), workspace.serial());
        self.jobs.spawn("save", move |tell| {
            let wake = move || ctx.request_repaint();
            tell(
                match crate::opening::new_project(path, &scene, open, history, wake) {
                    Ok(keeper) => Done::Kept(serial, Box::new(keeper)),
                    Err(sentence) => Done::Failed(sentence),
                },
            );
        });
    }
}
