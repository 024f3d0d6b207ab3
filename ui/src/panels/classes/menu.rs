//! The menu of the class list, and that of each class.

use egui::{Popup, Rect, ScrollArea, Ui};
use inplace_model::dialogs::{AddClasses, ClassUse, Dialog};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::widgets::{Icon, icon_button};

/// The button at the head of the list with what concerns all classes.
pub(super) fn of_list(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let button = icon_button(ui, Icon::More, "Class list");
    let view = &workspace.class_view;
    let some = !workspace.document.classes().is_empty();
    Popup::menu(&button).show(|ui| {
        entry(ui, true, "Add classes...", || {
            commands.push(Command::Show(Some(Dialog::AddClasses(Box::new(
                AddClasses::new(0),
            )))));
        });
        let path = String::new();
        entry(ui, some, "Save classes as a file...", || {
            commands.push(Command::Show(Some(Dialog::SaveClasses { path })));
        });
        ui.separator();
        let find = egui::Button::new("Find a class").shortcut_text("C");
        if ui.add(find).clicked() {
            commands.push(Command::FindClass(ClassUse::Choose));
            ui.close();
        }
        entry(ui, !view.hidden.is_empty(), "Show all classes", || {
            commands.push(Command::ShowClasses);
        });
        entry(ui, !view.locked.is_empty(), "Unlock all classes", || {
            commands.push(Command::UnlockClasses);
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
    commands: &mut Commands,
) -> bool {
    let Some(class) = workspace.document.classes().get(index) else {
        return false;
    };
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect));
    let button = icon_button(&mut child, Icon::More, &format!("Actions for {}", class.name));
    let mut rename = false;
    let mut contents = |ui: &mut Ui| entries(ui, workspace, index, &mut rename, commands);
    Popup::menu(&button).show(&mut contents);
    Popup::context_menu(row).show(&mut contents);
    rename
}

fn entries(ui: &mut Ui, workspace: &Workspace, index: usize, rename: &mut bool, commands: &mut Commands) {
    let classes = workspace.document.classes();
    let class = &classes[index];
    let (locked, hidden) = (workspace.is_locked(class.id), workspace.is_hidden(class.id));
    entry(ui, true, "Rename", || *rename = true);
    ui.add_enabled_ui(classes.len() > 1, |ui| {
        ui.menu_button("Merge into", |ui| {
            ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for other in classes.iter().filter(|other| other.id != class.id) {
                    entry(ui, true, &other.name, || {
                        commands.push(Command::MergeClass(class.id, other.id));
                    });
                }
            });
        });
    });
    ui.separator();
    entry(ui, index > 0, "Move up", || {
        commands.push(Command::MoveClass(class.id, index - 1));
    });
    entry(ui, index + 1 < classes.len(), "Move down", || {
        commands.push(Command::MoveClass(class.id, index + 1));
    });
    ui.separator();
    let lock = if locked { "Unlock" } else { "Lock" };
    entry(ui, true, lock, || {
        commands.push(Command::SetClassLocked(class.id, !locked));
    });
    let hide = if hidden {
        "Show in the overlay"
    } else {
        "Hide in the overlay"
    };
    entry(ui, true, hide, || {
        commands.push(Command::SetClassHidden(class.id, !hidden));
    });
    ui.separator();
    let strokes = workspace.document.strokes_of_class(class.id);
    let delete = match strokes {
        0 => "Delete".to_owned(),
        1 => "Delete with its stroke".to_owned(),
        many => format!("Delete with its {many} strokes"),
    };
    entry(ui, true, &delete, || {
        commands.push(Command::DeleteClass(class.id));
    });
}

fn entry(ui: &mut Ui, enabled: bool, text: &str, chosen: impl FnOnce()) {
    if ui.add_enabled(enabled, egui::Button::new(text)).clicked() {
        chosen();
        ui.close();
    }
}
