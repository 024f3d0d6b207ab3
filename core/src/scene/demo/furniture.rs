//! What stands and hangs in the room. Every piece is built in its own axes: x along it, y to its front,
//! z up, with the middle of its back edge at the origin unless it says otherwise.

use glam::Mat3;

use super::build::{Builder, Part, Place};
use super::material::{Material, Pattern, hash, srgb};
use super::room::{
    BED, BOOK, CHAIR, CUSHION, LAMP, NIGHTSTAND, PICTURE, PILLOW, PLANT, RUG, SHELF, SOFA, TABLE, VASE,
};

const OAK: u32 = 0xA8_7B4F;
const WALNUT: u32 = 0x6E_4A31;
const LINEN: u32 = 0xEF_EDE8;

fn paint(hex: u32) -> Material {
    Material::plain(srgb(hex))
}

fn wood(hex: u32) -> Material {
    Material::patterned(srgb(hex), Pattern::Wood)
}

/// A double bed, its head at the wall: pillows and sheet are of one white.
pub(super) fn bed(builder: &mut Builder, place: &Place) {
    let oak = Part(BED, wood(OAK), place);
    let sheet = Part(BED, paint(LINEN), place);
    oak.block(builder, [-0.84, 0.0, 0.1], [0.84, 0.05, 0.98]);
    oak.block(builder, [-0.8, 0.05, 0.14], [0.8, 2.06, 0.3]);
    for x in [-0.74, 0.74] {
        for y in [0.12, 1.98] {
            oak.column(builder, [x, y, 0.0], [0.03, 0.035], 0.14);
        }
    }
    sheet.soft(builder, [-0.78, 0.06, 0.27], [0.78, 2.03, 0.52], 0.06);
    let blanket = Part(BED, Material::patterned(srgb(0x4F_7F86), Pattern::Stripes), place);
    blanket.soft(builder, [-0.83, 0.86, 0.24], [0.83, 2.09, 0.565], 0.05);
    sheet.soft(builder, [-0.83, 0.72, 0.42], [0.83, 0.95, 0.58], 0.045);
    let pillow = Part(PILLOW, paint(LINEN), place);
    for (x, turn) in [(-0.4, 4.0), (0.39, -5.0)] {
        pillow.cushion(builder, [x, 0.33, 0.615], [0.34, 0.24, 0.09], (16.0, turn));
    }
}

/// A bedside cabinet with a small lamp.
pub(super) fn nightstand(builder: &mut Builder, place: &Place) {
    let walnut = Part(NIGHTSTAND, wood(WALNUT), place);
    let front = Part(NIGHTSTAND, wood(0x80_583C), place);
    let knob = Part(NIGHTSTAND, paint(0xC9_B27A), place);
    walnut.block(builder, [-0.22, 0.0, 0.1], [0.22, 0.38, 0.5]);
    for (low, high) in [(0.12, 0.29), (0.31, 0.48)] {
        front.block(builder, [-0.205, 0.3, low], [0.205, 0.395, high]);
        let middle = 0.5 * (low + high);
        knob.ball(builder, [0.0, 0.405, middle], [0.016; 3], Mat3::IDENTITY);
    }
    for x in [-0.19, 0.19] {
        for y in [0.03, 0.35] {
            walnut.column(builder, [x, y, 0.0], [0.012, 0.018], 0.1);
        }
    }
    let base = Part(LAMP, paint(0x3C_6A70), place);
    base.ball(builder, [0.0, 0.17, 0.575], [0.07, 0.07, 0.08], Mat3::IDENTITY);
    base.column(builder, [0.0, 0.17, 0.64], [0.012, 0.012], 0.1);
    shade(builder, place, [0.0, 0.17, 0.72], [0.13, 0.085], 0.17, 0.22);
}

/// A glowing lamp shade with its light; `radii` at its lower and upper end.
fn shade(builder: &mut Builder, place: &Place, base: [f32; 3], radii: [f32; 2], height: f32, power: f32) {
    let cloth = Material::glowing(srgb(0xFB_E2B4), Pattern::Plain, 0.85);
    Part(LAMP, cloth, place).column(builder, base, radii, height);
    let [x, y, z] = base;
    builder.bulb(place, [x, y, z + 0.5 * height], 0.6 * radii[0], power);
}

/// A two-seat sofa with loose cushions.
pub(super) fn sofa(builder: &mut Builder, place: &Place) {
    let cloth = Part(SOFA, paint(0x5F_7286), place);
    let seat = Part(SOFA, paint(0x68_7B8F), place);
    let foot = Part(SOFA, wood(WALNUT), place);
    cloth.soft(builder, [-1.0, 0.0, 0.09], [1.0, 0.85, 0.3], 0.03);
    cloth.soft(builder, [-1.0, 0.0, 0.12], [1.0, 0.22, 0.8], 0.07);
    for side in [-1.0_f32, 1.0] {
        let (a, b) = (side, side * 0.8);
        cloth.soft(builder, [a.min(b), 0.02, 0.1], [a.max(b), 0.87, 0.58], 0.07);
        let (a, b) = (side * 0.004, side * 0.8);
        seat.soft(builder, [a.min(b), 0.16, 0.27], [a.max(b), 0.88, 0.44], 0.05);
        for y in [0.06, 0.8] {
            foot.column(builder, [side * 0.93, y, 0.0], [0.018, 0.026], 0.1);
        }
    }
    for (x, lean, turn, color) in [
        (-0.58, 17.0, -12.0, 0xD6_9E3C),
        (0.22, 19.0, 6.0, 0xB8_573B),
        (0.6, 16.0, 14.0, 0xE3_D6BC),
    ] {
        let cushion = Part(CUSHION, paint(color), place);
        cushion.cushion(builder, [x, 0.36, 0.63], [0.21, 0.08, 0.2], (lean, turn));
    }
}

/// A flat rug around the origin.
pub(super) fn rug(builder: &mut Builder, place: &Place) {
    let weave = Material::patterned(srgb(0xA8_4B3F), Pattern::Rug);
    Part(RUG, weave, place).block(builder, [-1.15, -0.68, 0.0], [1.15, 0.68, 0.012]);
}

/// A round low table around the origin, with a vase and two books.
pub(super) fn coffee_table(builder: &mut Builder, place: &Place) {
    let oak = Part(TABLE, wood(OAK), place);
    oak.column(builder, [0.0, 0.0, 0.39], [0.4, 0.4], 0.03);
    for corner in 0..3 {
        let (sin, cos) = (corner as f32 * std::f32::consts::TAU / 3.0).sin_cos();
        let (from, to) = ([0.33 * cos, 0.33 * sin, 0.013], [0.22 * cos, 0.22 * sin, 0.4]);
        oak.rod(builder, from, to, 0.016);
    }
    vase(builder, &place.inner([0.12, 0.12, 0.42], 0.0), 0x3F_7C8C, 1.0);
    let stack = place.inner([-0.14, -0.1, 0.42], 25.0);
    let lower = Part(BOOK, paint(0xC2_4F3D), &stack);
    lower.block(builder, [-0.13, -0.09, 0.0], [0.13, 0.09, 0.03]);
    let on_it = stack.inner([0.0, 0.0, 0.03], -14.0);
    let upper = Part(BOOK, paint(0x2F_5266), &on_it);
    upper.block(builder, [-0.11, -0.08, 0.0], [0.11, 0.08, 0.025]);
}

/// A vase around the origin, 24 cm high at scale one.
fn vase(builder: &mut Builder, place: &Place, color: u32, scale: f32) {
    let glaze = Part(VASE, paint(color), place);
    let sized = |v: f32| v * scale;
    let belly = [0.08, 0.08, 0.09].map(sized);
    glaze.ball(builder, [0.0, 0.0, sized(0.085)], belly, Mat3::IDENTITY);
    let (neck, rim) = ([0.045, 0.03].map(sized), [0.03, 0.045].map(sized));
    glaze.column(builder, [0.0, 0.0, sized(0.14)], neck, sized(0.07));
    glaze.column(builder, [0.0, 0.0, sized(0.21)], rim, sized(0.03));
}

/// A table for four around the origin, with a vase and a book.
pub(super) fn dining_table(builder: &mut Builder, place: &Place) {
    let walnut = Part(TABLE, wood(0x8A_5E3E), place);
    walnut.block(builder, [-0.6, -0.38, 0.715], [0.6, 0.38, 0.745]);
    walnut.block(builder, [-0.54, -0.32, 0.64], [0.54, 0.32, 0.715]);
    for x in [-0.53, 0.53] {
        for y in [-0.31, 0.31] {
            walnut.column(builder, [x, y, 0.0], [0.02, 0.03], 0.7);
        }
    }
    vase(builder, &place.inner([0.05, -0.05, 0.745], 0.0), 0xE9_E4DA, 1.1);
    let on_it = place.inner([-0.32, 0.1, 0.745], 70.0);
    let book = Part(BOOK, paint(0xD9_A63E), &on_it);
    book.block(builder, [-0.12, -0.085, 0.0], [0.12, 0.085, 0.035]);
}

/// A chair around the origin, facing its front.
pub(super) fn chair(builder: &mut Builder, place: &Place, color: u32) {
    let lacquer = Part(CHAIR, paint(color), place);
    for x in [-0.18, 0.18] {
        lacquer.rod(builder, [1.08 * x, 0.19, 0.0], [x, 0.17, 0.44], 0.015);
        lacquer.rod(builder, [1.08 * x, -0.2, 0.0], [x, -0.18, 0.44], 0.015);
        lacquer.rod(builder, [x, -0.18, 0.42], [x, -0.23, 0.88], 0.014);
    }
    lacquer.soft(builder, [-0.215, -0.21, 0.425], [0.215, 0.22, 0.465], 0.018);
    for (y, z, height) in [(-0.222, 0.78, 0.1), (-0.208, 0.62, 0.06)] {
        lacquer.soft(builder, [-0.2, y - 0.012, z], [0.2, y + 0.012, z + height], 0.011);
    }
}

/// A bookcase filled with books and a vase.
pub(super) fn shelf(builder: &mut Builder, place: &Place) {
    let white = Part(SHELF, paint(0xDD_D6C8), place);
    let (half, depth, height, board) = (0.6, 0.28, 1.86, 0.022);
    white.block(builder, [-half, 0.0, 0.0], [half, 0.012, height]);
    for x in [-half, half - board] {
        white.block(builder, [x, 0.0, 0.0], [x + board, depth, height]);
    }
    let levels = [0.06, 0.42, 0.78, 1.14, 1.5, height - board];
    for z in levels {
        white.block(builder, [-half, 0.0, z], [half, depth - 0.005, z + board]);
    }
    for (row, z) in levels.iter().take(5).enumerate() {
        row_of_books(builder, place, row as i32, z + board);
    }
    vase(builder, &place.inner([0.42, 0.14, 0.8], 0.0), 0xB8_5C48, 0.9);
    vase(builder, &place.inner([-0.43, 0.14, 1.522], 0.0), 0x5C_7F63, 1.0);
}

/// Books standing side by side, with a gap for what else stands there.
fn row_of_books(builder: &mut Builder, place: &Place, row: i32, z: f32) {
    const COVERS: [u32; 8] = [
        0x8E_3B32, 0x2F_5266, 0xD0_9A3E, 0x4F_6B4A, 0x6B_4A66, 0xC9_BFA8, 0x1F_3347, 0xB8_6B3C,
    ];
    let (first, last) = match row {
        2 => (-0.57, 0.28),
        4 => (-0.28, 0.5),
        3 => (-0.5, 0.57),
        _ => (-0.57, 0.5),
    };
    let mut x: f32 = first;
    let mut number = 0;
    while x < last {
        let width = 0.03 + 0.035 * hash(row, 3 * number);
        let height = 0.21 + 0.085 * hash(row, 3 * number + 1);
        let front = 0.2 + 0.05 * hash(row, 3 * number + 2);
        let cover = COVERS[(number * 5 + row * 3) as usize % COVERS.len()];
        let book = Part(BOOK, Material::patterned(srgb(cover), Pattern::Spine), place);
        book.block(builder, [x, 0.02, z], [x + width - 0.002, front, z + height]);
        x += width;
        number += 1;
    }
}

/// A potted plant around the origin.
pub(super) fn plant(builder: &mut Builder, place: &Place) {
    let pot = Part(PLANT, paint(0xB8_6A48), place);
    let soil = Part(PLANT, paint(0x3E_2E24), place);
    let stem = Part(PLANT, paint(0x56_7A40), place);
    pot.column(builder, [0.0; 3], [0.13, 0.18], 0.32);
    soil.column(builder, [0.0, 0.0, 0.31], [0.165, 0.165], 0.012);
    for leaf in 0..22 {
        let turn = leaf as f32 * 137.5_f32.to_radians();
        let level = leaf as f32 / 21.0;
        let height = 0.55 + 0.75 * level + 0.06 * hash(leaf, 1);
        let reach = 0.25 - 0.17 * level + 0.04 * hash(leaf, 2);
        let (sin, cos) = turn.sin_cos();
        let tip = [reach * cos, reach * sin, height];
        let end = [0.75 * tip[0], 0.75 * tip[1], height - 0.03];
        stem.rod(builder, [0.03 * cos, 0.03 * sin, 0.31], end, 0.007);
        let green = srgb(0x4E_8B45).lerp(srgb(0x2F_6B3C), hash(leaf, 3));
        let droop = (-35.0 + 75.0 * level).to_radians();
        let rotation = Mat3::from_rotation_z(turn) * Mat3::from_rotation_y(-droop);
        let blade = Part(PLANT, Material::plain(green), place);
        blade.ball(builder, tip, [0.15, 0.062, 0.01], rotation);
    }
}

/// A standing lamp on a pole of 2 cm, around the origin.
pub(super) fn floor_lamp(builder: &mut Builder, place: &Place) {
    let brass = Part(LAMP, paint(0x8C_7443), place);
    brass.column(builder, [0.0; 3], [0.14, 0.13], 0.025);
    brass.column(builder, [0.0; 3], [0.01, 0.01], 1.5);
    shade(builder, place, [0.0, 0.0, 1.4], [0.2, 0.14], 0.28, 0.5);
}

/// A lamp on a cord from the ceiling, around the origin.
pub(super) fn pendant(builder: &mut Builder, place: &Place, ceiling: f32) {
    let cord = paint(0x33_302C);
    Part(LAMP, cord, place).column(builder, [0.0, 0.0, 1.9], [0.006, 0.006], ceiling - 1.9);
    shade(builder, place, [0.0, 0.0, 1.72], [0.21, 0.08], 0.2, 0.5);
}

/// A framed picture on the wall behind, its middle at 1.62 m; `half` of its width and height.
pub(super) fn picture(builder: &mut Builder, place: &Place, half: [f32; 2], pattern: Pattern) {
    let frame = Material::patterned(srgb(0x3B_2F26), pattern);
    let [x, z] = half;
    Part(PICTURE, frame, place).block(builder, [-x, 0.0, 1.62 - z], [x, 0.025, 1.62 + z]);
}
