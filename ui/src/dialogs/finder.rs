//! The class finder: part of a name is enough.

use egui::{Key, Modifiers, Pos2, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use inplace_core::labels::{Class, VOID};

use super::text_field;
use crate::action::{Action, Actions};
use crate::canvas::VOID_COLOR;
use crate::english::classes as english;
use crate::theme;
use crate::widgets::{Icon, key_cap, line_of_text, swatch};

const WIDTH: f32 = 288.0;
const LINE: f32 = 28.0;
/// Lines that are shown without scrolling.
const LINES: usize = 9;

/// What happens with the class that was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassUse {
    /// It becomes the class to label with.
    Choose,
    /// It answers the suggestion at hand.
    Answer,
}

/// A popup that finds a class by part of its name, or makes one.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassFinder {
    purpose: ClassUse,
    /// The project's classes and void.
    classes: Vec<Class>,
    /// Where it stands on the screen, in points.
    at: Pos2,
    text: String,
    /// The line that Enter takes.
    line: usize,
}

/// A line of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Found {
    /// A class, by its place in the list.
    Class(usize),
    /// A new class of the name typed.
    New,
}

impl ClassFinder {
    /// A finder among a project's classes, at a point of the screen.
    pub fn new(purpose: ClassUse, mut classes: Vec<Class>, at: Pos2) -> Self {
        classes.push(Class {
            id: VOID,
            name: english::VOID_NAME.to_owned(),
            color: VOID_COLOR,
        });
        Self {
            purpose,
            classes,
            at,
            text: String::new(),
            line: 0,
        }
    }

    /// Draws the popup; pushes what was chosen.
    pub(super) fn show(&mut self, ctx: &egui::Context, actions: &mut Actions) {
        let id = egui::Id::unique("class finder");
        let area = egui::Modal::default_area(id)
            .anchor(egui::Align2::LEFT_TOP, self.corner(ctx.content_rect()).to_vec2());
        let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(8);
        let modal = egui::Modal::new(id).area(area).frame(frame);
        let modal = modal.backdrop_color(egui::Color32::from_black_alpha(40));
        let modal = modal.show(ctx, |ui| {
            ui.set_width(WIDTH);
            self.contents(ui, actions);
        });
        if modal.should_close() {
            actions.push(Action::Show(None));
        }
    }

    /// The left upper corner, so that all of the popup is inside the window.
    fn corner(&self, window: Rect) -> Pos2 {
        let size = vec2(WIDTH + 24.0, (LINES as f32 + 1.0) * LINE + 64.0);
        let last = (window.max - size).max(window.min);
        self.at.clamp(window.min, last)
    }

    fn contents(&mut self, ui: &mut Ui, actions: &mut Actions) {
        let (down, up, enter) = ui.input_mut(|input| {
            let mut pressed = |key| input.consume_key(Modifiers::NONE, key);
            (
                pressed(Key::ArrowDown),
                pressed(Key::ArrowUp),
                pressed(Key::Enter),
            )
        });
        let before = self.text.clone();
        text_field(ui, &mut self.text, english::FINDER, english::FINDER_HINT);
        let typed = self.text != before;
        if typed {
            self.line = 0;
        }
        let found = self.found();
        let last = found.len().saturating_sub(1);
        self.line = match (down, up) {
            (true, false) => (self.line + 1).min(last),
            (false, true) => self.line.saturating_sub(1),
            _ => self.line.min(last),
        };
        let clicked = self.lines(ui, &found, typed || down || up);
        ui.add_space(theme::GAP);
        ui.add(egui::Label::new(egui::RichText::new(english::FINDER_KEYS).weak().small()).selectable(false));
        let chosen = clicked.or(enter.then_some(self.line));
        if let Some(found) = chosen.and_then(|line| found.get(line)) {
            actions.push(match found {
                Found::Class(index) => Action::UseClass(self.purpose, self.classes[*index].id),
                Found::New => Action::UseNewClass(self.purpose, self.text.trim().to_owned()),
            });
        }
    }

    /// The lines; returns the one that was clicked on.
    fn lines(&self, ui: &mut Ui, found: &[Found], moved: bool) -> Option<usize> {
        let mut clicked = None;
        ui.spacing_mut().item_spacing.y = 0.0;
        ScrollArea::vertical()
            .auto_shrink([false, true])
            .max_height(LINES as f32 * LINE)
            .show_viewport(ui, |ui, viewport| {
                let corner = ui.max_rect().min;
                let width = ui.available_width();
                ui.set_height(found.len() as f32 * LINE);
                let at = |line: usize| {
                    Rect::from_min_size(pos2(corner.x, corner.y + line as f32 * LINE), vec2(width, LINE))
                };
                let first = (viewport.min.y / LINE).floor().max(0.0) as usize;
                let end = ((viewport.max.y / LINE).ceil() as usize).min(found.len());
                for (line, item) in found.iter().enumerate().take(end).skip(first) {
                    if self.draw_line(ui, at(line), line, item) {
                        clicked = Some(line);
                    }
                }
                if moved {
                    ui.scroll_to_rect(at(self.line), None);
                }
            });
        clicked
    }

    fn draw_line(&self, ui: &Ui, rect: Rect, line: usize, found: &Found) -> bool {
        let (name, new_name);
        let words = match found {
            Found::Class(index) => {
                name = &self.classes[*index].name;
                name
            }
            Found::New => {
                new_name = english::make(self.text.trim());
                &new_name
            }
        };
        let chosen = line == self.line;
        let response = ui.interact(rect, ui.scope_id().with(line), Sense::CLICK);
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, chosen, words));
        let visuals = ui.visuals();
        if chosen {
            ui.painter().rect_filled(rect, 4, theme::accent(visuals));
        } else if response.hovered() {
            ui.painter().rect_filled(rect, 4, visuals.widgets.hovered.bg_fill);
        }
        let color = if chosen {
            theme::on_accent(visuals)
        } else {
            visuals.text_color()
        };
        let left = pos2(rect.left() + 16.0, rect.center().y);
        let mut end = rect.right() - 8.0;
        match found {
            Found::Class(index) => {
                swatch(ui.painter(), left, self.classes[*index].color, 16.0);
                if let Some(digit) = self.digit(*index) {
                    end -= 24.0;
                    let center = pos2(end + 12.0, rect.center().y);
                    if chosen {
                        let font = egui::FontId::monospace(11.0);
                        let middle = egui::Align2::CENTER_CENTER;
                        ui.painter().text(center, middle, digit, font, color);
                    } else {
                        key_cap(ui, center, &digit.to_string());
                    }
                }
            }
            Found::New => Icon::Add.paint(
                ui.painter(),
                Rect::from_center_size(left, vec2(16.0, 16.0)),
                color,
            ),
        }
        let place = Rect::from_min_max(pos2(rect.left() + 32.0, rect.top()), pos2(end, rect.bottom()));
        let cut = line_of_text(ui, place, words, 14.0, color);
        let response = if cut {
            response.on_hover_text(words)
        } else {
            response
        };
        response.clicked()
    }

    /// The digit that chooses a class without the finder.
    fn digit(&self, index: usize) -> Option<usize> {
        match self.classes[index].id {
            VOID => Some(0),
            _ => (index < 9).then_some(index + 1),
        }
    }

    /// Names that begin with the text, then those with a word that does, then those that hold it; a new class at the
    /// end unless one is named so.
    fn found(&self) -> Vec<Found> {
        let text = self.text.trim().to_lowercase();
        let mut ranked: Vec<(u8, usize)> = self
            .classes
            .iter()
            .enumerate()
            .filter_map(|(index, class)| Some((rank(&class.name.to_lowercase(), &text)?, index)))
            .collect();
        ranked.sort_unstable();
        let mut found: Vec<Found> = ranked.into_iter().map(|(_, index)| Found::Class(index)).collect();
        if !text.is_empty() && !self.classes.iter().any(|class| class.is_named(&text)) {
            found.push(Found::New);
        }
        found
    }
}

/// How well a name fits a text, both in small letters; less is better.
fn rank(name: &str, text: &str) -> Option<u8> {
    let mut words = name.split([' ', '-', '_']);
    if name.starts_with(text) {
        Some(0)
    } else if words.any(|word| word.starts_with(text)) {
        Some(1)
    } else {
        name.contains(text).then_some(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(finder: &ClassFinder) -> Vec<&str> {
        let name = |found| match found {
            Found::Class(index) => finder.classes[index].name.as_str(),
            Found::New => "+",
        };
        finder.found().into_iter().map(name).collect()
    }

    #[test]
    fn names_that_begin_with_the_text_come_first_and_a_new_class_last() {
        let classes = ["coffee table", "table", "vegetable", "wall-table"];
        let classes = classes
            .iter()
            .zip(1..)
            .map(|(name, id)| Class::new(id, *name))
            .collect();
        let mut finder = ClassFinder::new(ClassUse::Choose, classes, Pos2::ZERO);
        assert_eq!(names(&finder).len(), 5);
        finder.text = "tab".to_owned();
        assert_eq!(
            names(&finder),
            ["table", "coffee table", "wall-table", "vegetable", "+"]
        );
        finder.text = " TABLE ".to_owned();
        assert_eq!(
            names(&finder),
            ["table", "coffee table", "wall-table", "vegetable"]
        );
        finder.text = "x".to_owned();
        assert_eq!(names(&finder), ["+"]);
        finder.text = "0".to_owned();
        assert_eq!(names(&finder), ["+"]);
    }

    #[test]
    fn the_popup_stays_inside_the_window() {
        let window = Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 720.0));
        for at in [pos2(0.0, 0.0), pos2(1279.0, 719.0), pos2(600.0, 300.0)] {
            let finder = ClassFinder::new(ClassUse::Choose, Vec::new(), at);
            let corner = finder.corner(window);
            assert!(window.contains(corner) && corner.x <= 1280.0 - WIDTH && corner.y < 400.0);
        }
    }
}
