//! The objects of a class as lines below it: go on with one, name it, merge and delete it, go there.

use egui::{Stroke, StrokeKind, Ui, vec2};
use inplace_core::labels::{Class, FoundObject, Object, ObjectId};
use inplace_model::class_view::Named;
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::menu;
use super::row::{INSET, ROW, Row, SWATCH_MIDDLE};
use crate::canvas::{object_color, object_words};
use crate::panels::parts::Menu;
use crate::theme;
use crate::widgets::line_of_text;

/// An object of the list, with where it is as far as that is known.
pub(super) type Listed<'a> = (&'a Object, Option<&'a FoundObject>);

/// The object that is being dragged.
struct Dragged(ObjectId);

/// The line of an object; a click says it with the next strokes.
pub(super) fn row<'a>(
    workspace: &Workspace,
    class: &Class,
    (object, found): (&'a Object, Option<&FoundObject>),
) -> Row<'a> {
    let frames = found
        .map(|found| format!(", {}", counted(found.frames, "frame", "frames")))
        .unwrap_or_default();
    let hidden = workspace.class_view.hidden.has(object.id);
    // The eye takes the place of the number, so that the name stays readable.
    let number = found
        .filter(|_| !hidden)
        .map(|found| format!("{} fr.", found.frames))
        .unwrap_or_default();
    Row {
        named: Named::Object(object.id),
        name: &object.name,
        color: object_color(class.color, object.id, workspace.is_first_of_class(object)),
        facts: format!("object of {}{frames}", class.name),
        number: Some(number),
        slot: None,
        chosen: workspace.said().is_some_and(|said| said.id == object.id),
        said: None,
        locked: workspace.is_object_locked(object.id),
        hidden,
        unfolded: None,
    }
}

/// What is known of an object, in words.
pub(super) fn explained(workspace: &Workspace, class: &Class, (object, found): Listed<'_>) -> String {
    let labels = workspace.document.labels();
    let said = match labels.object(object.id) {
        Some(_) => {
            let strokes = labels.strokes.values();
            let own = strokes.filter(|stroke| stroke.object == Some(object.id));
            match own.count() {
                0 if labels.imported.is_some() => "no stroke names it, but imported images".to_owned(),
                strokes => counted(strokes, "stroke names it", "strokes name it"),
            }
        }
        None => "no stroke names it yet".to_owned(),
    };
    let seen = found.map_or_else(String::new, |found| {
        let frames = counted(found.frames, "frame", "frames");
        let pixels = counted(found.pixels as usize, "pixel", "pixels");
        format!("{frames}, {pixels}; ")
    });
    format!("{}: {seen}{said}", object_words(&class.name, object))
}

/// Merges an object into the one that it is dropped on.
pub(super) fn merge_by_drag(
    ui: &Ui,
    workspace: &Workspace,
    row: &egui::Response,
    object: &Object,
    commands: &mut Commands,
) {
    row.dnd_set_drag_payload(Dragged(object.id));
    let is_other = |dragged: ObjectId| {
        let of_class = workspace.objects_of(object.class);
        dragged != object.id && of_class.iter().any(|(other, _)| other.id == dragged)
    };
    if row
        .dnd_hover_payload::<Dragged>()
        .is_some_and(|dragged| is_other(dragged.0))
    {
        let line = Stroke::new(2.0, theme::of(ui.visuals()).accent);
        ui.painter().rect_stroke(
            row.rect.with_min_x(row.rect.left() + INSET),
            4,
            line,
            StrokeKind::Inside,
        );
        if let Some(dragged) = row.dnd_release_payload::<Dragged>() {
            commands.push(Command::MergeObject(dragged.0, object.id));
        }
    }
}

/// The entries for an object.
pub(super) fn entries(
    ui: &mut Ui,
    workspace: &Workspace,
    (class, (object, found)): (&Class, Listed<'_>),
    row: &Row<'_>,
    commands: &mut Commands,
) {
    let seen = found.is_some_and(|found| found.click.is_some());
    Menu { ui, commands }.entry(seen, "Show in its best frame", Command::GoToObject(object.id));
    let objects = workspace.objects_of(class.id).into_iter();
    let others = objects.filter(|(other, _)| other.id != object.id);
    let merges = others.map(|(other, _)| (&*other.name, Command::MergeObject(object.id, other.id)));
    menu::merge_entries(ui, merges, commands);
    ui.separator();
    let only = workspace.class_view.hidden.all_but == Some(object.id);
    let only_words = if only {
        "Show the others again"
    } else {
        "Show only this one"
    };
    let mut menu = Menu { ui, commands };
    menu::lock_and_hide_entries(&mut menu, row);
    menu.entry(true, only_words, Command::ShowOnly(object.id, !only));
    menu.ui.separator();
    let listed = workspace.document.labels().object(object.id).is_some();
    let delete = format!("Delete, its strokes say only {}", class.name);
    menu.entry(listed, &delete, Command::Delete(row.named));
}

/// The line below an unfolded class of which nothing is known yet.
pub(super) fn none(ui: &mut Ui, searching: bool) {
    let (_, rect) = ui.allocate_space(vec2(ui.available_width(), ROW));
    let words = if searching {
        "Looking for objects"
    } else {
        "No objects yet"
    };
    let place = rect.with_min_x(rect.left() + SWATCH_MIDDLE + INSET - 6.0);
    line_of_text(ui, place, words, 12.0, ui.visuals().weak_text_color());
}
