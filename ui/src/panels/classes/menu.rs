//! The menu of the class list, and that of each class.

use egui::{Popup, Rect, ScrollArea, Ui};

use crate::action::{Action, Actions};
use crate::dialogs::{AddClasses, ClassUse, Dialog};
use crate::english::classes as english;
use crate::widgets::{Icon, icon_button};
use crate::workspace::Workspace;

/// The button at the head of the list with what concerns all classes.
pub(super) fn of_list(ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
    let button = icon_button(ui, Icon::More, english::LIST_MENU);
    let view = workspace.class_view();
    let some = !workspace.document().classes().is_empty();
    Popup::menu(&button).show(|ui| {
        entry(ui, true, english::ADD_MANY, || {
            actions.push(Action::Show(Some(Dialog::AddClasses(Box::new(AddClasses::new(
                0,
            ))))));
        });
        let path = String::new();
        entry(ui, some, english::SAVE_AS_FILE, || {
            actions.push(Action::Show(Some(Dialog::SaveClasses { path })));
        });
        ui.separator();
        let find = egui::Button::new(english::FIND).shortcut_text("C");
        if ui.add(find).clicked() {
            actions.push(Action::FindClass(ClassUse::Choose));
            ui.close();
        }
        entry(ui, !view.hidden().is_empty(), english::SHOW_ALL, || {
            actions.push(Action::ShowClasses);
        });
        entry(ui, !view.locked().is_empty(), english::UNLOCK_ALL, || {
            actions.push(Action::UnlockClasses);
        });
    });
}

/// The menu of the class with this index, behind a button and behind the right button on its line; returns whether it
/// is to be renamed.
pub(super) fn of_class(
    ui: &mut Ui,
    row: &egui::Response,
    workspace: &Workspace,
    index: usize,
    rect: Rect,
    actions: &mut Actions,
) -> bool {
    let Some(class) = workspace.document().classes().get(index) else {
        return false;
    };
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect));
    let button = icon_button(&mut child, Icon::More, &english::actions_for(&class.name));
    let mut rename = false;
    let mut contents = |ui: &mut Ui| entries(ui, workspace, index, &mut rename, actions);
    Popup::menu(&button).show(&mut contents);
    Popup::context_menu(row).show(&mut contents);
    rename
}

fn entries(ui: &mut Ui, workspace: &Workspace, index: usize, rename: &mut bool, actions: &mut Actions) {
    let classes = workspace.document().classes();
    let class = &classes[index];
    let (locked, hidden) = (workspace.is_locked(class.id), workspace.is_hidden(class.id));
    entry(ui, true, english::RENAME, || *rename = true);
    ui.add_enabled_ui(classes.len() > 1, |ui| {
        ui.menu_button(english::MERGE, |ui| {
            ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for other in classes.iter().filter(|other| other.id != class.id) {
                    entry(ui, true, &other.name, || {
                        actions.push(Action::MergeClass(class.id, other.id));
                    });
                }
            });
        });
    });
    ui.separator();
    entry(ui, index > 0, english::UP, || {
        actions.push(Action::MoveClass(class.id, index - 1));
    });
    entry(ui, index + 1 < classes.len(), english::DOWN, || {
        actions.push(Action::MoveClass(class.id, index + 1));
    });
    ui.separator();
    let lock = if locked { english::UNLOCK } else { english::LOCK };
    entry(ui, true, lock, || {
        actions.push(Action::SetClassLocked(class.id, !locked));
    });
    let hide = if hidden { english::UNHIDE } else { english::HIDE };
    entry(ui, true, hide, || {
        actions.push(Action::SetClassHidden(class.id, !hidden));
    });
    ui.separator();
    let strokes = workspace.document().strokes_of_class(class.id);
    entry(ui, true, &english::delete(strokes), || {
        actions.push(Action::DeleteClass(class.id));
    });
}

fn entry(ui: &mut Ui, enabled: bool, text: &str, chosen: impl FnOnce()) {
    if ui.add_enabled(enabled, egui::Button::new(text)).clicked() {
        chosen();
        ui.close();
    }
}
