//! Where to label next: the ranked places, the one at hand larger than the others.

use egui::{Button, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use inplace_core::guide::{Likely, Suggestion};
use inplace_core::scene::Frame;
use inplace_model::layer::{Layer, Look};
use inplace_model::text::counted;
use inplace_model::view::ImagePart;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::parts::{answer_key, card, object_near};
use crate::canvas::{marker, rect_of, region};
use crate::keys::table::{ANSWER_BY_NAME, ANSWER_NEW, NEXT_SUGGESTION, PREVIOUS_SUGGESTION, SKIP, UNDO};
use crate::numbers;
use crate::theme;
use crate::thumbnails::{self, Thumbnails};
use crate::widgets::{focus_ring, heading, key_cap_of, line_of_text, swatch, weak_text};

/// Size of the picture of a place that is not at hand.
const SMALL: egui::Vec2 = vec2(96.0, 72.0);
/// Largest height of the picture of the place at hand.
const TALLEST: f32 = 220.0;
/// How much the present labels cover in a region.
const FAINT: f32 = 0.3;

/// The ranked list of places with their pictures.
pub struct SuggestionPanel {
    /// Of the place at hand, and of the others: large pictures of all would cost as much as the maps do.
    large: Thumbnails,
    small: Thumbnails,
    /// The place at hand when the list was drawn last, to scroll to another one.
    at: Option<(usize, u64)>,
}

/// A place of the list, with its frame.
struct Place<'a> {
    workspace: &'a Workspace,
    index: usize,
    suggestion: &'a Suggestion,
    frame: &'a Frame,
}

impl SuggestionPanel {
    /// A list in this window.
    pub fn new(ctx: &egui::Context) -> Self {
        Self {
            large: Thumbnails::new(ctx.clone(), [480.0, 360.0]),
            small: Thumbnails::new(ctx.clone(), (2.0 * SMALL).into()),
            at: None,
        }
    }

    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        self.large.collect();
        self.small.collect();
        let hovered = ui.rect_contains_pointer(ui.max_rect());
        if hovered != workspace.suggestions().held {
            commands.push(Command::HoldSuggestions(hovered));
        }
        let count = workspace.suggestions().listed.len();
        let listed = match count {
            0 => "No suggestions".to_owned(),
            some => counted(some, "suggestion", "suggestions"),
        };
        heading(ui, &listed, |ui| {
            let next = NEXT_SUGGESTION.named(ui.ctx());
            let button = ui.add_enabled(count > 0, Button::new(next));
            let mut hint = "Goes to the next suggestion; the keys then answer it".to_owned();
            match PREVIOUS_SUGGESTION.key(ui.ctx()).as_str() {
                "" => {}
                back => hint += &format!(". {back} goes back"),
            }
            if button.on_hover_text(hint).clicked() {
                commands.push(Command::NextSuggestion);
            }
        });
        footer(ui, workspace, commands);
        if workspace.suggestions().listed.is_empty() {
            weak_text(ui, workspace.why_no_suggestion());
            return;
        }
        let suggestions = workspace.suggestions();
        let at = suggestions.at().map(|index| (index, suggestions.version));
        let moved = self.at != at;
        self.at = at;
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for (index, suggestion) in workspace.suggestions().listed.iter().enumerate() {
                let Some(frame) = workspace.scene.frames.get(suggestion.frame) else {
                    continue;
                };
                let place = Place {
                    workspace,
                    index,
                    suggestion,
                    frame,
                };
                let current = suggestions.at() == Some(index);
                let card = ui.push_id(index, |ui| {
                    if current {
                        self.large_card(ui, &place, commands);
                    } else {
                        self.small_card(ui, &place, commands);
                    }
                });
                if current && moved {
                    card.response.scroll_to_me(None);
                }
            }
        });
    }

    /// The place at hand, with the keys that answer it.
    fn large_card(&mut self, ui: &mut Ui, place: &Place<'_>, commands: &mut Commands) {
        let accent = Stroke::new(1.5, theme::of(ui.visuals()).accent);
        card(ui).stroke(accent).show(ui, |ui| {
            let width = ui.available_width();
            ui.set_width(width);
            let aspect = place.frame.camera.height as f32 / place.frame.camera.width.max(1) as f32;
            let size = vec2(width, (width * aspect).min(TALLEST));
            self.picture(ui, place, size, commands);
            ui.spacing_mut().item_spacing.y = 6.0;
            title(ui, place);
            for (rank, likely) in place.suggestion.classes.iter().take(2).enumerate() {
                let label = place.workspace.likely_label(likely);
                let key = answer_key(place.workspace, rank, label);
                if class_button(ui, place.workspace, None, *likely, Some(&key), width) {
                    commands.push(Command::AnswerSuggestion(place.index, label));
                }
            }
            let labels = place.workspace.document.labels();
            let likeliest = place.suggestion.classes.first();
            let likeliest = likeliest.and_then(|likely| labels.class(likely.class));
            let new = likeliest.filter(|class| class.thing).map(|_| &ANSWER_NEW);
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 6.0;
                for command in new.into_iter().chain([&ANSWER_BY_NAME, &SKIP]) {
                    // Nobody can move these keys.
                    let name = format!("{} ({})", command.name, command.keys[0]);
                    if ui.button(name).clicked() {
                        commands.push(command.command.clone());
                    }
                }
            });
        });
    }

    fn small_card(&mut self, ui: &mut Ui, place: &Place<'_>, commands: &mut Commands) {
        card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal_top(|ui| {
                self.picture(ui, place, SMALL, commands);
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 4.0;
                    title(ui, place);
                    if let Some(class) = place.workspace.suggestions().answer_of(place.index) {
                        let (name, _) = place.workspace.document.name_and_color(class);
                        ui.add(egui::Label::new(format!("Labelled {name}")).truncate());
                    }
                });
            });
            if place.workspace.suggestions().answer_of(place.index).is_some()
                || place.suggestion.classes.is_empty()
            {
                return;
            }
            let width = 0.5 * (ui.available_width() - 4.0);
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                for likely in place.suggestion.classes.iter().take(2) {
                    if class_button(ui, place.workspace, Some(place.index), *likely, None, width) {
                        let label = place.workspace.likely_label(likely);
                        commands.push(Command::AnswerSuggestion(place.index, label));
                    }
                }
            });
        });
    }

    fn picture(&mut self, ui: &mut Ui, place: &Place<'_>, size: egui::Vec2, commands: &mut Commands) {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let name = format!("Go to suggestion {}", place.index + 1);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        if response.clicked() {
            commands.push(Command::GoToSuggestion(place.index));
        }
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        response.on_hover_text(name);
        if !ui.is_rect_visible(rect) {
            return;
        }
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4, theme::of(ui.visuals()).canvas);
        let look = Look {
            layer: Layer::Labels,
            opacity: FAINT,
            outlines: false,
        };
        let large = (size != SMALL).then_some(&mut self.large);
        let large = large.and_then(|large| large.suggestion(place.workspace, place.suggestion, look));
        // The small one stands in for the large one until that is ready.
        let small = || self.small.suggestion(place.workspace, place.suggestion, look);
        let Some(thumbnail) = large.or_else(small) else {
            return;
        };
        let full = glam::vec2(place.frame.camera.width as f32, place.frame.camera.height as f32);
        let part = ImagePart::around(full, place.suggestion.pixel, &place.suggestion.outline);
        let part = rect_of(part);
        let fitted = thumbnails::paint(&thumbnail, &painter, rect);
        let to_screen = |x: f32, y: f32| fitted.min + (pos2(x, y) - part.min) / part.size() * fitted.size();
        let painter = ui.painter_at(fitted);
        let outline = place.suggestion.outline.iter().map(|&[x, y]| to_screen(x, y));
        region(&painter, outline.collect(), 1.0);
        let [x, y] = place.suggestion.pixel;
        let current = place.workspace.suggestions().at() == Some(place.index);
        let center = to_screen(x as f32 + 0.5, y as f32 + 0.5);
        marker(&painter, center, place.index, current, true);
    }
}

/// Which frame, and what a label would settle.
fn title(ui: &mut Ui, place: &Place<'_>) {
    let name = RichText::new(format!("{}.  {}", place.index + 1, place.frame.stem)).strong();
    ui.add(egui::Label::new(name).truncate());
    let suggestions = place.workspace.suggestions();
    let settled = suggestions.at() == Some(place.index) && suggestions.settled;
    let text = if settled {
        "settled meanwhile".to_owned()
    } else {
        settles(place.suggestion.share)
    };
    weak_text(ui, &text).on_hover_text("The share of all pixels that a label there would settle");
}

/// What was answered last, and how many places are left out: below the list, where it moves nothing.
fn footer(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let suggestions = workspace.suggestions();
    let answer = suggestions.last_answer().filter(|_| suggestions.is_active());
    if answer.is_none() && suggestions.skipped() == 0 {
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
            if let Some(class) = answer {
                let (name, color) = workspace.document.name_and_color(class);
                let text = format!("Last answer: {name}");
                row(ui, Some(color), &text, &UNDO.named(ui.ctx()), || {
                    commands.push(Command::Undo);
                });
            }
            if suggestions.skipped() > 0 {
                let text = format!("{} skipped", suggestions.skipped());
                row(ui, None, &text, "List them again", || {
                    commands.push(Command::ListSkipped);
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

/// A button that gives a place a class, or the object of it that is near: the class's colour, the name, how likely it is,
/// and the key that does it. Returns whether it was pressed.
fn class_button(
    ui: &mut Ui,
    workspace: &Workspace,
    index: Option<usize>,
    likely: Likely,
    key: Option<&str>,
    width: f32,
) -> bool {
    if workspace.document.labels().class(likely.class).is_none() {
        return false;
    }
    let (class, color) = workspace.document.name_and_color(likely.class);
    let name = object_near(workspace, &likely).map_or(class, |object| &object.name);
    let size = vec2(width, ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    // The place at hand needs no number.
    let accessible = match index {
        None => format!("Label as {name}"),
        Some(index) => format!("Label suggestion {} as {name}", index + 1),
    };
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
            .layout_no_wrap(numbers::probability(likely.probability), font, weak);
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
    let probability = numbers::probability(likely.probability);
    let mut hint = format!("Labels this place as {name}, which is {probability} likely");
    if let Some(key) = key {
        hint += &format!(": {key}");
    }
    response.on_hover_text(hint).clicked()
}

/// What a label would settle, as a share of all pixels.
fn settles(share: f32) -> String {
    let percent = 100.0 * share;
    if percent < 0.1 {
        "settles less than 0.1% of the scene".to_owned()
    } else {
        format!("settles {percent:.1}% of the scene")
    }
}
