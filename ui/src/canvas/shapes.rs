//! The shapes that strokes and what is being drawn have in common.

use egui::{Color32, Mesh, Painter, Pos2, Rangef, Rect, Shape, Stroke, pos2, vec2};
use inplace_core::labels::{ClassId, Pixel, Run};
use inplace_model::workspace::Workspace;

use super::view::Placement;

/// What lies around bright lines, so that they are seen on bright images.
pub const HALO: Color32 = Color32::from_black_alpha(150);

/// How much a filled polygon covers of what is under it.
pub const FILL: f32 = 0.3;

/// The colour that strokes of a class have.
pub fn stroke_color(workspace: &Workspace, class: ClassId) -> Color32 {
    let (_, [r, g, b]) = workspace.document.name_and_color(class);
    Color32::from_rgb(r, g, b)
}

/// The part of a canvas around an image, filled.
pub fn around(canvas: Rect, image: Rect, color: Color32) -> Shape {
    // The pixels at the image's edges are filled, too: they may be covered in part.
    let image = Rect::from_min_max(image.min.ceil(), image.max.floor()).intersect(canvas);
    let mut mesh = Mesh::default();
    if !image.is_positive() {
        mesh.add_colored_rect(canvas, color);
        return Shape::mesh(mesh);
    }
    let [left, right] = [canvas.left()..=image.left(), image.right()..=canvas.right()];
    for (x, y) in [
        (canvas.x_range(), Rangef::new(canvas.top(), image.top())),
        (canvas.x_range(), Rangef::new(image.bottom(), canvas.bottom())),
        (left.into(), image.y_range()),
        (right.into(), image.y_range()),
    ] {
        mesh.add_colored_rect(Rect::from_x_y_ranges(x, y), color);
    }
    Shape::mesh(mesh)
}

/// A brushed line, its ends and joints round.
pub fn line_shapes(placement: Placement, pixels: &[Pixel], radius: u32, color: Color32) -> Vec<Shape> {
    let points = pixels.iter().map(|&pixel| placement.pixel_center(pixel));
    let points: Vec<Pos2> = points.collect();
    let half = ((radius as f32 + 0.5) * placement.zoom).max(1.5);
    let mut shapes = Vec::new();
    match points.as_slice() {
        [] => {}
        [point] => {
            let half = half.max(4.0);
            let filled = Shape::circle_filled(*point, half, color);
            let ring = |radius, width, color| Shape::circle_stroke(*point, radius, Stroke::new(width, color));
            shapes.extend([
                filled,
                ring(half, 1.5, Color32::WHITE),
                ring(half + 1.5, 1.0, HALO),
            ]);
        }
        [first, .., last] => {
            for (half, color) in [(half + 1.5, HALO), (half, color)] {
                // Round ends and joints, which lines lack.
                if half > 2.5 && color.is_opaque() {
                    let joints = points.iter();
                    shapes.extend(joints.map(|&point| Shape::circle_filled(point, half, color)));
                } else if color.is_opaque() {
                    let ends = [*first, *last];
                    shapes.extend(ends.map(|point| Shape::circle_filled(point, half, color)));
                }
                shapes.push(Shape::line(points.clone(), Stroke::new(2.0 * half, color)));
            }
        }
    }
    shapes
}

/// Paints the pixels of runs, evenly.
pub fn paint_runs(painter: &Painter, runs: &[Run], placement: Placement, color: Color32) {
    let mut mesh = Mesh::default();
    fill(&mut mesh, runs, placement, color.gamma_multiply(FILL));
    if !mesh.is_empty() {
        painter.add(mesh);
    }
}

/// Adds the pixels of runs to a mesh, evenly.
pub fn fill(mesh: &mut Mesh, runs: &[Run], placement: Placement, color: Color32) {
    mesh.reserve_vertices(4 * runs.len());
    for run in runs {
        let corner = placement.to_screen(pos2(run.first as f32, run.row as f32));
        let size = placement.zoom * vec2(run.pixels() as f32, 1.0);
        mesh.add_colored_rect(Rect::from_min_size(corner, size), color);
    }
}
