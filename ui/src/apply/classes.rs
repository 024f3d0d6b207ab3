//! Actions on the class list: many classes at once, locks, files, the finder.

use std::path::{Path, PathBuf};

use inplace_core::export::write_json;
use inplace_core::labels::{AddedClasses, Class, ClassId, Stroke, read_class_list};

use crate::app::App;
use crate::canvas::Line;
use crate::class_view::ClassView;
use crate::dialogs::{ClassFinder, ClassUse, Dialog};
use crate::english::classes as english;
use crate::jobs::Done;
use crate::workspace::Lock;

impl App {
    pub(super) fn present_classes(&self) -> Vec<Class> {
        let workspace = self.state.workspace();
        workspace.map_or_else(Vec::new, |workspace| workspace.document().classes().to_vec())
    }

    pub(super) fn add_classes(&mut self, classes: &[Class]) {
        self.state.dialog = None;
        let mut outcome = AddedClasses::default();
        self.edit(|history| {
            let edit;
            (edit, outcome) = history.add_classes(classes);
            edit
        });
        self.state.toasts.info(english::added(&outcome));
    }

    pub(super) fn move_class_beside(&mut self, class: ClassId, neighbour: ClassId, below: bool) {
        self.edit(|history| {
            let mut others = history.labels().classes.iter().filter(|other| other.id != class);
            let place = others.position(|other| other.id == neighbour)?;
            history.move_class(class, place + usize::from(below))
        });
    }

    pub(super) fn rename_class(&mut self, id: ClassId, name: String) {
        if !self.locked_refuses_change(id) {
            self.change_class(id, |class| class.name = name);
        }
    }

    pub(super) fn delete_class(&mut self, id: ClassId) {
        if !self.locked_refuses_change(id) {
            self.edit(|history| history.delete_class(id));
        }
    }

    pub(super) fn merge_class(&mut self, from: ClassId, into: ClassId) {
        if !self.locked_refuses_change(from) && !self.locked_refuses_change(into) {
            self.edit(|history| history.merge_class(from, into));
        }
    }

    /// Whether a lock keeps a stroke from being added; then a message says so.
    pub(super) fn lock_refuses(&mut self, stroke: &Stroke) -> bool {
        let workspace = self.state.workspace();
        let lock = workspace.and_then(|workspace| workspace.lock_on(stroke));
        let sentence = lock.map(|lock| match lock {
            Lock::Own(class) => english::no_label(class),
            Lock::Covered(class) => english::no_cover(class),
        });
        self.refuse(sentence)
    }

    /// A message where an eraser passes over strokes of a locked class.
    pub(super) fn say_what_stays(&mut self, line: &Line, radius: u32) {
        let workspace = self.state.workspace();
        let locked = workspace.and_then(|workspace| workspace.locked_under_eraser(&line.points, radius));
        let sentence = locked.map(english::no_erase);
        self.refuse(sentence);
    }

    pub(super) fn locked_refuses_change(&mut self, id: ClassId) -> bool {
        let sentence = self.state.workspace().and_then(|workspace| {
            let class = workspace.document().labels().class(id)?;
            workspace.is_locked(id).then(|| english::no_change(class))
        });
        self.refuse(sentence)
    }

    fn refuse(&mut self, sentence: Option<String>) -> bool {
        let refused = sentence.is_some();
        if let Some(sentence) = sentence {
            self.state.toasts.info(sentence);
        }
        refused
    }

    /// Locks, hides and shows classes, and keeps that in the project.
    pub(super) fn change_class_view(&mut self, change: impl FnOnce(&mut ClassView)) {
        self.with_workspace(|workspace| workspace.change_class_view(change));
        if let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) {
            keeper.keep_view(workspace.kept_view(&self.state.settings));
        }
    }

    /// Opens the finder at the pointer, or in the middle of the canvas.
    pub(super) fn find_class(&mut self, purpose: ClassUse) {
        if self.state.workspace().is_none() {
            return;
        }
        let canvas = self.canvas.rect();
        let pointer = self.ctx.pointer_latest_pos();
        let at = pointer.filter(|&position| canvas.contains(position));
        let at = at.unwrap_or_else(|| canvas.center());
        let finder = ClassFinder::new(purpose, self.present_classes(), at);
        self.show(Some(Dialog::FindClass(Box::new(finder))));
    }

    /// Does something with a class that was found.
    pub(super) fn use_class(&mut self, purpose: ClassUse, class: ClassId) {
        self.state.dialog = None;
        match purpose {
            ClassUse::Choose => self.choose_class(class),
            ClassUse::Answer => self.answer_with(class),
        }
    }

    /// Makes a class of this name and does something with it.
    pub(super) fn use_new_class(&mut self, purpose: ClassUse, name: &str) {
        let class = self.new_class(name);
        self.use_class(purpose, class);
    }

    pub(super) fn read_classes(&mut self, path: PathBuf) {
        self.jobs.spawn("classes", move |tell| {
            tell(Done::ClassesRead(
                read_class_list(&path).map_err(|error| error.to_string()),
            ));
        });
    }

    /// A class list was read for the dialog that adds classes.
    pub(crate) fn classes_read(&mut self, read: Result<Vec<Class>, String>) {
        if let Some(Dialog::AddClasses(dialog)) = &mut self.state.dialog {
            dialog.take_file(read);
        }
    }

    pub(super) fn save_classes_to(&mut self, path: PathBuf) {
        self.state.dialog = None;
        let classes = self.present_classes();
        self.jobs.spawn("classes", move |tell| {
            tell(match write_json(&path, &classes) {
                Ok(()) => Done::ClassesSaved(classes.len(), path),
                Err(error) => Done::Failed(error.to_string()),
            });
        });
    }

    /// The classes were written to a file.
    pub(crate) fn classes_saved(&mut self, count: usize, path: &Path) {
        let sentence = english::saved(count, &path.display().to_string());
        self.state.toasts.info(sentence);
    }
}
