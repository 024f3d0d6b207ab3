//! The furnished room: 5 m along x, 4 m along y, 2.6 m high, z up.

use glam::{Vec3, Vec3A};

use super::build::{Builder, Part, Place};
use super::cast::{Caster, SHELL, Zone};
use super::furniture;
use super::light::{Bulb, Pane};
use super::material::{Material, Pattern, hash, srgb};
use crate::labels::ClassId;

pub(super) const WALL: ClassId = 1;
pub(super) const FLOOR: ClassId = 2;
/// The class of the ceiling; walls and floor come before it.
pub const CEILING: ClassId = 3;

/// Inner size of a room along x, y and z, in metres.
pub const SIZE: Vec3 = Vec3::new(5.0, 4.0, 2.6);
const PAPER_WHITE: u32 = 0xEA_E6DE;

/// A closed room of [`SIZE`] and its lights.
pub struct Room {
    pub(super) caster: Caster,
    pub(super) panes: Vec<Pane>,
    pub(super) bulbs: Vec<Bulb>,
}

impl Room {
    /// A room of what was built, a [`shell`] first. Inside the zones, solids are of another class than elsewhere.
    pub fn new(builder: Builder, panes: Vec<Pane>, zones: Vec<Zone>) -> Self {
        let mut caster = Caster::new(builder.solids, Vec3A::ZERO, SIZE.into());
        caster.zones = zones;
        Self {
            caster,
            panes,
            bulbs: builder.bulbs,
        }
    }
}

/// Builds the room with this number, always the same; the demo's is 0, and the others have other colours.
pub(super) fn room(number: usize) -> Room {
    let mut builder = Builder::default();
    let white = Material::plain(srgb(PAPER_WHITE));
    let sage = Material::plain(srgb(0xA9_B8A6));
    let boards = Material::patterned(srgb(0xB9_885A), Pattern::Planks);
    let ceiling = Material::plain(srgb(0xF1_EFEA));
    shell(&mut builder, [white, white, sage, white, boards, ceiling]);
    furniture::furnish(&mut builder);
    if number > 0 {
        repaint(&mut builder, number);
    }
    Room::new(builder, vec![daylight()], Vec::new())
}

/// Four walls, floor and ceiling of these materials, in the order -x, +x, -y, +y, -z, +z.
pub fn shell(builder: &mut Builder, materials: [Material; SHELL]) {
    const THICK: f32 = 0.1;
    const CLASSES: [ClassId; SHELL] = [WALL, WALL, WALL, WALL, FLOOR, CEILING];
    let world = Place::new(0.0, 0.0, 0.0);
    for (face, (class, material)) in CLASSES.into_iter().zip(materials).enumerate() {
        let (mut min, mut max) = (Vec3::splat(-THICK), SIZE + THICK);
        if face % 2 == 0 {
            max[face / 2] = 0.0;
        } else {
            min[face / 2] = SIZE[face / 2];
        }
        Part(class, material, &world).block(builder, min.to_array(), max.to_array());
    }
}

/// Walls and floor in the colours of the room with this number, and everything else that does not glow in another
/// tint: rooms are not copies of each other.
fn repaint(builder: &mut Builder, number: usize) {
    const WALLS: [u32; 5] = [PAPER_WHITE, 0xD9_C9B0, 0xB9_C8D6, 0xD8_B7A8, 0xC3_CFAE];
    const FLOORS: [u32; 5] = [0x8A_6A50, 0xC9_A77A, 0x7C_7A76, 0xA8_6A48, 0xB4_A48C];
    for (index, solid) in builder.solids.iter_mut().enumerate() {
        let material = &mut solid.material;
        match solid.class {
            // The accent wall comes third and stays unlike its neighbours.
            WALL => {
                let colour = srgb(WALLS[number % WALLS.len()]);
                material.color = if index == 2 { 0.7 * colour } else { colour };
            }
            FLOOR => material.color = srgb(FLOORS[number % FLOORS.len()]),
            CEILING => {}
            class if material.emission == 0.0 => {
                // One tint for all of a class, so that a piece of furniture stays one.
                let tint = |channel| 0.6 + 0.8 * hash(i32::from(class), 8 * number as i32 + channel);
                let tinted = material.color * Vec3A::new(tint(0), tint(1), tint(2));
                material.color = tinted.min(Vec3A::splat(0.95));
            }
            _ => {}
        }
    }
}

/// The light of the window.
fn daylight() -> Pane {
    let place = Place::new(2.45, SIZE.y, 180.0);
    let (half, low, high) = (0.85, 0.92, 2.18);
    Pane {
        center: place.point([0.0, 0.06, 0.5 * (low + high)]).into(),
        across: place.direction([half, 0.0, 0.0]).into(),
        up: Vec3A::Z * 0.5 * (high - low),
        facing: place.direction([0.0, 1.0, 0.0]).into(),
        radiance: Vec3A::new(3.0, 3.15, 3.35),
    }
}
