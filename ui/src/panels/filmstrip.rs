//! The frames of the scene in a row, with the model of each. Only what is visible is built.

use egui::{
    Align2, Color32, FontId, Rect, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};
use inplace_model::frames::{FrameFacts, FrameFilter};
use inplace_model::layer::Look;
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands, Model};

use super::frame_filter::FrameFilterRow;
use crate::numbers;
use crate::theme;
use crate::thumbnails::{self, Thumbnails};
use crate::widgets::{Icon, focus_ring, line_of_text, scroll_to, weak_text};

/// Height of the panel in points.
pub const HEIGHT: f32 = 168.0;

const IMAGE: egui::Vec2 = vec2(112.0, 84.0);
const CAPTION: f32 = 20.0;
const STEP: f32 = IMAGE.x + theme::GAP;
/// The bar that says how unsure a frame is; it lies on images, so it is the same in both themes.
const UNCERTAIN: Color32 = Color32::from_rgb(240, 184, 84);
/// The bar that says how much of a frame is labelled, and the badge of strokes that are contradicted.
const LABELLED: Color32 = Color32::from_rgb(120, 205, 150);
const CONTRADICTED: Color32 = Color32::from_rgb(255, 134, 116);
/// Room for the frame around the chosen image.
const INSET: f32 = 2.0;

/// The filmstrip with its thumbnails.
pub struct Filmstrip {
    thumbnails: Thumbnails,
    /// The frame that was scrolled to last.
    followed: Option<usize>,
    filters: FrameFilterRow,
}

impl Filmstrip {
    /// A filmstrip with these thumbnails.
    pub fn new(thumbnails: Thumbnails) -> Self {
        Self {
            thumbnails,
            followed: None,
            filters: FrameFilterRow::default(),
        }
    }

    pub fn show(&mut self, ui: &mut Ui, model: &Model, workspace: &Workspace, commands: &mut Commands) {
        self.thumbnails.collect();
        self.filters.show(ui, workspace, commands);
        let list = &workspace.overview.frames;
        let frames = &list.shown;
        if frames.is_empty() {
            weak_text(ui, none(list.filter));
            self.followed = None;
            return;
        }
        let current = list.index_of(workspace.frame_index);
        ScrollArea::horizontal()
            .auto_shrink([false, false])
            .show_viewport(ui, |ui, viewport| {
                let size = vec2(frames.len() as f32 * STEP, INSET + IMAGE.y + CAPTION);
                let (whole, _) = ui.allocate_exact_size(size, Sense::hover());
                let cell = |index: usize| {
                    let corner = whole.min + vec2(INSET + index as f32 * STEP, INSET);
                    Rect::from_min_size(corner, vec2(IMAGE.x, size.y - INSET))
                };
                if self.followed != current {
                    self.followed = current;
                    if let Some(current) = current {
                        scroll_to(ui, cell(current).expand2(vec2(STEP, 0.0)));
                    }
                }
                let first = (viewport.left() / STEP).floor().max(0.0) as usize;
                let last = (viewport.right() / STEP).ceil().max(0.0) as usize;
                let visible = frames.iter().enumerate().take(last).skip(first);
                for (index, &frame) in visible {
                    self.cell(ui, model, workspace, frame, cell(index), commands);
                }
            });
    }

    fn cell(
        &mut self,
        ui: &Ui,
        model: &Model,
        workspace: &Workspace,
        index: usize,
        rect: Rect,
        commands: &mut Commands,
    ) {
        let Some(frame) = workspace.scene.frames.get(index) else {
            return;
        };
        let look = Look {
            layer: model.settings.layer.in_small(),
            opacity: 0.55,
            outlines: false,
        };
        let thumbnail = self.thumbnails.frame(workspace, index, look);
        let facts = workspace.overview.frames.facts(index);
        let most = workspace.document.palette().most_entropy();
        let words = in_words(&frame.stem, &facts, most);
        let current = index == workspace.frame_index;
        let response = ui.interact(rect, ui.scope_id().with(("frame", index)), Sense::click());
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, current, &words));
        if response.clicked() {
            commands.push(Command::GoToFrame(index));
        }
        let image = Rect::from_min_size(rect.min, IMAGE);
        ui.painter().rect_filled(image, 4, theme::of(ui.visuals()).canvas);
        if let Some(thumbnail) = thumbnail {
            thumbnails::paint(&thumbnail, ui.painter(), image);
        }
        paint_bars(ui, image, facts, most);
        if facts.strokes > 0 {
            let (fill, color) = (theme::of(ui.visuals()).accent, theme::of(ui.visuals()).on_accent);
            paint_count(ui, image, Align2::LEFT_TOP, (facts.strokes, fill, color));
        }
        if facts.contradicted > 0 {
            let colors = (facts.contradicted, CONTRADICTED, Color32::BLACK);
            paint_count(ui, image, Align2::RIGHT_TOP, colors);
        }
        let (width, color) = if current {
            (2.0, theme::of(ui.visuals()).accent)
        } else if response.hovered() {
            (1.0, ui.visuals().strong_text_color())
        } else {
            (1.0, theme::of(ui.visuals()).line)
        };
        ui.painter()
            .rect_stroke(image, 4, Stroke::new(width, color), StrokeKind::Outside);
        if response.has_focus() {
            focus_ring(ui, rect);
        }
        let mut caption = Rect::from_min_max(pos2(rect.left(), image.bottom() + 2.0), rect.max);
        if facts.checked {
            let good = theme::of(ui.visuals()).good;
            let side = caption.height();
            Icon::Check.paint(ui.painter(), caption.with_max_x(caption.left() + side), good);
            caption.min.x += side;
        }
        let color = if current {
            ui.visuals().strong_text_color()
        } else {
            ui.visuals().weak_text_color()
        };
        line_of_text(ui, caption, &frame.stem, 12.0, color);
        response.on_hover_text(words);
    }
}

/// Two bars along the lower edge: the longer the upper one, the more is labelled; the longer the lower, the less sure.
fn paint_bars(ui: &Ui, image: Rect, facts: FrameFacts, most: f32) {
    let Some(summary) = facts.summary else {
        return;
    };
    let unsure = (summary.mean_entropy / most).clamp(0.0, 1.0);
    let height = 3.0;
    for (line, share, color) in [(2.0, summary.coverage, LABELLED), (1.0, unsure, UNCERTAIN)] {
        let corner = pos2(image.left(), image.bottom() - line * (height + 1.0));
        let track = Rect::from_min_size(corner, vec2(image.width(), height + 1.0));
        ui.painter().rect_filled(track, 0, Color32::from_black_alpha(170));
        let bar = Rect::from_min_size(track.min, vec2(share * track.width(), height));
        ui.painter().rect_filled(bar, 0, color);
    }
}

/// A number in a corner of an image.
fn paint_count(ui: &Ui, image: Rect, corner: Align2, (count, fill, color): (usize, Color32, Color32)) {
    let text = if count > 99 {
        "99+".to_owned()
    } else {
        count.to_string()
    };
    let width = 10.0 + 7.0 * text.len() as f32;
    let badge = corner.align_size_within_rect(vec2(width, 17.0), image.shrink(4.0));
    ui.painter().rect_filled(badge, 8, fill);
    let font = FontId::proportional(12.0);
    ui.painter()
        .text(badge.center(), Align2::CENTER_CENTER, text, font, color);
}

/// What stands where no frame passes a filter.
fn none(filter: FrameFilter) -> &'static str {
    match filter {
        FrameFilter::All => "This scene has no frames.",
        FrameFilter::Unlabelled => "No frame is unlabelled: there are strokes on all of them.",
        FrameFilter::Uncertain => "No frame is uncertain.",
        FrameFilter::Disagreeing => "No frame is disagreeing: nothing contradicts your strokes.",
        FrameFilter::Unchecked => "All frames are checked.",
    }
}

/// The state of a frame; `most` is the entropy of an even guess among all classes, in nats.
fn in_words(stem: &str, facts: &FrameFacts, most: f32) -> String {
    let mut words = match facts.strokes {
        0 => "no strokes".to_owned(),
        some => counted(some, "stroke", "strokes"),
    };
    if facts.contradicted > 0 {
        words += &format!(", {} contradicted", facts.contradicted);
    }
    if facts.checked {
        words += ", checked";
    }
    if let Some(agreement) = facts.compared.and_then(|counts| counts.agreement()) {
        words += &format!(", {} as in the other project", numbers::percent(agreement));
    }
    let map = match facts.summary {
        Some(summary) => {
            let unsure = numbers::unsure(summary.mean_entropy, most);
            format!("{:.0}% labelled, {unsure}", 100.0 * summary.coverage)
        }
        None if facts.has_no_summary => "labelled from the keyframes".to_owned(),
        None => "no labels yet".to_owned(),
    };
    format!("Frame {stem}: {words}, {map}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::session::FrameSummary;

    #[test]
    fn a_frames_state_is_a_sentence() {
        let summary = FrameSummary {
            mean_entropy: 0.25,
            coverage: 0.871,
            ..FrameSummary::default()
        };
        for (strokes, contradicted, summary, has_no_summary, words) in [
            (1, 0, Some(summary), false, "1 stroke, 87% labelled, 25% unsure"),
            (
                4,
                2,
                None,
                false,
                "4 strokes, 2 contradicted, checked, no labels yet",
            ),
            (0, 0, None, false, "no strokes, no labels yet"),
            (0, 0, None, true, "no strokes, labelled from the keyframes"),
        ] {
            let facts = FrameFacts {
                strokes,
                contradicted,
                checked: contradicted > 0,
                summary,
                compared: None,
                has_no_summary,
            };
            assert_eq!(in_words("rgb_3", &facts, 1.0), format!("Frame rgb_3: {words}"));
        }
    }
}
