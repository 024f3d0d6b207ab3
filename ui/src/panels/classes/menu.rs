//! The menu of the class list, and that of each class.

use egui::{Popup, Rect, ScrollArea, Ui};
use inplace_model::dialogs::{AddClasses, Dialog};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::row::{Row, lock_words};
use crate::keys::table::FIND_CLASS;
use crate::panels::parts::Menu;
use crate::widgets::{Icon, icon_button};

/// The button at the head of the list with what concerns all classes.
pub(super) fn of_list(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let button = icon_button(ui, Icon::More, "Class list");
    let view = &workspace.class_view;
    let some = !workspace.document.classes().is_empty();
    Popup::menu(&button).show(|ui| {
        let mut menu = Menu { ui, commands };
        let add = Dialog::AddClasses(Box::new(AddClasses::new(
            0,
            workspace.document.classes().to_vec(),
        )));
        menu.entry(true, "Add classes...", Command::Show(Some(add)));
        let save = Dialog::SaveClasses(String::new());
        menu.entry(some, "Save classes as a file...", Command::Show(Some(save)));
        menu.ui.separator();
        menu.keyed(true, &FIND_CLASS);
        menu.entry(view.hidden.is_some(), "Show all that is hidden", Command::ShowAll);
        let locked = !view.locked.is_empty() || !view.locked_objects.is_empty();
        menu.entry(locked, "Unlock all", Command::UnlockAll);
    });
}

/// The menu of a class or an object with these entries after the first, behind a button and behind the right button on
/// its line; returns whether it is to be renamed.
pub(super) fn of_row(
    ui: &mut Ui,
    row: &Row<'_>,
    response: &egui::Response,
    rect: Rect,
    mut entries: impl FnMut(&mut Ui),
) -> bool {
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect));
    let button = icon_button(&mut child, Icon::More, &format!("Actions for {}", row.name));
    let mut rename = false;
    let mut contents = |ui: &mut Ui| {
        if ui.button("Rename").clicked() {
            rename = true;
            ui.close();
        }
        entries(ui);
    };
    Popup::menu(&button).show(&mut contents);
    Popup::context_menu(response).show(&mut contents);
    rename
}

/// The entries for the class with this index.
pub(super) fn of_class(
    ui: &mut Ui,
    workspace: &Workspace,
    index: usize,
    row: &Row<'_>,
    commands: &mut Commands,
) {
    let classes = workspace.document.classes();
    let class = &classes[index];
    let others = classes.iter().filter(|other| other.id != class.id);
    let merges = others.map(|other| (&*other.name, Command::MergeClass(class.id, other.id)));
    merge_entries(ui, merges, commands);
    ui.separator();
    for (thing, name) in [(true, "Thing (has objects)"), (false, "Stuff")] {
        if ui.radio(class.thing == thing, name).clicked() {
            commands.push(Command::SetClassThing(class.id, thing));
            ui.close();
        }
    }
    ui.separator();
    let mut menu = Menu { ui, commands };
    let above = index.saturating_sub(1);
    menu.entry(index > 0, "Move up", Command::MoveClass(class.id, above));
    let is_last = index + 1 == classes.len();
    menu.entry(!is_last, "Move down", Command::MoveClass(class.id, index + 1));
    menu.ui.separator();
    lock_and_hide_entries(&mut menu, row);
    menu.ui.separator();
    let delete = match workspace.document.strokes_of_class(class.id) {
        // Imported pixels may say it, too, and are too many to be counted here.
        _ if workspace.document.labels().imported.is_some() => "Delete with its labels".to_owned(),
        0 => "Delete".to_owned(),
        1 => "Delete with its stroke".to_owned(),
        many => format!("Delete with its {many} strokes"),
    };
    menu.entry(true, &delete, Command::Delete(row.named));
}

/// What merges a class or an object into one of the others, with their names.
pub(super) fn merge_entries<'a>(
    ui: &mut Ui,
    merges: impl Iterator<Item = (&'a str, Command)>,
    commands: &mut Commands,
) {
    let mut merges = merges.peekable();
    ui.add_enabled_ui(merges.peek().is_some(), |ui| {
        ui.menu_button("Merge into", |ui| {
            ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for (name, merge) in merges {
                    Menu { ui, commands }.entry(true, name, merge);
                }
            });
        });
    });
}

/// What locks and hides a class or an object, or takes that back.
pub(super) fn lock_and_hide_entries(menu: &mut Menu<'_>, row: &Row<'_>) {
    let lock = Command::SetLocked(row.named, !row.locked);
    menu.entry(true, lock_words(row.locked), lock);
    let words = match row.hidden {
        true => "Show in the overlay",
        false => "Hide in the overlay",
    };
    menu.entry(true, words, Command::SetHidden(row.named, !row.hidden));
}
