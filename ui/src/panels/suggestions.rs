//! Where to label next: the ranked places, the one at hand larger than the others.

use egui::{Button, Color32, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use inplace_core::guide::{Likely, Suggestion};
use inplace_core::labels::{ClassId, VOID};

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Look, marker, region};
use crate::dialogs::ClassUse;
use crate::english::{guidance as words, layers};
use crate::keymap::KeyMap;
use crate::keys;
use crate::surroundings::surroundings;
use crate::theme;
use crate::thumbnails::{Source, Thumbnails};
use crate::widgets::{empty_state, focus_ring, heading, key_cap_of, line_of_text, swatch};
use crate::workspace::Workspace;

/// Size of the picture of a place that is not at hand.
const SMALL: egui::Vec2 = vec2(96.0, 72.0);
/// Largest height of the picture of the place at hand.
const TALLEST: f32 = 220.0;
/// How much the present labels cover in a region.
const FAINT: f32 = 0.3;

/// The ranked list of places with their pictures.
pub struct SuggestionPanel {
    thumbnails: Thumbnails,
    /// The place at hand when the list was drawn last, to scroll to another one.
    at: Option<(usize, u64)>,
    held: bool,
}

impl SuggestionPanel {
    /// A list with these thumbnails.
    pub fn new(thumbnails: Thumbnails) -> Self {
        Self {
            thumbnails,
            at: None,
            held: false,
        }
    }

    /// Draws the list.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
        self.thumbnails.collect(workspace.serial());
        let hovered = ui.rect_contains_pointer(ui.max_rect());
        if hovered != self.held {
            self.held = hovered;
            actions.push(Action::HoldSuggestions(hovered));
        }
        let count = workspace.suggestions().len();
        heading(ui, &words::listed(count), |ui| {
            let next = keys::named(ui.ctx(), words::NEXT);
            let button = ui.add_enabled(count > 0, Button::new(next));
            let back = keys::text(&KeyMap::of(ui.ctx()), "Shift+N");
            if button.on_hover_text(words::next_hint(&back)).clicked() {
                actions.push(Action::NextSuggestion);
            }
        });
        footer(ui, workspace, actions);
        if workspace.suggestions().is_empty() {
            empty_state(ui, words::why_empty(workspace));
            return;
        }
        let guidance = workspace.guidance();
        let at = guidance.at().map(|index| (index, guidance.version()));
        let moved = self.at != at;
        self.at = at;
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for (index, suggestion) in workspace.suggestions().iter().enumerate() {
                let current = guidance.at() == Some(index);
                let card = ui.push_id(index, |ui| {
                    if current {
                        self.large_card(ui, workspace, index, suggestion, actions);
                    } else {
                        self.small_card(ui, workspace, index, suggestion, actions);
                    }
                });
                if current && moved {
                    card.response.scroll_to_me(None);
                }
            }
        });
    }

    /// The place at hand, with the keys that answer it.
    fn large_card(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        suggestion: &Suggestion,
        actions: &mut Actions,
    ) {
        let Some(frame) = workspace.scene().frames.get(suggestion.frame) else {
            return;
        };
        let accent = Stroke::new(1.5, theme::accent(ui.visuals()));
        super::card(ui).stroke(accent).show(ui, |ui| {
            let width = ui.available_width();
            ui.set_width(width);
            let aspect = frame.camera.height as f32 / frame.camera.width.max(1) as f32;
            let size = vec2(width, (width * aspect).min(TALLEST));
            self.picture(ui, workspace, index, suggestion, size, actions);
            ui.spacing_mut().item_spacing.y = 6.0;
            title(ui, workspace, index, suggestion, &frame.stem);
            for (rank, likely) in suggestion.classes.iter().take(2).enumerate() {
                let key = if rank == 0 {
                    "Enter".to_owned()
                } else {
                    digit_of(workspace, likely.class).unwrap_or_else(|| "Shift+Enter".to_owned())
                };
                let action = || Action::AnswerSuggestion(index, likely.class);
                class_button(ui, workspace, None, *likely, Some(&key), width, actions, action);
            }
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 6.0;
                for (text, action) in [
                    (words::BY_NAME, Action::FindClass(ClassUse::Answer)),
                    (words::SKIP, Action::SkipSuggestion),
                ] {
                    if ui.button(text).clicked() {
                        actions.push(action);
                    }
                }
            });
        });
    }

    fn small_card(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        suggestion: &Suggestion,
        actions: &mut Actions,
    ) {
        let Some(frame) = workspace.scene().frames.get(suggestion.frame) else {
            return;
        };
        super::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal_top(|ui| {
                self.picture(ui, workspace, index, suggestion, SMALL, actions);
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 4.0;
                    title(ui, workspace, index, suggestion, &frame.stem);
                    if let Some(class) = workspace.guidance().answer_of(index) {
                        let (name, _) = workspace.document().name_and_color(class);
                        ui.add(egui::Label::new(words::labelled(name)).truncate());
                    }
                });
            });
            if workspace.guidance().answer_of(index).is_some() || suggestion.classes.is_empty() {
                return;
            }
            let width = 0.5 * (ui.available_width() - 4.0);
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                for likely in suggestion.classes.iter().take(2) {
                    let action = || Action::AnswerSuggestion(index, likely.class);
                    class_button(ui, workspace, Some(index), *likely, None, width, actions, action);
                }
            });
        });
    }

    fn picture(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        suggestion: &Suggestion,
        size: egui::Vec2,
        actions: &mut Actions,
    ) {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let name = words::go_there(index);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        if response.clicked() {
            actions.push(Action::GoToSuggestion(index));
        }
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        response.on_hover_text(name);
        let Some(frame) = workspace.scene().frames.get(suggestion.frame) else {
            return;
        };
        if !ui.is_rect_visible(rect) {
            return;
        }
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4, theme::canvas(ui.visuals()));
        let version = workspace.guidance().version();
        let look = Look {
            layer: Layer::Labels,
            opacity: FAINT,
            outlines: false,
        };
        let thumbnail = self.thumbnails.get_place(suggestion, version, || {
            Source::of_frame(workspace, suggestion.frame, look)
        });
        let Some(thumbnail) = thumbnail else {
            return;
        };
        let full = vec2(frame.camera.width as f32, frame.camera.height as f32);
        let part = surroundings(full, suggestion.pixel, &suggestion.outline);
        let shown = part.size() * (rect.size() / part.size()).min_elem();
        let fitted = Rect::from_center_size(rect.center(), shown);
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(thumbnail.texture.id(), fitted, whole, Color32::WHITE);
        let to_screen = |x: f32, y: f32| fitted.min + (pos2(x, y) - part.min) / part.size() * fitted.size();
        let painter = ui.painter_at(fitted);
        let outline = suggestion.outline.iter().map(|&[x, y]| to_screen(x, y));
        region(&painter, outline.collect(), 1.0);
        let [x, y] = suggestion.pixel;
        let current = workspace.at_suggestion() == Some(index);
        let place = to_screen(x as f32 + 0.5, y as f32 + 0.5);
        marker(&painter, place, index, current, true);
    }
}

/// Which frame, and what a label would settle.
fn title(ui: &mut Ui, workspace: &Workspace, index: usize, suggestion: &Suggestion, stem: &str) {
    let name = RichText::new(format!("{}.  {stem}", index + 1)).strong();
    ui.add(egui::Label::new(name).truncate());
    let settled = workspace.at_suggestion() == Some(index) && workspace.guidance().is_settled();
    let text = if settled {
        words::SETTLED.to_owned()
    } else {
        words::settles(suggestion.share)
    };
    let label = egui::Label::new(RichText::new(text).weak()).wrap();
    ui.add(label).on_hover_text(words::SETTLES_HINT);
}

/// The digit that chooses a class, where it has one.
pub(super) fn digit_of(workspace: &Workspace, id: ClassId) -> Option<String> {
    if id == VOID {
        return Some("0".to_owned());
    }
    let mut classes = workspace.document().classes().iter().take(9);
    let index = classes.position(|class| class.id == id)?;
    Some((index + 1).to_string())
}

/// What was answered last, and how many places are left out: below the list, where it moves nothing.
fn footer(ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
    let guidance = workspace.guidance();
    let answer = guidance.last_answer().filter(|_| guidance.is_active());
    if answer.is_none() && guidance.skipped() == 0 {
        return;
    }
    egui::Panel::bottom("suggestions-footer")
        .frame(egui::Frame::new().inner_margin(egui::Margin {
            top: 8,
            ..Default::default()
        }))
        .resizable(false)
        .show_separator_line(false)
        .show(ui, |ui| {
            if let Some((_, class)) = answer {
                let (name, color) = workspace.document().name_and_color(class);
                row(
                    ui,
                    Some(color),
                    &words::last_answer(name),
                    &keys::named(ui.ctx(), words::TAKE_BACK),
                    || {
                        actions.push(Action::Undo);
                    },
                );
            }
            if guidance.skipped() > 0 {
                let text = words::skipped(guidance.skipped());
                row(ui, None, &text, words::LIST_SKIPPED, || {
                    actions.push(Action::ListSkipped);
                });
            }
        });
}

/// A text with a button at the end of its line.
fn row(ui: &mut Ui, color: Option<[u8; 3]>, text: &str, button: &str, mut clicked: impl FnMut()) {
    ui.horizontal(|ui| {
        if let Some(color) = color {
            let (rect, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
            swatch(ui.painter(), rect.center(), color, 12.0);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.small_button(button).clicked() {
                clicked();
            }
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                ui.add(egui::Label::new(RichText::new(text).weak()).truncate());
            });
        });
    });
}

/// A button that gives a place a class: its colour, its name, how likely it is, and the key that does it.
#[expect(clippy::too_many_arguments, reason = "all of it is what the button says")]
fn class_button(
    ui: &mut Ui,
    workspace: &Workspace,
    index: Option<usize>,
    likely: Likely,
    key: Option<&str>,
    width: f32,
    actions: &mut Actions,
    action: impl FnOnce() -> Action,
) {
    if workspace.document().labels().class(likely.class).is_none() {
        return;
    }
    let (name, color) = workspace.document().name_and_color(likely.class);
    let size = vec2(width, ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let accessible = words::label_as(index, name);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &accessible));
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact(&response);
        let (fill, line, text) = (visuals.weak_bg_fill, visuals.bg_stroke, visuals.text_color());
        ui.painter()
            .rect(rect, visuals.corner_radius, fill, line, egui::StrokeKind::Inside);
        swatch(ui.painter(), rect.left_center() + vec2(14.0, 0.0), color, 12.0);
        let mut right = rect.right() - 8.0;
        if let Some(key) = key {
            right -= key_cap_of(ui, pos2(right, rect.center().y), key) + 8.0;
        }
        let weak = ui.visuals().weak_text_color();
        let font = egui::FontId::proportional(12.0);
        let percent = ui
            .painter()
            .layout_no_wrap(layers::percent(likely.probability), font, weak);
        right -= percent.size().x;
        let top = rect.center().y - 0.5 * percent.size().y;
        ui.painter().galley(pos2(right, top), percent, weak);
        let left = rect.left() + 26.0;
        let room = Rect::from_x_y_ranges(left..=(right - 6.0).max(left), rect.y_range());
        line_of_text(ui, room, name, 14.0, text);
    }
    if response.has_focus() {
        focus_ring(ui, rect);
    }
    let hint = words::label_as_hint(name, likely.probability, key);
    if response.on_hover_text(hint).clicked() {
        actions.push(action());
    }
}
