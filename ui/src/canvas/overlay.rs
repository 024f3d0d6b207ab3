//! Vectors over the frame: strokes, the line being drawn, the brush, suggestions.

use egui::{Align2, Color32, FontId, Painter, Pos2, Shape, Stroke, vec2};
use inplace_core::guide::Suggestion;
use inplace_core::labels::{ClassId, Pixel, VOID};

use super::palette::VOID_COLOR;
use super::tools::{Line, Tool};
use super::view::Placement;
use crate::theme;
use crate::workspace::Workspace;

/// Corners of a region that are nearer to each other on screen are drawn as one, in points.
const FINEST_STEP: f32 = 1.5;
const HALO: Color32 = Color32::from_black_alpha(150);

/// The colour that strokes of a class have.
pub fn stroke_color(workspace: &Workspace, class: ClassId) -> Color32 {
    let [r, g, b] = if class == VOID {
        VOID_COLOR
    } else {
        let class = workspace.document().labels().class(class);
        class.map_or(VOID_COLOR, |class| class.color)
    };
    Color32::from_rgb(r, g, b)
}

/// The strokes of the frame in view.
pub fn strokes(painter: &Painter, workspace: &Workspace, placement: Placement) {
    let labels = workspace.document().labels();
    for (_, stroke) in labels.strokes_of(workspace.frame_index()) {
        let color = stroke_color(workspace, stroke.class);
        for line in &stroke.lines {
            polyline(painter, placement, line, stroke.radius, color);
        }
    }
}

/// The line being drawn.
pub fn draft(painter: &Painter, workspace: &Workspace, placement: Placement, line: &Line, radius: u32) {
    let color = match (line.tool, workspace.class()) {
        (Tool::Erase, _) => Color32::from_white_alpha(120),
        (Tool::Label, Some(class)) => stroke_color(workspace, class),
        (Tool::Label, None) => Color32::from_white_alpha(200),
    };
    polyline(painter, placement, &line.points, radius, color);
}

fn polyline(painter: &Painter, placement: Placement, pixels: &[Pixel], radius: u32, color: Color32) {
    let points: Vec<Pos2> = pixels
        .iter()
        .map(|&pixel| placement.pixel_center(pixel))
        .collect();
    let half = ((radius as f32 + 0.5) * placement.zoom).max(1.5);
    match points.as_slice() {
        [] => {}
        [point] => {
            let half = half.max(4.0);
            painter.circle(*point, half, color, Stroke::new(1.5, Color32::WHITE));
            painter.circle_stroke(*point, half + 1.5, Stroke::new(1.0, HALO));
        }
        [first, .., last] => {
            for (half, color) in [(half + 1.5, HALO), (half, color)] {
                // Round ends and joints, which lines lack.
                if half > 2.5 && color.is_opaque() {
                    let joints = points
                        .iter()
                        .map(|&point| Shape::circle_filled(point, half, color));
                    painter.extend(joints);
                } else if color.is_opaque() {
                    painter.circle_filled(*first, half, color);
                    painter.circle_filled(*last, half, color);
                }
                painter.add(Shape::line(points.clone(), Stroke::new(2.0 * half, color)));
            }
        }
    }
}

/// The brush under the pointer.
pub fn brush(
    painter: &Painter,
    workspace: &Workspace,
    placement: Placement,
    position: Pos2,
    tool: Tool,
    radius: u32,
) {
    let half = ((radius as f32 + 0.5) * placement.zoom).max(3.0);
    let color = match (tool, workspace.class()) {
        (Tool::Label, Some(class)) => stroke_color(workspace, class),
        _ => Color32::WHITE,
    };
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

/// Suggested regions on the frame in view: their outline, and a numbered marker where to click. While one is at hand,
/// the others step back.
pub fn suggestions(painter: &Painter, workspace: &Workspace, placement: Placement) {
    let guidance = workspace.guidance();
    let at = guidance.at();
    let in_view = |&(_, suggestion): &(usize, &Suggestion)| suggestion.frame == workspace.frame_index();
    let shown = workspace.suggestions().iter().enumerate().filter(in_view);
    for (index, suggestion) in shown.filter(|&(index, _)| guidance.answer_of(index).is_none()) {
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
    let (accent, on_accent) = (theme::accent(visuals), theme::on_accent(visuals));
    let dark = Color32::from_black_alpha(190);
    let white = Color32::WHITE;
    let font = FontId::proportional(12.0);
    if current {
        painter.circle_stroke(center, 9.0, Stroke::new(5.0, HALO));
        painter.circle_stroke(center, 9.0, Stroke::new(3.0, white));
        painter.circle_stroke(center, 9.0, Stroke::new(1.5, accent));
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
