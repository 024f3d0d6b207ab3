//! Vectors over the frame: what is being drawn, the cursor of the tool, suggestions.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};
use inplace_core::guide::Suggestion;
use inplace_core::labels::{Pixel, polygon_runs};
use inplace_model::tool::{DrawnLine, Tool};
use inplace_model::workspace::Workspace;

use super::shapes::{HALO, line_shapes, paint_runs, stroke_color};
use super::tools::Draft;
use super::view::Placement;
use crate::theme;

/// Corners of a region that are nearer to each other on screen are drawn as one, in points.
const FINEST_STEP: f32 = 1.5;
/// Widest line of a sentence, in points.
const WIDEST_SENTENCE: f32 = 480.0;

/// The colour of what is drawn with a tool now.
fn tool_color(workspace: &Workspace, tool: Tool) -> Color32 {
    match workspace.class {
        Some(class) if tool.labels() => stroke_color(workspace, class),
        _ => Color32::WHITE,
    }
}

/// The line being drawn with the button held.
pub fn line(painter: &Painter, workspace: &Workspace, placement: Placement, line: &DrawnLine, radius: u32) {
    let color = if line.tool == Tool::Erase {
        Color32::from_white_alpha(120)
    } else {
        tool_color(workspace, line.tool)
    };
    painter.extend(line_shapes(placement, &line.points, radius, color));
}

/// The polyline or polygon being drawn, with its next corner at the cursor.
pub fn draft(
    painter: &Painter,
    workspace: &Workspace,
    placement: Placement,
    draft: &Draft,
    cursor: Option<Pos2>,
    radius: u32,
) {
    let color = tool_color(workspace, draft.tool);
    let mut pixels = draft.points.clone();
    let Some(first) = pixels.first().map(|&pixel| placement.pixel_center(pixel)) else {
        return;
    };
    let closing = cursor.is_some_and(|cursor| draft.closes_at(cursor, first));
    if let Some(cursor) = cursor.filter(|_| !closing) {
        pixels.push(placement.nearest_pixel(cursor));
    }
    if draft.tool == Tool::Polygon {
        paint_runs(painter, &polygon_runs(&pixels), placement, color);
        let corners = pixels.iter().map(|&pixel| placement.pixel_center(pixel));
        let mut outline: Vec<Pos2> = corners.collect();
        for (width, color) in [(3.5, HALO), (1.5, color)] {
            painter.add(Shape::line(outline.clone(), Stroke::new(width, color)));
        }
        // The side that will close it.
        let last = outline.pop().unwrap_or(first);
        let dashes = Shape::dashed_line(&[last, first], Stroke::new(1.25, Color32::WHITE), 5.0, 4.0);
        painter.extend(dashes);
    } else {
        painter.extend(line_shapes(placement, &pixels, radius, color));
    }
    for (index, corner) in draft.corners().enumerate() {
        let center = placement.pixel_center(corner);
        let radius = if index == 0 && closing { 7.0 } else { 3.5 };
        painter.circle_filled(center, radius + 1.5, HALO);
        painter.circle(center, radius, color, Stroke::new(1.5, Color32::WHITE));
    }
}

/// The straight line that a press with Shift would draw.
pub fn straight_line(painter: &Painter, placement: Placement, from: Pixel, to: Pos2) {
    let ends = [placement.pixel_center(from), to];
    painter.line_segment(ends, Stroke::new(3.0, HALO));
    let dashes = Shape::dashed_line(&ends, Stroke::new(1.5, Color32::WHITE), 6.0, 4.0);
    painter.extend(dashes);
}

/// The tool under the pointer: the brush's disc, or a cross where there is none.
pub fn cursor(
    painter: &Painter,
    workspace: &Workspace,
    placement: Placement,
    position: Pos2,
    tool: Tool,
    radius: u32,
) {
    let color = tool_color(workspace, tool);
    if !tool.has_radius() {
        if tool == Tool::Polygon {
            // A small outline beside the cross hair of the system.
            let at = |x: f32, y: f32| position + vec2(x, y);
            let outline = vec![at(9.0, 16.0), at(12.0, 8.0), at(20.0, 10.0), at(19.0, 17.0)];
            painter.add(Shape::closed_line(outline.clone(), Stroke::new(3.5, HALO)));
            painter.add(Shape::closed_line(outline, Stroke::new(1.5, color)));
        }
        return;
    }
    let half = ((radius as f32 + 0.5) * placement.zoom).max(3.0);
    painter.circle_stroke(position, half + 1.0, Stroke::new(1.0, HALO));
    painter.circle_stroke(position, half, Stroke::new(1.5, color));
    if tool == Tool::Erase {
        let reach = 0.7 * half.min(6.0);
        for side in [-1.0, 1.0] {
            let arm = vec2(reach, side * reach);
            painter.line_segment([position - arm, position + arm], Stroke::new(1.5, color));
        }
    }
}

/// Words on the canvas, on a dark ground that suits every image.
pub fn note(painter: &Painter, position: Pos2, align: Align2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), Color32::WHITE);
    let rect = align.anchor_size(position, galley.size() + vec2(16.0, 8.0));
    // Never cut by the canvas's border.
    let bounds = painter.clip_rect().shrink(4.0);
    let free = (bounds.size() - rect.size()).max(egui::Vec2::ZERO);
    let rect = Rect::from_min_size(rect.min.clamp(bounds.min, bounds.min + free), rect.size());
    painter.rect_filled(rect, 6, Color32::from_black_alpha(200));
    painter.galley(rect.min + vec2(8.0, 4.0), galley, Color32::WHITE);
}

/// Suggested regions on the frame in view: their outline, and a numbered marker where to click. While one is at hand,
/// the others step back.
pub fn suggestions(painter: &Painter, workspace: &Workspace, placement: Placement) {
    let list = workspace.suggestions();
    let at = list.at();
    let in_view = |&(_, suggestion): &(usize, &Suggestion)| suggestion.frame == workspace.frame_index;
    let shown = list.listed.iter().enumerate().filter(in_view);
    for (index, suggestion) in shown.filter(|&(index, _)| list.answer_of(index).is_none()) {
        let current = at == Some(index);
        let in_front = current || at.is_none();
        if in_front {
            let to_screen = |&[x, y]: &[f32; 2]| placement.to_screen(Pos2::new(x, y));
            let outline: Vec<Pos2> = suggestion.outline.iter().map(to_screen).collect();
            region(painter, outline, if current { 2.0 } else { 1.25 });
        }
        let center = placement.pixel_center(suggestion.pixel);
        marker(painter, center, index, current, in_front);
    }
}

/// The outline of a suggested region, on screen.
pub fn region(painter: &Painter, mut outline: Vec<Pos2>, width: f32) {
    // Steps of the pixels that cannot be seen cost time all the same.
    outline.dedup_by(|next, last| next.distance(*last) < FINEST_STEP);
    let Some(&first) = outline.first() else {
        return;
    };
    outline.push(first);
    painter.add(Shape::line(outline.clone(), Stroke::new(width + 2.0, HALO)));
    let dashes = Shape::dashed_line(&outline, Stroke::new(width, Color32::WHITE), 6.0, 4.0);
    painter.extend(dashes);
}

/// The numbered marker of a suggested place. That of the place at hand is a ring with the number beside it, since the
/// pixel in question has to be seen.
pub fn marker(painter: &Painter, center: Pos2, index: usize, current: bool, in_front: bool) {
    let visuals = &painter.ctx().global_style().visuals;
    let (accent, on_accent) = (theme::of(visuals).accent, theme::of(visuals).on_accent);
    let dark = Color32::from_black_alpha(190);
    let white = Color32::WHITE;
    let font = FontId::proportional(12.0);
    if current {
        ring(painter, center);
        let badge = center + vec2(13.0, -13.0);
        painter.circle(badge, 9.0, accent, Stroke::new(1.0, white));
        painter.text(badge, Align2::CENTER_CENTER, index + 1, font, on_accent);
    } else {
        let strength = if in_front { 1.0 } else { 0.5 };
        let radius = if in_front { 9.0 } else { 8.0 };
        let line = Stroke::new(1.5, white.gamma_multiply(strength));
        painter.circle(center, radius, dark.gamma_multiply(strength), line);
        let color = white.gamma_multiply(strength);
        painter.text(center, Align2::CENTER_CENTER, index + 1, font, color);
    }
}

/// A ring around the pixel in question.
fn ring(painter: &Painter, center: Pos2) {
    let accent = theme::of(&painter.ctx().global_style().visuals).accent;
    for (width, color) in [(5.0, HALO), (3.0, Color32::WHITE), (1.5, accent)] {
        painter.circle_stroke(center, 9.0, Stroke::new(width, color));
    }
}

/// The place of the audit that keys judge, on the frame in view.
pub fn audited(painter: &Painter, workspace: &Workspace, placement: Placement) {
    if let Some(pixel) = audited_pixel(workspace) {
        ring(painter, placement.pixel_center(pixel));
    }
}

fn audited_pixel(workspace: &Workspace) -> Option<Pixel> {
    let place = workspace.auditing.at.and_then(|at| workspace.audited_place(at));
    place.map(|(_, pixel)| pixel)
}

/// Where on screen something is asked on the frame in view: at the suggestion at hand, or by the audit.
pub fn asked(workspace: &Workspace, placement: Placement) -> impl Iterator<Item = Pos2> {
    let at_hand = workspace.suggestions().place_at_hand();
    let suggested = at_hand.filter(|suggestion| suggestion.frame == workspace.frame_index);
    let pixels = suggested.map(|suggestion| suggestion.pixel).into_iter();
    pixels
        .chain(audited_pixel(workspace))
        .map(move |pixel| placement.pixel_center(pixel))
}

/// Writes a sentence in the middle of a part of the canvas.
pub fn sentence(ui: &Ui, part: Rect, side: usize, text: &str) {
    let painter = ui.painter_at(part);
    let widest = (part.width() - 4.0 * theme::GAP).clamp(0.0, WIDEST_SENTENCE);
    let (font, color) = (FontId::proportional(14.0), ui.visuals().strong_text_color());
    let galley = painter.layout(text.to_owned(), font, color, widest);
    let rect = Rect::from_center_size(part.center(), galley.size());
    painter.galley(rect.min, galley, color);
    // Hovering takes no clicks.
    let response = ui.interact(rect, ui.scope_id().with(("missing", side)), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
}
