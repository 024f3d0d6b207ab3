//! A line of the class list, and moving it.

use egui::{Key, Modifiers, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use inplace_core::labels::{ClassId, VOID};
use inplace_model::class_view::Named;
use inplace_model::{Command, Commands};

use crate::theme;
use crate::widgets::{Icon, focus_ring, key_cap, line_of_text, swatch};

/// Height of a line, in points.
pub(super) const ROW: f32 = 32.0;

/// How far the line of an object is set in, in points.
pub(super) const INSET: f32 = 16.0;

/// Where the middle of the colour is, from the left end of the line.
pub(super) const SWATCH_MIDDLE: f32 = 30.0;

/// Width of the padlock and of the eye.
const MARK: f32 = 20.0;

/// What the line of a class or an object shows.
pub(super) struct Row<'a> {
    pub named: Named,
    pub name: &'a str,
    pub color: [u8; 3],
    /// What screen readers say after the name.
    pub facts: String,
    /// What stands at the right end; none leaves its room to the name.
    pub number: Option<String>,
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

/// In what the lines of classes and of objects look different, in points.
struct Look {
    /// How far the line is set in.
    inset: f32,
    /// The side of the colour.
    swatch: f32,
    /// Where the name begins, from the middle of the colour.
    name: f32,
    font: f32,
    /// The height of the padlock and of the eye.
    mark: f32,
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
    fn look(&self, ui: &Ui) -> Look {
        match self.named {
            Named::Class(_) => Look {
                inset: 0.0,
                swatch: 16.0,
                name: 18.0,
                font: 14.0,
                mark: ROW,
            },
            Named::Object(_) => Look {
                inset: INSET,
                swatch: 12.0,
                name: 12.0,
                font: 13.0,
                mark: ui.spacing().interact_size.y,
            },
        }
    }

    /// Draws the line; a click chooses the class or the object.
    pub(super) fn show(&self, ui: &mut Ui, commands: &mut Commands) -> (egui::Response, Parts) {
        let size = vec2(ui.available_width(), ROW);
        let (_, rect) = ui.allocate_space(size);
        // By class and not by place, so that a line that moves keeps the keyboard.
        let response = ui.interact(rect, ui.scope_id().with("line"), Sense::click_and_drag());
        let locked = if self.locked { ", locked" } else { "" };
        let hidden = if self.hidden { ", hidden" } else { "" };
        let said = self
            .said
            .map(|said| format!(", saying {said}"))
            .unwrap_or_default();
        let words = format!("{}, {}{locked}{hidden}{said}", self.name, self.facts);
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, self.chosen, &words));
        if response.gained_focus() {
            response.scroll_to_me(None);
        }
        if response.clicked() {
            commands.push(Command::Choose(self.named));
        }
        let parts = self.parts(ui, rect);
        let cut = self.paint(ui, rect, &response, &parts);
        // That of an object has more to say.
        let response = if cut && matches!(self.named, Named::Class(_)) {
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
        let Look { inset, mark, .. } = self.look(ui);
        let mut part = |width: f32| {
            end -= width;
            Rect::from_min_size(pos2(end, middle - 0.5 * mark), vec2(width, mark))
        };
        let swatch = pos2(rect.left() + SWATCH_MIDDLE + inset, middle);
        Parts {
            swatch: Rect::from_center_size(swatch, vec2(24.0, 24.0)),
            fold: rect
                .with_min_x(rect.left() + 3.0)
                .with_max_x(rect.left() + SWATCH_MIDDLE - 11.0),
            menu,
            digit: part(if self.slot.is_some() { 20.0 } else { 0.0 }),
            lock: part(if self.named == Named::Class(VOID) {
                0.0
            } else {
                MARK
            }),
            eye: part(if self.hidden { MARK } else { 0.0 }),
        }
    }

    /// Paints the line; returns whether the name is cut.
    fn paint(&self, ui: &Ui, rect: Rect, response: &egui::Response, parts: &Parts) -> bool {
        let visuals = ui.visuals();
        let look = self.look(ui);
        let line = rect.with_min_x(rect.left() + look.inset);
        if self.chosen {
            ui.painter()
                .rect_filled(line, 4, visuals.widgets.inactive.bg_fill);
            let mark = Rect::from_min_size(line.min, vec2(3.0, line.height()));
            ui.painter().rect_filled(mark, 2, theme::of(visuals).accent);
        } else if response.contains_pointer() {
            ui.painter().rect_filled(line, 4, theme::of(visuals).raised);
        }
        if response.has_focus() {
            focus_ring(ui, line);
        }
        let middle = parts.swatch.center();
        swatch(ui.painter(), middle, self.color, look.swatch);
        if let Some(slot) = self.slot {
            key_cap(ui, parts.digit.center(), &slot.to_string());
        }
        let mut end = parts.eye.left();
        if let Some(number) = &self.number {
            let font = egui::FontId::proportional(12.0);
            let color = visuals.weak_text_color();
            let at = pos2(end - 4.0, rect.center().y);
            end = ui
                .painter()
                .text(at, egui::Align2::RIGHT_CENTER, number, font, color)
                .left();
        }
        let name = Rect::from_min_max(
            pos2(middle.x + look.name, rect.top()),
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
            Some(said) => line_of_text(ui, name, &format!("{}: {said}", self.name), look.font, color),
            None => line_of_text(ui, name, self.name, look.font, color),
        }
    }

    /// The arrow that lists its objects, the padlock, and the eye of what is hidden.
    pub(super) fn buttons(&self, ui: &Ui, row: &egui::Response, parts: &Parts, commands: &mut Commands) {
        if let (Named::Class(class), Some(unfolded)) = (self.named, self.unfolded) {
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
                commands.push(Command::UnfoldClass(class, !unfolded));
            }
        }
        // Seen on the line that is pointed at and where it is locked.
        let near = self.locked || row.contains_pointer() || row.has_focus();
        let icon = if self.locked { Icon::Locked } else { Icon::Unlocked };
        let name = format!("{} {}", lock_words(self.locked), self.name);
        if mark(ui, parts.lock, icon, &name, near) {
            commands.push(Command::SetLocked(self.named, !self.locked));
        }
        let name = format!("Show {} in the overlay", self.name);
        if self.hidden && mark(ui, parts.eye, Icon::Hidden, &name, true) {
            commands.push(Command::SetHidden(self.named, false));
        }
    }
}

/// What locks a class or an object, or unlocks it.
pub(super) fn lock_words(locked: bool) -> &'static str {
    if locked { "Unlock" } else { "Lock" }
}

/// A small button that is there for the keyboard even while it is not seen; returns whether it was clicked.
fn mark(ui: &Ui, rect: Rect, icon: Icon, name: &str, seen: bool) -> bool {
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

/// The class that is being dragged, and its place in the list.
struct Dragged {
    class: ClassId,
    index: usize,
}

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
    row.dnd_set_drag_payload(Dragged { class: id, index });
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
        if dragged.class != id && row.dnd_release_payload::<Dragged>().is_some() {
            let place = index + usize::from(below) - usize::from(dragged.index < index);
            commands.push(Command::MoveClass(dragged.class, place));
        }
    }
    if row.has_focus() {
        let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::ALT, key));
        let [up, down] = [Key::ArrowUp, Key::ArrowDown].map(pressed);
        // In sight it keeps the keyboard.
        let mut move_to = |place: usize, down: f32| {
            commands.push(Command::MoveClass(id, place));
            ui.scroll_to_rect(row.rect.translate(vec2(0.0, down * ROW)), None);
        };
        if up && index > 0 {
            move_to(index - 1, -1.0);
        } else if down && index + 1 < count {
            move_to(index + 1, 1.0);
        }
    }
}
