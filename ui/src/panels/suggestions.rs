//! Where to label next.

use egui::{Button, Color32, Rect, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use inplace_core::guide::Suggestion;
use inplace_core::labels::ClassId;

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Look};
use crate::theme;
use crate::thumbnails::{Source, Subject, Thumbnails, place_in_crop};
use crate::widgets::{empty_state, heading, swatch};
use crate::workspace::Workspace;

const IMAGE: egui::Vec2 = vec2(96.0, 72.0);

/// The ranked list of places with their pictures.
pub struct SuggestionPanel {
    thumbnails: Thumbnails,
    scene: u64,
}

impl SuggestionPanel {
    /// A list with these thumbnails.
    pub fn new(thumbnails: Thumbnails) -> Self {
        Self { thumbnails, scene: 0 }
    }

    /// Draws the list.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
        if self.scene != workspace.serial() {
            self.scene = workspace.serial();
            self.thumbnails.clear();
        }
        self.thumbnails.collect(ui.ctx());
        heading(ui, "Label next", |ui| {
            let any = !workspace.suggestions().is_empty();
            let button = ui.add_enabled(any, Button::new("Go there (N)"));
            if button.on_hover_text("Goes to the next suggestion").clicked() {
                actions.push(Action::NextSuggestion);
            }
        });
        if workspace.suggestions().is_empty() {
            let said = workspace.document().labels().says_anything();
            empty_state(
                ui,
                if said {
                    "Looking for the places that would settle most."
                } else {
                    "After your first strokes, the places that would settle most are listed here."
                },
            );
            return;
        }
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for (index, suggestion) in workspace.suggestions().iter().enumerate() {
                ui.push_id(index, |ui| self.card(ui, workspace, index, suggestion, actions));
            }
        });
    }

    fn card(
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
        let current = workspace.at_suggestion() == Some(index);
        let mut card = super::card(ui);
        if current {
            card = card.stroke(Stroke::new(1.0, theme::accent(ui.visuals())));
        }
        card.show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal_top(|ui| {
                self.picture(ui, workspace, index, suggestion, actions);
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 4.0;
                    let title = format!("{}.  {}", index + 1, frame.stem);
                    ui.add(egui::Label::new(egui::RichText::new(title).strong()).truncate());
                    let settles = format!("{:.1}% of the scene", 100.0 * suggestion.share);
                    ui.weak(settles)
                        .on_hover_text("The share of all pixels that a label there would settle");
                });
            });
            if !suggestion.classes.is_empty() {
                ui.horizontal_wrapped(|ui| {
                    ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
                    for &class in suggestion.classes.iter().take(2) {
                        class_button(ui, workspace, suggestion, class, actions);
                    }
                });
            }
        });
    }

    fn picture(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        suggestion: &Suggestion,
        actions: &mut Actions,
    ) {
        let (rect, response) = ui.allocate_exact_size(IMAGE, Sense::click());
        let name = format!("Go to suggestion {}", index + 1);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        if response.clicked() {
            actions.push(Action::GoToSuggestion(index));
        }
        ui.painter().rect_filled(rect, 4, theme::canvas(ui.visuals()));
        let Some(frame) = workspace.scene().frames.get(suggestion.frame) else {
            return;
        };
        let subject = Subject::Place(suggestion.frame, suggestion.pixel);
        let (palette, _) = workspace.document().palette();
        let thumbnail = self.thumbnails.get(subject, 1, || Source {
            scene: std::sync::Arc::clone(workspace.scene()),
            map: None,
            palette: std::sync::Arc::clone(palette),
            look: Look {
                layer: Layer::Color,
                opacity: 0.0,
                outlines: false,
            },
        });
        if let Some(thumbnail) = thumbnail {
            let size = thumbnail.texture.size_vec2();
            let fitted = Rect::from_center_size(rect.center(), size * (rect.size() / size).min_elem());
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            let texture = thumbnail.texture.id();
            ui.painter().image(texture, fitted, whole, Color32::WHITE);
            let full = [frame.color.width() as usize, frame.color.height() as usize];
            let place = fitted.min + place_in_crop(full, suggestion.pixel) * fitted.size();
            ui.painter()
                .circle_stroke(place, 6.0, Stroke::new(3.0, Color32::from_black_alpha(160)));
            ui.painter()
                .circle_stroke(place, 6.0, Stroke::new(1.5, Color32::WHITE));
        }
        response.on_hover_text(name);
    }
}

/// A button that gives the place a class.
fn class_button(
    ui: &mut Ui,
    workspace: &Workspace,
    suggestion: &Suggestion,
    id: ClassId,
    actions: &mut Actions,
) {
    let Some(class) = workspace.document().labels().class(id) else {
        return;
    };
    let room = (ui.max_rect().width() - 4.0) * 0.5;
    let text = format!("     {}", class.name);
    let button = Button::new(text).truncate();
    let response = ui.scope(|ui| {
        ui.set_max_width(room);
        ui.add(button)
    });
    let response = response.inner.accessible_name(format!("Label as {}", class.name));
    let center = response.rect.left_center() + vec2(14.0, 0.0);
    swatch(ui.painter(), center, class.color, 12.0);
    if response
        .on_hover_text(format!("Labels this place as {}", class.name))
        .clicked()
    {
        actions.push(Action::LabelAt {
            frame: suggestion.frame,
            pixel: suggestion.pixel,
            class: id,
        });
    }
}
