//! The frames of the scene in a row, with the state of each. Only what is visible is built.

use egui::{
    Align2, Color32, FontId, Rect, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Look};
use crate::state::AppState;
use crate::theme;
use crate::thumbnails::{MapSummary, Source, Subject, Thumbnail, Thumbnails};
use crate::widgets::{focus_ring, line_of_text};
use crate::workspace::Workspace;

/// Height of the panel in points.
pub const HEIGHT: f32 = 136.0;

const IMAGE: egui::Vec2 = vec2(112.0, 84.0);
const CAPTION: f32 = 20.0;
const STEP: f32 = IMAGE.x + theme::GAP;

/// The filmstrip with its thumbnails.
pub struct Filmstrip {
    thumbnails: Thumbnails,
    scene: u64,
    /// The frame that was scrolled to last.
    followed: Option<usize>,
}

impl Filmstrip {
    /// A filmstrip with these thumbnails.
    pub fn new(thumbnails: Thumbnails) -> Self {
        Self {
            thumbnails,
            scene: 0,
            followed: None,
        }
    }

    /// Draws the strip.
    pub fn show(&mut self, ui: &mut Ui, state: &AppState, workspace: &Workspace, actions: &mut Actions) {
        if self.scene != workspace.serial() {
            self.scene = workspace.serial();
            self.followed = None;
            self.thumbnails.clear();
        }
        self.thumbnails.collect(ui.ctx());
        let frames = workspace.scene().frames.len();
        let current = workspace.frame_index();
        ScrollArea::horizontal()
            .auto_shrink([false, false])
            .show_viewport(ui, |ui, viewport| {
                let size = vec2(frames as f32 * STEP - theme::GAP, IMAGE.y + CAPTION);
                let (whole, _) = ui.allocate_exact_size(size, Sense::hover());
                let cell = |index: usize| {
                    let corner = whole.min + vec2(index as f32 * STEP, 0.0);
                    Rect::from_min_size(corner, vec2(IMAGE.x, size.y))
                };
                if self.followed != Some(current) {
                    self.followed = Some(current);
                    ui.scroll_to_rect(cell(current).expand2(vec2(STEP, 0.0)), None);
                }
                let first = (viewport.left() / STEP).floor().max(0.0) as usize;
                let last = (viewport.right() / STEP).ceil().max(0.0) as usize;
                for index in first..last.min(frames) {
                    self.cell(ui, state, workspace, index, cell(index), actions);
                }
            });
    }

    fn cell(
        &mut self,
        ui: &Ui,
        state: &AppState,
        workspace: &Workspace,
        index: usize,
        rect: Rect,
        actions: &mut Actions,
    ) {
        let Some(frame) = workspace.scene().frames.get(index) else {
            return;
        };
        let thumbnail = self.thumbnail(state, workspace, index);
        let summary = thumbnail.as_ref().and_then(|thumbnail| thumbnail.summary);
        let strokes = workspace.document().strokes_of_frame(index);
        let words = in_words(&frame.stem, strokes, summary);
        let current = index == workspace.frame_index();
        let response = ui.interact(rect, ui.scope_id().with(("frame", index)), Sense::click());
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, current, &words));
        if response.clicked() {
            actions.push(Action::GoToFrame(index));
        }
        let image = Rect::from_min_size(rect.min, IMAGE);
        paint_image(ui, image, thumbnail.as_ref());
        let classes = workspace.document().classes().len();
        if let Some(summary) = summary {
            paint_uncertainty(ui, image, summary, classes);
        }
        if strokes > 0 {
            paint_count(ui, image, strokes);
        }
        let (width, color) = if current {
            (2.0, theme::accent(ui.visuals()))
        } else if response.hovered() {
            (1.0, ui.visuals().strong_text_color())
        } else {
            (1.0, theme::line(ui.visuals()))
        };
        ui.painter()
            .rect_stroke(image, 4, Stroke::new(width, color), StrokeKind::Outside);
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        let caption = Rect::from_min_max(pos2(rect.left(), image.bottom() + 2.0), rect.max);
        let color = if current {
            ui.visuals().strong_text_color()
        } else {
            ui.visuals().weak_text_color()
        };
        line_of_text(ui, caption, &frame.stem, 12.0, color);
        response.on_hover_text(words);
    }

    fn thumbnail(&mut self, state: &AppState, workspace: &Workspace, index: usize) -> Option<Thumbnail> {
        let (palette, palette_serial) = workspace.document().palette();
        let layer = state.settings.layer;
        let layer_number = Layer::ALL.iter().position(|&each| each == layer).unwrap_or(0) as u64;
        // Different whenever anything that the thumbnail shows is.
        let version = (workspace.map_version(index) << 24) ^ (palette_serial << 2) ^ layer_number;
        self.thumbnails.get(Subject::Frame(index), version, || Source {
            scene: std::sync::Arc::clone(workspace.scene()),
            map: workspace.session().maps().and_then(|maps| maps.get(index)),
            palette: std::sync::Arc::clone(palette),
            look: Look {
                layer,
                opacity: 0.55,
                outlines: false,
            },
        })
    }
}

fn paint_image(ui: &Ui, rect: Rect, thumbnail: Option<&Thumbnail>) {
    let painter = ui.painter();
    painter.rect_filled(rect, 4, theme::canvas(ui.visuals()));
    let Some(thumbnail) = thumbnail else {
        return;
    };
    let size = thumbnail.texture.size_vec2();
    let fitted = size * (rect.size() / size).min_elem();
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let rect = Rect::from_center_size(rect.center(), fitted);
    painter.image(thumbnail.texture.id(), rect, whole, Color32::WHITE);
}

/// A bar along the lower edge: the longer, the less sure.
fn paint_uncertainty(ui: &Ui, image: Rect, summary: MapSummary, classes: usize) {
    let most = (classes.max(2) as f32).ln();
    let share = (summary.mean_entropy / most).clamp(0.0, 1.0);
    let track = Rect::from_min_max(pos2(image.left(), image.bottom() - 4.0), image.max);
    ui.painter().rect_filled(track, 0, Color32::from_black_alpha(170));
    let bar = Rect::from_min_size(track.min, vec2(share * track.width(), track.height()));
    ui.painter().rect_filled(bar, 0, ui.visuals().warn_fg_color);
}

fn paint_count(ui: &Ui, image: Rect, strokes: usize) {
    let text = if strokes > 99 {
        "99+".to_owned()
    } else {
        strokes.to_string()
    };
    let width = 10.0 + 7.0 * text.len() as f32;
    let badge = Rect::from_min_size(image.min + vec2(4.0, 4.0), vec2(width, 17.0));
    let visuals = ui.visuals();
    ui.painter().rect_filled(badge, 8, theme::accent(visuals));
    let font = FontId::proportional(12.0);
    let color = theme::on_accent(visuals);
    ui.painter()
        .text(badge.center(), Align2::CENTER_CENTER, text, font, color);
}

fn in_words(stem: &str, strokes: usize, summary: Option<MapSummary>) -> String {
    let strokes = match strokes {
        0 => "no strokes".to_owned(),
        1 => "1 stroke".to_owned(),
        many => format!("{many} strokes"),
    };
    let map = summary.map_or_else(
        || "no labels yet".to_owned(),
        |summary| {
            format!(
                "{:.0}% labelled, uncertainty {:.2} nats",
                100.0 * summary.coverage,
                summary.mean_entropy
            )
        },
    );
    format!("Frame {stem}: {strokes}, {map}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frames_state_is_a_sentence() {
        let summary = MapSummary {
            mean_entropy: 0.25,
            coverage: 0.871,
        };
        assert_eq!(
            in_words("rgb_3", 1, Some(summary)),
            "Frame rgb_3: 1 stroke, 87% labelled, uncertainty 0.25 nats"
        );
        assert_eq!(in_words("a", 0, None), "Frame a: no strokes, no labels yet");
    }
}
