//! The shapes that strokes and what is being drawn have in common.

use std::f32::consts::{PI, TAU};

use egui::{Color32, Mesh, Painter, Pos2, Rangef, Rect, Shape, Stroke, Vec2, pos2, vec2};
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
            if color.is_opaque() {
                // Discs on discs: a third of the triangles of a disc in rings.
                let discs = [(2.0, HALO), (0.75, Color32::WHITE), (-0.75, color)];
                shapes.extend(discs.map(|(wider, color)| disc(*point, half + wider, color)));
            } else {
                let ring = Shape::circle_stroke(*point, half, Stroke::new(1.5, Color32::WHITE));
                shapes.extend([disc(*point, half, color), ring]);
            }
        }
        [first, .., last] => {
            for (half, color) in [(half + 1.5, HALO), (half, color)] {
                if color.is_opaque() {
                    // Round ends and sharp bends, which lines lack; gentle ones they close.
                    let bends = points
                        .windows(3)
                        .filter(|at| half > 2.5 && is_sharp(at[1] - at[0], at[2] - at[1]));
                    let round = bends.map(|at| at[1]).chain([*first, *last]);
                    shapes.extend(round.map(|point| disc(point, half, color)));
                }
                shapes.push(Shape::line(points.clone(), Stroke::new(2.0 * half, color)));
            }
        }
    }
    shapes
}

/// Whether a line that goes on so turns by more than 30 degrees.
fn is_sharp(before: Vec2, after: Vec2) -> bool {
    before.dot(after) < 0.87 * before.length() * after.length()
}

/// A filled circle with as few corners as look round: a hundred clicks are drawn in every frame, and without a GPU every
/// triangle counts.
pub fn disc(middle: Pos2, radius: f32, color: Color32) -> Shape {
    /// How far an edge may be inside of the circle, in points.
    const OFF: f32 = 0.15;
    let corners = (PI / (1.0 - OFF / radius.max(2.0 * OFF)).acos()).ceil();
    let corner = |number: u32| middle + radius * Vec2::angled(TAU * number as f32 / corners);
    let corners = (0..corners as u32).map(corner).collect();
    Shape::convex_polygon(corners, color, Stroke::NONE)
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
