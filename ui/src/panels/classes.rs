//! The class list: choose, add, rename, recolour, merge, delete.

use egui::{
    Color32, Key, Popup, PopupCloseBehavior, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2,
};
use inplace_core::labels::{Class, ClassId, VOID};

use crate::action::{Action, Actions};
use crate::canvas::VOID_COLOR;
use crate::theme;
use crate::widgets::{Icon, empty_state, focus_ring, heading, icon_button, line_of_text, swatch};
use crate::workspace::Workspace;

const ROW: f32 = 32.0;

/// The class list with what is being typed in it.
#[derive(Debug, Default)]
pub struct ClassPanel {
    new_name: String,
    renaming: Option<(ClassId, String)>,
}

impl ClassPanel {
    /// Draws the list.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
        heading(ui, "Classes");
        self.add_field(ui, workspace, actions);
        let classes = workspace.document().classes();
        if classes.is_empty() {
            empty_state(
                ui,
                "No classes yet. Type a name and press Enter, or click on something in the image.",
            );
        }
        ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            for (index, class) in classes.iter().enumerate() {
                ui.push_id(class.id, |ui| self.row(ui, workspace, index, class, actions));
            }
            void_row(ui, workspace, actions);
        });
    }

    fn add_field(&mut self, ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
        ui.horizontal(|ui| {
            let side = ui.spacing().interact_size.y;
            let field = egui::TextEdit::singleline(&mut self.new_name)
                .hint_text("New class")
                .margin(vec2(8.0, 5.0))
                .desired_width(ui.available_width() - side - theme::GAP - 16.0);
            let response = ui.add(field).accessible_name("New class");
            let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            let name = self.new_name.trim();
            let taken = workspace
                .document()
                .classes()
                .iter()
                .any(|class| class.name == name);
            let possible = !name.is_empty() && !taken;
            let clicked = ui
                .add_enabled_ui(possible, |ui| icon_button(ui, Icon::Add, "Add class").clicked())
                .inner;
            if possible && (entered || clicked) {
                actions.push(Action::AddClass(name.to_owned()));
                self.new_name.clear();
                // Ready for the next name.
                response.request_focus();
            }
        });
    }

    fn row(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        class: &Class,
        actions: &mut Actions,
    ) {
        if let Some((id, name)) = &mut self.renaming
            && *id == class.id
        {
            if rename_field(ui, class, name, actions) {
                self.renaming = None;
            }
            return;
        }
        let strokes = workspace.document().strokes_of_class(class.id);
        let line = RowLine {
            id: class.id,
            name: &class.name,
            color: class.color,
            strokes,
            slot: (index < 9).then_some(index + 1),
            chosen: workspace.class() == Some(class.id),
            menu: true,
        };
        let (row, parts) = line.show(ui, actions);
        if row.double_clicked() {
            self.renaming = Some((class.id, class.name.clone()));
        }
        recolor_popup(ui, class, parts.swatch, actions);
        self.menu(ui, workspace, class, parts.menu, actions);
    }

    fn menu(&mut self, ui: &mut Ui, workspace: &Workspace, class: &Class, rect: Rect, actions: &mut Actions) {
        let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect));
        let button = icon_button(&mut child, Icon::More, &format!("Actions for {}", class.name));
        Popup::menu(&button).show(|ui| {
            if ui.button("Rename").clicked() {
                self.renaming = Some((class.id, class.name.clone()));
                ui.close();
            }
            let others: Vec<&Class> = workspace
                .document()
                .classes()
                .iter()
                .filter(|other| other.id != class.id)
                .collect();
            ui.add_enabled_ui(!others.is_empty(), |ui| {
                ui.menu_button("Merge into", |ui| {
                    ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                        for other in others {
                            if ui.button(&other.name).clicked() {
                                actions.push(Action::MergeClass(class.id, other.id));
                                ui.close();
                            }
                        }
                    });
                });
            });
            let strokes = workspace.document().strokes_of_class(class.id);
            let text = match strokes {
                0 => "Delete".to_owned(),
                1 => "Delete with its stroke".to_owned(),
                many => format!("Delete with its {many} strokes"),
            };
            if ui.button(text).clicked() {
                actions.push(Action::DeleteClass(class.id));
                ui.close();
            }
        });
    }
}

/// One line of the list.
struct RowLine<'a> {
    id: ClassId,
    name: &'a str,
    color: [u8; 3],
    strokes: usize,
    /// The digit that chooses it.
    slot: Option<usize>,
    chosen: bool,
    menu: bool,
}

/// Where the parts of a line lie.
struct Parts {
    swatch: Rect,
    menu: Rect,
}

impl RowLine<'_> {
    fn show(&self, ui: &mut Ui, actions: &mut Actions) -> (egui::Response, Parts) {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
        let words = format!(
            "{}, {} {}",
            self.name,
            self.strokes,
            if self.strokes == 1 { "stroke" } else { "strokes" }
        );
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, self.chosen, &words));
        if response.clicked() {
            actions.push(Action::ChooseClass(self.id));
        }
        let side = ui.spacing().interact_size.y;
        let parts = Parts {
            swatch: Rect::from_center_size(pos2(rect.left() + 18.0, rect.center().y), vec2(24.0, 24.0)),
            menu: Rect::from_center_size(
                pos2(rect.right() - 4.0 - 0.5 * side, rect.center().y),
                vec2(side, side),
            ),
        };
        self.paint(ui, rect, &response, &parts);
        (response, parts)
    }

    fn paint(&self, ui: &Ui, rect: Rect, response: &egui::Response, parts: &Parts) {
        let visuals = ui.visuals();
        let hovered = response.hovered();
        if self.chosen {
            ui.painter()
                .rect_filled(rect, 4, visuals.widgets.inactive.bg_fill);
            let mark = Rect::from_min_size(rect.min, vec2(3.0, rect.height()));
            ui.painter().rect_filled(mark, 2, theme::accent(visuals));
        } else if hovered {
            ui.painter().rect_filled(rect, 4, theme::raised(visuals));
        }
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        swatch(ui.painter(), parts.swatch.center(), self.color, 16.0);
        let right = if self.menu {
            parts.menu.left()
        } else {
            rect.right() - 8.0
        };
        let digit = Rect::from_min_max(pos2(right - 20.0, rect.top()), pos2(right, rect.bottom()));
        if let Some(slot) = self.slot {
            let font = egui::FontId::monospace(12.0);
            let color = visuals.weak_text_color();
            let text = slot.to_string();
            ui.painter()
                .text(digit.center(), egui::Align2::CENTER_CENTER, text, font, color);
        }
        let mut end = digit.left();
        if self.strokes > 0 {
            let font = egui::FontId::proportional(12.0);
            let color = visuals.weak_text_color();
            let at = pos2(end - 4.0, rect.center().y);
            let text = self.strokes.to_string();
            end = ui
                .painter()
                .text(at, egui::Align2::RIGHT_CENTER, text, font, color)
                .left();
        }
        let name = Rect::from_min_max(
            pos2(parts.swatch.right() + 6.0, rect.top()),
            pos2(end - 6.0, rect.bottom()),
        );
        let color = if self.chosen {
            visuals.strong_text_color()
        } else {
            visuals.text_color()
        };
        line_of_text(ui, name, self.name, 14.0, color);
    }
}

fn void_row(ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
    let line = RowLine {
        id: VOID,
        name: "void",
        color: VOID_COLOR,
        strokes: workspace.document().strokes_of_class(VOID),
        slot: Some(0),
        chosen: workspace.class() == Some(VOID),
        menu: true,
    };
    let (response, _) = line.show(ui, actions);
    response.on_hover_text("Nothing here: not trained on, and exported as 0");
}

/// A text field in place of the row; returns whether renaming is over.
fn rename_field(ui: &mut Ui, class: &Class, name: &mut String, actions: &mut Actions) -> bool {
    let field = egui::TextEdit::singleline(name)
        .margin(vec2(8.0, 6.0))
        .desired_width(ui.available_width() - 16.0);
    let response = ui.add(field).accessible_name(format!("Rename {}", class.name));
    if response.lost_focus() {
        let cancelled = ui.input(|input| input.key_pressed(Key::Escape));
        let trimmed = name.trim();
        if !cancelled && !trimmed.is_empty() && trimmed != class.name {
            actions.push(Action::RenameClass(class.id, trimmed.to_owned()));
        }
        return true;
    }
    if !response.has_focus() {
        response.request_focus();
    }
    false
}

/// The swatch as a button that opens the colours to choose from.
fn recolor_popup(ui: &Ui, class: &Class, rect: Rect, actions: &mut Actions) {
    let response = ui.interact(rect, ui.scope_id().with("colour"), Sense::click());
    let name = format!("Colour of {}", class.name);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
    if response.has_focus() {
        focus_ring(ui, rect);
    }
    Popup::menu(&response)
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| {
            ui.label(&name);
            egui::Grid::new("colours")
                .spacing([4.0, 4.0])
                .min_col_width(24.0)
                .show(ui, |ui| {
                    for id in 1..=24 {
                        let color = Class::new(id, "").color;
                        let (cell, choice) = ui.allocate_exact_size(vec2(24.0, 24.0), Sense::click());
                        let words = format!("Colour {id}");
                        choice.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
                        let side = if choice.hovered() { 24.0 } else { 20.0 };
                        swatch(ui.painter(), cell.center(), color, side);
                        if choice.has_focus() {
                            focus_ring(ui, cell);
                        }
                        if choice.clicked() {
                            actions.push(Action::RecolorClass(class.id, color));
                            ui.close();
                        }
                        if id % 6 == 0 {
                            ui.end_row();
                        }
                    }
                });
            custom_color(ui, class, actions);
        });
    response.on_hover_text(name);
}

/// Any colour as hexadecimal digits.
fn custom_color(ui: &mut Ui, class: &Class, actions: &mut Actions) {
    let id = ui.scope_id().with("custom colour");
    let [r, g, b] = class.color;
    let mut text = ui
        .data(|data| data.get_temp::<String>(id))
        .unwrap_or_else(|| format!("#{r:02x}{g:02x}{b:02x}"));
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut text).desired_width(88.0);
        let response = ui.add(field).accessible_name("Colour as hexadecimal digits");
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let parsed = Color32::from_hex(text.trim()).ok();
        let clicked = ui
            .add_enabled(parsed.is_some(), egui::Button::new("Use"))
            .clicked();
        if let Some(color) = parsed
            && (entered || clicked)
        {
            actions.push(Action::RecolorClass(class.id, [color.r(), color.g(), color.b()]));
            ui.close();
        }
    });
    ui.data_mut(|data| data.insert_temp(id, text));
}
