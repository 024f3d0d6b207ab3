//! The objects of a class as lines below it: go on with one, name it, merge and delete it, go there.

use egui::{
    Align2, FontId, Popup, Rect, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};
use inplace_core::labels::{Class, FoundObject, Object, ObjectId, default_color};
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::menu::{hide_words, lock_words};
use super::row::{MARK, Marks, ROW, SWATCH_MIDDLE};
use crate::canvas::object_words;
use crate::panels::parts::Menu;
use crate::theme;
use crate::widgets::{Icon, focus_ring, icon_button, line_of_text, swatch};

/// How far the objects are set in, in points.
const INSET: f32 = 16.0;

/// An object of the list, with where it is as far as that is known.
pub(super) type Listed<'a> = (&'a Object, Option<&'a FoundObject>);

/// The object that is being dragged.
struct Dragged(ObjectId);

/// Draws the line of an object; a click says it with the next strokes. Returns whether it is to be renamed.
pub(super) fn show(
    ui: &mut Ui,
    workspace: &Workspace,
    (class, own): (&Class, Listed<'_>),
    commands: &mut Commands,
) -> bool {
    let (object, found) = own;
    let (_, rect) = ui.allocate_space(vec2(ui.available_width(), ROW));
    let row = ui.interact(rect, ui.scope_id().with("object"), Sense::click_and_drag());
    let chosen = workspace.said().is_some_and(|said| said.id == object.id);
    let frames = found
        .map(|found| counted(found.frames, "frame", "frames"))
        .unwrap_or_default();
    let marks = Marks {
        name: &object.name,
        locked: workspace.is_object_locked(object.id),
        hidden: workspace.class_view.hidden.has(object.id),
    };
    let words = format!(
        "{}, object of {}, {frames}{}",
        object.name,
        class.name,
        marks.words()
    );
    row.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, chosen, &words));
    if row.clicked() {
        commands.push(Command::ChooseObject(object.id));
    }
    let side = ui.spacing().interact_size.y;
    let menu = Rect::from_min_size(
        pos2(rect.right() - 4.0 - side, rect.center().y - 0.5 * side),
        vec2(side, side),
    );
    // The eye takes the place of the number, so that the name stays readable.
    let number = found.filter(|_| !marks.hidden);
    let number = number
        .map(|found| format!("{} fr.", found.frames))
        .unwrap_or_default();
    let lock = menu.translate(vec2(-MARK, 0.0)).with_max_x(menu.left());
    let eye = lock.translate(vec2(if marks.hidden { -MARK } else { 0.0 }, 0.0));
    paint(
        ui,
        rect.with_max_x(eye.left()),
        &row,
        object,
        (chosen, marks.hidden),
        &number,
    );
    if marks.lock(ui, &row, lock) {
        commands.push(Command::SetObjectLocked(object.id, !marks.locked));
    }
    if marks.eye(ui, eye) {
        commands.push(Command::SetObjectHidden(object.id, false));
    }
    merge_by_drag(ui, workspace, &row, object, commands);
    let row = row.on_hover_ui(|ui| {
        ui.label(explained(workspace, class, own));
    });
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(menu));
    let button = icon_button(&mut child, Icon::More, &format!("Actions for {}", object.name));
    let mut rename = row.double_clicked();
    let mut contents = |ui: &mut Ui| entries(ui, workspace, (class, own), &mut rename, commands);
    Popup::menu(&button).show(&mut contents);
    Popup::context_menu(&row).show(&mut contents);
    if rename && (marks.locked || workspace.is_locked(class.id)) {
        // Refused with the reason.
        commands.push(Command::RenameObject(object.id, object.name.clone()));
        return false;
    }
    rename
}

fn paint(
    ui: &Ui,
    rect: Rect,
    row: &egui::Response,
    object: &Object,
    (chosen, hidden): (bool, bool),
    frames: &str,
) {
    let visuals = ui.visuals();
    let line = row.rect.with_min_x(rect.left() + INSET);
    if chosen {
        ui.painter()
            .rect_filled(line, 4, visuals.widgets.inactive.bg_fill);
        let mark = Rect::from_min_size(line.min, vec2(3.0, line.height()));
        ui.painter().rect_filled(mark, 2, theme::of(visuals).accent);
    } else if row.contains_pointer() {
        ui.painter().rect_filled(line, 4, theme::of(visuals).raised);
    }
    if row.has_focus() {
        focus_ring(ui, line);
    }
    let middle = pos2(rect.left() + SWATCH_MIDDLE + INSET, rect.center().y);
    swatch(ui.painter(), middle, default_color(object.id.number()), 12.0);
    let end = rect.right_center() - vec2(4.0, 0.0);
    let weak = visuals.weak_text_color();
    let frames = ui.painter().text(
        end,
        Align2::RIGHT_CENTER,
        frames,
        FontId::proportional(12.0),
        weak,
    );
    let name = Rect::from_x_y_ranges(middle.x + 12.0..=frames.left() - 6.0, rect.y_range());
    let color = match (chosen, hidden) {
        (true, _) => visuals.strong_text_color(),
        (false, true) => weak,
        (false, false) => visuals.text_color(),
    };
    line_of_text(ui, name, &object.name, 13.0, color);
}

/// What is known of an object, in words.
fn explained(workspace: &Workspace, class: &Class, (object, found): Listed<'_>) -> String {
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
        format!(
            "{}, {} pixels; ",
            counted(found.frames, "frame", "frames"),
            found.pixels
        )
    });
    format!("{}: {seen}{said}", object_words(&class.name, object))
}

/// Merges an object into the one that it is dropped on.
fn merge_by_drag(
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

fn entries(
    ui: &mut Ui,
    workspace: &Workspace,
    (class, (object, found)): (&Class, Listed<'_>),
    rename: &mut bool,
    commands: &mut Commands,
) {
    if ui.button("Rename").clicked() {
        *rename = true;
        ui.close();
    }
    let seen = found.is_some_and(|found| found.click.is_some());
    Menu { ui, commands }.entry(seen, "Show in its best frame", Command::GoToObject(object.id));
    let objects = workspace.objects_of(class.id);
    ui.add_enabled_ui(objects.len() > 1, |ui| {
        ui.menu_button("Merge into", |ui| {
            ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for (other, _) in objects.iter().filter(|(other, _)| other.id != object.id) {
                    let merge = Command::MergeObject(object.id, other.id);
                    Menu { ui, commands }.entry(true, &other.name, merge);
                }
            });
        });
    });
    ui.separator();
    let hidden = &workspace.class_view.hidden;
    let (locked, is_hidden) = (workspace.is_object_locked(object.id), hidden.has(object.id));
    let only = hidden.all_but == Some(object.id);
    let only_words = if only {
        "Show the others again"
    } else {
        "Show only this one"
    };
    let mut menu = Menu { ui, commands };
    menu.entry(
        true,
        lock_words(locked),
        Command::SetObjectLocked(object.id, !locked),
    );
    menu.entry(
        true,
        hide_words(is_hidden),
        Command::SetObjectHidden(object.id, !is_hidden),
    );
    menu.entry(true, only_words, Command::ShowOnly(object.id, !only));
    menu.ui.separator();
    let listed = workspace.document.labels().object(object.id).is_some();
    let delete = format!("Delete, its strokes say only {}", class.name);
    Menu { ui, commands }.entry(listed, &delete, Command::DeleteObject(object.id));
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
