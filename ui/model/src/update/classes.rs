//! Actions on the class list: many classes at once, locks, files, the finder.

use std::path::{Path, PathBuf};

use inplace_core::export::write_json;
use inplace_core::labels::{AddedClasses, Class, ClassId, ImportError, Object, read_class_list};

use crate::class_view::{ClassView, Named};
use crate::dialogs::{ClassFinder, ClassUse, Dialog};
use crate::jobs::Done;
use crate::model::Model;
use crate::project_session::Results;
use crate::text::counted;
use crate::tool::DrawnLine;

impl Model {
    pub(crate) fn present_classes(&self) -> Vec<Class> {
        let workspace = self.state.workspace();
        workspace.map_or_else(Vec::new, |workspace| workspace.document.classes().to_vec())
    }

    pub(crate) fn add_classes(&mut self, classes: &[Class]) {
        self.state.dialog = None;
        let mut outcome = AddedClasses::default();
        self.edit(|history| {
            let edit;
            (edit, outcome) = history.add_classes(classes);
            edit
        });
        self.state.messages.info(added(&outcome));
    }

    pub(crate) fn rename(&mut self, named: Named, name: String) {
        match named {
            Named::Class(id) if self.locked_refuses_change(id) => {}
            Named::Class(id) => self.change_class(id, |class| class.name = name),
            Named::Object(id) => {
                self.change_object(id, |history, object| history.rename_object(object, &name));
            }
        }
    }

    pub(crate) fn delete(&mut self, named: Named) {
        match named {
            Named::Class(id) if self.locked_refuses_loss(id) => {}
            Named::Class(id) => self.edit(|history| history.delete_class(id)),
            Named::Object(id) => self.delete_object(id),
        }
    }

    pub(crate) fn merge_class(&mut self, from: ClassId, into: ClassId) {
        if self.locked_refuses_loss(from) || self.locked_refuses_change(into) {
            return;
        }
        let workspace = self.state.workspace();
        let is_chosen = workspace.is_some_and(|workspace| workspace.class == Some(from));
        self.edit(|history| history.merge_class(from, into));
        if is_chosen {
            self.with_workspace(|workspace| workspace.choose_class(into));
        }
    }

    /// A message where an eraser passes over strokes of a locked class or object.
    pub(crate) fn say_what_stays(&mut self, line: &DrawnLine, radius: u32) {
        let workspace = self.state.workspace();
        let locked = workspace.and_then(|workspace| workspace.locked_under_eraser(&line.points, radius));
        let sentence = locked.map(|name| {
            format!("\"{name}\" is locked, so its strokes stay: unlock it in the class list to erase them.")
        });
        self.refuse(sentence);
    }

    pub(crate) fn locked_refuses_change(&mut self, id: ClassId) -> bool {
        let workspace = self.state.workspace();
        let locked = workspace.and_then(|workspace| {
            let class = workspace.document.labels().class(id)?;
            workspace.is_locked(id).then(|| class.name.clone())
        });
        self.refuse(locked.map(unchanged))
    }

    /// Whether the lock of a class, or of one of its objects, keeps the class from going; then a message says so.
    fn locked_refuses_loss(&mut self, id: ClassId) -> bool {
        let locked = self.state.workspace().and_then(|workspace| {
            let objects = workspace.objects_of(id).into_iter();
            let mut locked = objects.filter(|(object, _)| workspace.is_object_locked(object.id));
            locked.next().map(|(object, _)| object.clone())
        });
        self.locked_refuses_change(id) || locked.is_some_and(|object| self.locked_refuses_object(&object))
    }

    /// Whether a lock keeps an object as it is, its own or that of its class; then a message says so.
    pub(crate) fn locked_refuses_object(&mut self, object: &Object) -> bool {
        let workspace = self.state.workspace();
        let is_locked = workspace.is_some_and(|workspace| workspace.is_object_locked(object.id));
        self.locked_refuses_change(object.class)
            || self.refuse(is_locked.then(|| unchanged(object.name.clone())))
    }

    /// Says why something is not done, if it is not; returns whether it is refused.
    pub(crate) fn refuse(&mut self, sentence: Option<String>) -> bool {
        let refused = sentence.is_some();
        if let Some(sentence) = sentence {
            self.state.messages.info(sentence);
        }
        refused
    }

    /// Locks, hides and shows classes, and keeps that in the project.
    pub(crate) fn change_class_view(&mut self, change: impl FnOnce(&mut ClassView)) {
        self.with_workspace(|workspace| workspace.change_class_view(change));
        self.keep_view();
    }

    /// Keeps how the scene is looked at, and its audit, in the project.
    pub(crate) fn keep_view(&mut self) {
        if let (Some(workspace), Some(project)) = (self.state.workspace(), &self.state.project) {
            project.keep(Results {
                view: Some(workspace.kept_view(&self.state.settings)),
                ..Results::default()
            });
        }
    }

    /// Opens the finder.
    pub(crate) fn find_class(&mut self, purpose: ClassUse) {
        let finder = ClassFinder::new(purpose, self.present_classes());
        self.show(Some(Dialog::FindClass(Box::new(finder))));
    }

    /// Does something with a class that was found.
    pub(crate) fn use_class(&mut self, purpose: ClassUse, class: ClassId) {
        self.state.dialog = None;
        match purpose {
            ClassUse::Choose => self.choose(Named::Class(class)),
            ClassUse::Answer => self.answer_with(class),
        }
    }

    pub(crate) fn read_classes(&mut self, path: PathBuf) {
        self.start("classes", Done::Failed, move |_, _| {
            Done::ClassesRead(read_class_list(&path))
        });
    }

    /// A class list was read for the dialog that adds classes.
    pub(crate) fn classes_read(&mut self, read: Result<Vec<Class>, ImportError>) {
        if let Some(Dialog::AddClasses(dialog)) = &mut self.state.dialog {
            dialog.take_file(read);
        }
    }

    pub(crate) fn save_classes_to(&mut self, path: PathBuf) {
        self.state.dialog = None;
        let classes = self.present_classes();
        self.start("classes", Done::Failed, move |_, _| {
            match write_json(&path, &classes) {
                Ok(()) => Done::ClassesSaved(classes.len(), path),
                Err(error) => Done::Failed(error.to_string()),
            }
        });
    }

    /// The classes were written to a file.
    pub(crate) fn classes_saved(&mut self, count: usize, path: &Path) {
        let classes = counted(count, "class", "classes");
        let sentence = format!("Saved {classes} to {}", path.display());
        self.state.messages.info(sentence);
    }
}

/// Why what has this name stays as it is.
pub(crate) fn unchanged(name: String) -> String {
    format!("\"{name}\" is locked: unlock it in the class list to change it or its strokes.")
}

/// What became of the classes that were to be added.
fn added(outcome: &AddedClasses) -> String {
    let mut sentence = match outcome.added.len() {
        0 => "No class was added.".to_owned(),
        some => format!("Added {}.", counted(some, "class", "classes")),
    };
    if !outcome.known.is_empty() {
        let names = outcome.known.iter().map(|class| class.name.clone());
        sentence += &format!(" Already there: {}.", some_of(names.collect()));
    }
    if !outcome.renumbered.is_empty() {
        let numbers = outcome.renumbered.iter();
        let numbers = numbers.map(|(asked, class)| format!("{} ({asked} is now {})", class.name, class.id));
        sentence += &format!(
            " With another number, because theirs is taken: {}.",
            some_of(numbers.collect())
        );
    }
    sentence
}

/// The first of many names, and how many more there are.
fn some_of(names: Vec<String>) -> String {
    const FEW: usize = 4;
    let shown = names[..names.len().min(FEW)].join(", ");
    match names.len().saturating_sub(FEW) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::scene::demo::Shot;

    use super::*;
    use crate::Command;
    use crate::model::{Stage, Start};
    use crate::preferences::Preferences;
    use crate::workspace::Workspace;

    #[test]
    fn who_labels_with_a_class_that_is_merged_goes_on_with_the_other() {
        let mut model = Model::new(Start::default(), Preferences::default());
        let workspace = Workspace::of_test(Shot::new(1, [16, 16]).scene(&|_, _| {}));
        model.state.stage = Stage::Open(Box::new(workspace));
        for name in ["wall", "chair", "seat"] {
            model.update(Command::AddClass(ClassUse::Choose, name.to_owned()));
        }
        model.update(Command::Choose(Named::Class(2)));
        for from in [2, 1] {
            model.update(Command::MergeClass(from, 3));
            assert_eq!(model.workspace().unwrap().class, Some(3));
        }
    }

    #[test]
    fn what_was_added_is_said_without_endless_lists() {
        let classes = |count| {
            (1..=count)
                .map(|id| Class::new(id, format!("c{id}")))
                .collect::<Vec<_>>()
        };
        let mut outcome = AddedClasses {
            added: classes(2),
            ..AddedClasses::default()
        };
        assert_eq!(added(&outcome), "Added 2 classes.");
        outcome.known = classes(6);
        outcome.renumbered = vec![(3, Class::new(9, "lamp"))];
        assert_eq!(
            added(&outcome),
            "Added 2 classes. Already there: c1, c2, c3, c4 and 2 more. With another number, because theirs is taken: \
             lamp (3 is now 9)."
        );
    }
}
