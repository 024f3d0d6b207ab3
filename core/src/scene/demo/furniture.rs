//! What stands and hangs in the room, as listed in `furniture.json`. Every piece is built in its own axes: x along it,
//! y to its front, z up, with the middle of its back edge or of itself at the origin.

use std::collections::BTreeMap;

use glam::Mat3;
use serde::Deserialize;

use super::build::{Builder, Part, Place};
use super::material::{Material, Pattern, hash, srgb};
use crate::labels::VOID;

#[derive(Deserialize)]
struct Piece {
    /// Where it stands, see [`Place::new`]: x, y and degrees.
    at: [f32; 3],
    parts: Vec<PartRecord>,
}

/// Solids that share what a [`Part`] holds.
#[derive(Deserialize)]
struct PartRecord {
    /// Name of the class.
    class: String,
    /// sRGB, RRGGBB in hexadecimal digits; empty where the solids have colours of their own.
    #[serde(default)]
    color: String,
    #[serde(default)]
    pattern: Pattern,
    #[serde(default)]
    emission: f32,
    /// Offset and degrees of places inside the piece, see [`Place::inner`], each inside the one before.
    #[serde(default)]
    inner: Vec<([f32; 3], f32)>,
    solids: Vec<Form>,
}

/// What to build: the arguments of the function of this name of [`Part`] or [`Builder`], or of one in this file.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Form {
    Block([f32; 3], [f32; 3]),
    Soft([f32; 3], [f32; 3], f32),
    Column([f32; 3], [f32; 2], f32),
    Rod([f32; 3], [f32; 3], f32),
    Cushion([f32; 3], [f32; 3], (f32, f32)),
    Ball([f32; 3], [f32; 3]),
    Bulb([f32; 3], f32, f32),
    Books(i32, f32),
    Leaves,
}

/// Puts window, door and furniture into the room. The solids of a piece that are of one class and in one place inside it are
/// an object, but each cushion and each row of books is one by itself.
pub(super) fn furnish(builder: &mut Builder) {
    let classes = super::classes();
    // Compiled in, and a test looks at what it renders to.
    let pieces: Vec<Piece> = serde_json::from_str(include_str!("furniture.json")).unwrap_or_default();
    let mut count = 0;
    for piece in pieces {
        let [x, y, degrees] = piece.at;
        let mut objects = BTreeMap::new();
        for record in piece.parts {
            let places = record.inner.iter().map(|(offset, _)| offset.map(f32::to_bits));
            let own = (record.class.clone(), places.collect::<Vec<_>>());
            let inner = |place: Place, &(offset, degrees): &_| place.inner(offset, degrees);
            let place = record.inner.iter().fold(Place::new(x, y, degrees), inner);
            let class = classes.iter().find(|class| class.name == record.class);
            let color = srgb(u32::from_str_radix(&record.color, 16).unwrap_or(0));
            let material = Material::glowing(color, record.pattern, record.emission);
            let part = Part(class.map_or(VOID, |class| class.id), material, &place);
            for form in record.solids {
                let is_single = matches!(form, Form::Cushion(..) | Form::Books(..));
                let known = objects.get(&own).copied().filter(|_| !is_single);
                builder.object = known.unwrap_or_else(|| {
                    count += 1;
                    count
                });
                objects.insert(own.clone(), builder.object);
                match form {
                    Form::Block(min, max) => part.block(builder, min, max),
                    Form::Soft(min, max, radius) => part.soft(builder, min, max, radius),
                    Form::Column(base, radii, height) => part.column(builder, base, radii, height),
                    Form::Rod(from, to, radius) => part.rod(builder, from, to, radius),
                    Form::Cushion(center, half, turned) => part.cushion(builder, center, half, turned),
                    Form::Ball(center, half) => part.ball(builder, center, half, Mat3::IDENTITY),
                    Form::Bulb(center, radius, power) => builder.bulb(&place, center, radius, power),
                    Form::Books(row, z) => books(builder, part, row, z),
                    Form::Leaves => leaves(builder, part),
                }
            }
        }
    }
}

/// Books standing side by side, with a gap for what else stands there.
fn books(builder: &mut Builder, part: Part, row: i32, z: f32) {
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
        let color = srgb(cover);
        let book = Part(part.0, Material { color, ..part.1 }, part.2);
        book.block(builder, [x, 0.02, z], [x + width - 0.002, front, z + height]);
        x += width;
        number += 1;
    }
}

/// Leaves around the origin, on stems of this part.
fn leaves(builder: &mut Builder, stem: Part) {
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
        let blade = Part(stem.0, Material::plain(green), stem.2);
        blade.ball(builder, tip, [0.15, 0.062, 0.01], rotation);
    }
}
