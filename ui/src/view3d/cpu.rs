//! A thinned cloud drawn by egui's painter, for windows without wgpu.

use egui::{Color32, Mesh, Painter, Pos2, Rect, Shape, Vec2};
use glam::Vec3;
use inplace_model::layer::Layer;
use inplace_model::palette::{Palette, Table};

use super::camera::Sight;
use super::cloud::{Prepared, Splat};
use super::pick::SPLAT_RADIUS;
use super::targets::SplatLook;
use crate::canvas::mix;

/// Most splats drawn: egui cuts them into triangles anew in every frame.
const MOST: usize = 30_000;

/// Draws the beginning of the splats as squares, the farthest first.
pub fn draw(painter: &Painter, prepared: &Prepared, sight: &Sight, look: SplatLook, palette: &Palette) {
    let splats = &prepared.cloud.splats;
    let count = splats.len().min(MOST);
    let growth = (splats.len() as f32 / count.max(1) as f32).sqrt();
    let values = &prepared.values.values[..count];
    let mut squares: Vec<(f32, Pos2, f32, Color32)> = splats[..count]
        .iter()
        .zip(values)
        .filter(|(splat, _)| !(look.see_through && faces_away(splat, sight.eye)))
        .filter_map(|(splat, &value)| {
            let (center, depth) = sight.project(Vec3::from(splat.position))?;
            let half = (SPLAT_RADIUS * growth * splat.voxel * sight.focal / depth).max(1.0);
            let [r, g, b] = colored(splat, value, look, palette);
            Some((depth, center, half, Color32::from_rgb(r, g, b)))
        })
        .collect();
    squares.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let mut mesh = Mesh::default();
    for (_, center, half, color) in squares {
        mesh.add_colored_rect(Rect::from_center_size(center, Vec2::splat(2.0 * half)), color);
    }
    painter.add(Shape::mesh(mesh));
}

/// Column of an entropy in its table.
fn column(steps: u32, palette: &Palette) -> usize {
    (steps as f32 * palette.entropy_scale()) as usize
}

fn faces_away(splat: &Splat, eye: Vec3) -> bool {
    splat.normal().dot(eye - Vec3::from(splat.position)) < 0.0
}

fn colored(splat: &Splat, value: u32, look: SplatLook, palette: &Palette) -> [u8; 3] {
    let over = match look.layer {
        Layer::Labels | Layer::Objects => palette.class((value & 0xffff) as u16),
        Layer::Entropy => palette.value(Table::Entropy, column(value >> 16, palette)),
        _ => [0; 4],
    };
    let [r, g, b, _] = splat.color;
    mix([r, g, b], over, look.opacity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::labels::Class;

    #[test]
    fn labels_and_entropy_cover_the_colour_by_their_opacity() {
        let splat = Splat {
            position: [0.0; 3],
            voxel: 0.1,
            color: [10, 20, 30, 255],
            normal: [0; 4],
        };
        let mut class = Class::new(1, "wall");
        class.color = [210, 120, 30];
        let palette = Palette::new(&[class]);
        let look = |layer, opacity| SplatLook {
            layer,
            opacity,
            see_through: true,
            background: Color32::BLACK,
        };
        let [r, g, b, _] = palette.value(Table::Entropy, column(7, &palette));
        for (value, layer, opacity, expected) in [
            (1, Layer::Labels, 0.5, [110, 70, 30]),
            (0, Layer::Labels, 0.5, [10, 20, 30]),
            (1, Layer::Color, 1.0, [10, 20, 30]),
            (7 << 16, Layer::Entropy, 1.0, [r, g, b]),
        ] {
            let color = colored(&splat, value, look(layer, opacity), &palette);
            assert_eq!(color, expected, "{value} in {layer:?}");
        }
    }
}
