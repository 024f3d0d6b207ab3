//! A line of the class list, and moving it.

use egui::{Key, Modifiers, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use inplace_core::labels::{ClassId, VOID};
use inplace_model::text::counted;
use inplace_model::{Command, Commands};

use super::menu::lock_words;
use crate::theme;
use crate::widgets::{Icon, focus_ring, key_cap, line_of_text, swatch};

/// Height of a line, in points.
pub(super) const ROW: f32 = 32.0;

/// Where the middle of the colour is, from the left end of the line.
pub(super) const SWATCH_MIDDLE: f32 = 30.0;

/// Width of the padlock and of the eye.
pub(super) const MARK: f32 = 20.0;

/// What a line shows.
pub(super) struct Row<'a> {
    pub id: ClassId,
    pub name: &'a str,
    pub color: [u8; 3],
    pub strokes: usize,
    /// The digit that chooses it.
    pub slot: Option<usize>,
    pub chosen: bool,
    /// The name of the object that its strokes say now.
    pub said: Option<&'a str>,
    pub locked: bool,
    pub hidden: bool,
    /// Whether its objects are listed below it; `None` where it can have none.
    pub unfolded: Option<bool>,
}

/// Where the parts of a line lie.
pub(super) struct Parts {
    pub swatch: Rect,
    pub menu: Rect,
    digit: Rect,
    lock: Rect,
    eye: Rect,
    fold: Rect,
}

impl Row<'_> {
    fn marks(&self) -> Marks<'_> {
        Marks {
            name: self.name,
            locked: self.locked,
            hidden: self.hidden,
        }
    }

    /// Draws the line; a click chooses the class.
    pub(super) fn show(&self, ui: &mut Ui, commands: &mut Commands) -> (egui::Response, Parts) {
        let size = vec2(ui.available_width(), ROW);
        let (_, rect) = ui.allocate_space(size);
        // By class and not by place, so that a line that moves keeps the keyboard.
        let response = ui.interact(rect, ui.scope_id().with("line"), Sense::click_and_drag());
        let marks = self.marks().words();
        let strokes = counted(self.strokes, "stroke", "strokes");
        let said = self
            .said
            .map(|said| format!(", saying {said}"))
            .unwrap_or_default();
        let words = format!("{}, {strokes}{marks}{said}", self.name);
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, self.chosen, &words));
        if response.clicked() {
            commands.push(Command::ChooseClass(self.id));
        }
        let parts = self.parts(ui, rect);
        let cut = self.paint(ui, rect, &response, &parts);
        let response = if cut {
            response.on_hover_text(self.name)
        } else {
            response
        };
        (response, parts)
    }

    fn parts(&self, ui: &Ui, rect: Rect) -> Parts {
        let side = ui.spacing().interact_size.y;
        let middle = rect.center().y;
        let mut end = rect.right() - 4.0 - side;
        let menu = Rect::from_min_size(pos2(end, middle - 0.5 * side), vec2(side, side));
        let mut part = |width: f32| {
            end -= width;
            Rect::from_min_size(pos2(end, rect.top()), vec2(width, rect.height()))
        };
        Parts {
            swatch: Rect::from_center_size(pos2(rect.left() + SWATCH_MIDDLE, middle), vec2(24.0, 24.0)),
            fold: rect
                .with_min_x(rect.left() + 3.0)
                .with_max_x(rect.left() + SWATCH_MIDDLE - 11.0),
            menu,
            digit: part(if self.slot.is_some() { 20.0 } else { 0.0 }),
            lock: part(if self.id == VOID { 0.0 } else { MARK }),
            eye: part(if self.hidden { MARK } else { 0.0 }),
        }
    }

    /// Paints the line; returns whether the name is cut.
    fn paint(&self, ui: &Ui, rect: Rect, response: &egui::Response, parts: &Parts) -> bool {
        let visuals = ui.visuals();
        if self.chosen {
            ui.painter()
                .rect_filled(rect, 4, visuals.widgets.inactive.bg_fill);
            let mark = Rect::from_min_size(rect.min, vec2(3.0, rect.height()));
            ui.painter().rect_filled(mark, 2, theme::of(visuals).accent);
        } else if response.contains_pointer() {
            ui.painter().rect_filled(rect, 4, theme::of(visuals).raised);
        }
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        swatch(ui.painter(), parts.swatch.center(), self.color, 16.0);
        if let Some(slot) = self.slot {
            key_cap(ui, parts.digit.center(), &slot.to_string());
        }
        let mut end = parts.eye.left();
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
        } else if self.hidden {
            visuals.weak_text_color()
        } else {
            visuals.text_color()
        };
        match self.said {
            Some(said) => line_of_text(ui, name, &format!("{}: {said}", self.name), 14.0, color),
            None => line_of_text(ui, name, self.name, 14.0, color),
        }
    }

    /// The arrow that lists its objects, the padlock, and the eye of a hidden class.
    pub(super) fn buttons(&self, ui: &Ui, row: &egui::Response, parts: &Parts, commands: &mut Commands) {
        if let Some(unfolded) = self.unfolded {
            let (icon, does) = match unfolded {
                true => (Icon::Unfolded, "Hide"),
                false => (Icon::Folded, "List"),
            };
            if mark(
                ui,
                parts.fold,
                icon,
                &format!("{does} the objects of {}", self.name),
                true,
            ) {
                commands.push(Command::UnfoldClass(self.id, !unfolded));
            }
        }
        let marks = self.marks();
        if marks.lock(ui, row, parts.lock) {
            commands.push(Command::SetClassLocked(self.id, !self.locked));
        }
        if marks.eye(ui, parts.eye) {
            commands.push(Command::SetClassHidden(self.id, false));
        }
    }
}

/// The padlock and the eye of a class or an object.
pub(super) struct Marks<'a> {
    pub name: &'a str,
    pub locked: bool,
    pub hidden: bool,
}

impl Marks<'_> {
    /// What its line says of it.
    pub(super) fn words(&self) -> String {
        let locked = if self.locked { ", locked" } else { "" };
        let hidden = if self.hidden { ", hidden" } else { "" };
        format!("{locked}{hidden}")
    }

    /// The padlock, which is seen on the line that is pointed at and where it is locked; returns whether it was clicked.
    pub(super) fn lock(&self, ui: &Ui, row: &egui::Response, rect: Rect) -> bool {
        let icon = if self.locked { Icon::Locked } else { Icon::Unlocked };
        let name = format!("{} {}", lock_words(self.locked), self.name);
        let near = self.locked || row.contains_pointer() || row.has_focus();
        mark(ui, rect, icon, &name, near)
    }

    /// The eye of what is hidden; returns whether it was clicked.
    pub(super) fn eye(&self, ui: &Ui, rect: Rect) -> bool {
        let name = format!("Show {} in the overlay", self.name);
        self.hidden && mark(ui, rect, Icon::Hidden, &name, true)
    }
}

/// A small button that is there for the keyboard even while it is not seen; returns whether it was clicked.
pub(super) fn mark(ui: &Ui, rect: Rect, icon: Icon, name: &str, seen: bool) -> bool {
    let response = ui.interact(rect, ui.scope_id().with(name), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
    if seen || response.has_focus() {
        let color = ui.style().interact(&response).text_color();
        icon.paint(ui.painter(), rect, color);
    }
    if response.has_focus() {
        focus_ring(ui, rect.shrink2(vec2(0.0, 4.0)));
    }
    response.on_hover_text(name).clicked()
}

/// The class that is being dragged.
struct Dragged(ClassId);

/// Moves lines by dragging them, and the line that has the focus with Alt and the arrow keys. `index` is that of the
/// line's class among `count`.
pub(super) fn reorder(
    ui: &Ui,
    row: &egui::Response,
    id: ClassId,
    index: usize,
    count: usize,
    commands: &mut Commands,
) {
    row.dnd_set_drag_payload(Dragged(id));
    if row.dragged() {
        ui.painter()
            .rect_filled(row.rect, 4, theme::of(ui.visuals()).line.gamma_multiply(0.5));
    }
    if let Some(position) = ui.ctx().pointer_interact_pos()
        && let Some(dragged) = row.dnd_hover_payload::<Dragged>()
    {
        let below = position.y > row.rect.center().y;
        let y = if below {
            row.rect.bottom() + 1.0
        } else {
            row.rect.top() - 1.0
        };
        let line = Stroke::new(2.0, theme::of(ui.visuals()).accent);
        ui.painter().hline(row.rect.x_range(), y, line);
        if dragged.0 != id && row.dnd_release_payload::<Dragged>().is_some() {
            commands.push(Command::MoveClassBeside {
                class: dragged.0,
                neighbour: id,
                below,
            });
        }
    }
    if row.has_focus() {
        let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::ALT, key));
        let [up, down] = [Key::ArrowUp, Key::ArrowDown].map(pressed);
        if up && index > 0 {
            commands.push(Command::MoveClass(id, index - 1));
        } else if down && index + 1 < count {
            commands.push(Command::MoveClass(id, index + 1));
        }
    }
}
