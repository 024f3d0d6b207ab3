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
pub(super) const WINDOW: ClassId = 4;
pub(super) const DOOR: ClassId = 5;
pub(super) const CURTAIN: ClassId = 6;
pub(super) const BED: ClassId = 7;
pub(super) const PILLOW: ClassId = 8;
pub(super) const SOFA: ClassId = 9;
pub(super) const CUSHION: ClassId = 10;
pub(super) const TABLE: ClassId = 11;
pub(super) const CHAIR: ClassId = 12;
pub(super) const NIGHTSTAND: ClassId = 13;
pub(super) const SHELF: ClassId = 14;
pub(super) const BOOK: ClassId = 15;
pub(super) const LAMP: ClassId = 16;
pub(super) const RUG: ClassId = 17;
pub(super) const PLANT: ClassId = 18;
pub(super) const PICTURE: ClassId = 19;
pub(super) const VASE: ClassId = 20;

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
    let pane = window(&mut builder, &Place::new(2.45, SIZE.y, 180.0));
    door(&mut builder, &Place::new(0.0, 0.78, -90.0));
    furniture::bed(&mut builder, &Place::new(0.03, 2.66, -90.0));
    furniture::nightstand(&mut builder, &Place::new(0.02, 3.7, -90.0));
    furniture::sofa(&mut builder, &Place::new(2.0, 0.04, 0.0));
    furniture::rug(&mut builder, &Place::new(2.2, 1.42, 0.0));
    furniture::coffee_table(&mut builder, &Place::new(2.28, 1.38, 20.0));
    furniture::dining_table(&mut builder, &Place::new(4.12, 2.6, 90.0));
    furniture::chair(&mut builder, &Place::new(3.5, 2.72, -84.0), 0xB8_4A3A);
    furniture::chair(&mut builder, &Place::new(4.02, 1.83, 8.0), 0x3F_6F9C);
    furniture::shelf(&mut builder, &Place::new(4.98, 0.85, 90.0));
    furniture::plant(&mut builder, &Place::new(4.55, 3.6, 0.0));
    furniture::floor_lamp(&mut builder, &Place::new(3.42, 0.38, 0.0));
    furniture::pendant(&mut builder, &Place::new(4.12, 2.6, 0.0), SIZE.z);
    for (place, half, pattern) in [
        (Place::new(1.55, 0.0, 0.0), [0.42, 0.3], Pattern::Sunset),
        (Place::new(2.6, 0.0, 0.0), [0.27, 0.33], Pattern::Discs),
        (Place::new(0.0, 2.66, -90.0), [0.45, 0.28], Pattern::Fields),
        (Place::new(5.0, 2.6, 90.0), [0.3, 0.38], Pattern::Discs),
    ] {
        furniture::picture(&mut builder, &place, half, pattern);
    }
    if number > 0 {
        repaint(&mut builder, number);
    }
    Room::new(builder, vec![pane], Vec::new())
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

/// A window of two casements with curtains; returns its light.
fn window(builder: &mut Builder, place: &Place) -> Pane {
    let frame = Part(WINDOW, Material::plain(srgb(0xF3_F1EC)), place);
    let glass = Material::glowing(srgb(0xFF_FFFF), Pattern::Outside, 0.95);
    let (half, low, high) = (0.85, 0.92, 2.18);
    Part(WINDOW, glass, place).block(builder, [-half, 0.0, low], [half, 0.015, high]);
    let bar = 0.03;
    for x in [-half, 0.0, half] {
        frame.block(builder, [x - bar, 0.0, low], [x + bar, 0.05, high]);
    }
    for z in [low, 1.76, high] {
        frame.block(builder, [-half - bar, 0.0, z - bar], [half + bar, 0.045, z + bar]);
    }
    let (sill, edge) = ([-half - 0.1, 0.0, low - 0.06], [half + 0.1, 0.14, low - 0.03]);
    frame.block(builder, sill, edge);
    let cloth = Material::plain(srgb(0xC2_8F86));
    for side in [-1.0_f32, 1.0] {
        for fold in 0..7 {
            let x = side * (half + 0.02 + 0.062 * fold as f32);
            let depth = if fold % 2 == 0 { 0.09 } else { 0.125 };
            Part(CURTAIN, cloth, place).column(builder, [x, depth, 0.06], [0.044, 0.036], 2.25);
        }
    }
    let rail = Part(CURTAIN, Material::plain(srgb(0x4A_4038)), place);
    let end = half + 0.55;
    rail.rod(builder, [-end, 0.105, 2.33], [end, 0.105, 2.33], 0.013);
    Pane {
        center: place.point([0.0, 0.06, 0.5 * (low + high)]).into(),
        across: place.direction([half, 0.0, 0.0]).into(),
        up: Vec3A::Z * 0.5 * (high - low),
        facing: place.direction([0.0, 1.0, 0.0]).into(),
        radiance: Vec3A::new(3.0, 3.15, 3.35),
    }
}

/// A painted door whose frame has the colour of the wall.
fn door(builder: &mut Builder, place: &Place) {
    let frame = Material::plain(srgb(PAPER_WHITE));
    let leaf = Material::plain(srgb(0xD5_CFC2));
    let panel = Part(DOOR, Material::plain(srgb(0xC8_C1B2)), place);
    let steel = Material::plain(srgb(0x6A_6660));
    let (half, high) = (0.42, 2.02);
    Part(DOOR, leaf, place).block(builder, [-half, 0.0, 0.01], [half, 0.035, high]);
    for side in [-1.0_f32, 1.0] {
        let (inner, outer) = (side * half, side * (half + 0.08));
        let (left, right) = (inner.min(outer), inner.max(outer));
        Part(DOOR, frame, place).block(builder, [left, 0.0, 0.0], [right, 0.05, high + 0.08]);
        for (low, high) in [(0.2, 0.85), (1.05, 1.85)] {
            let (a, b) = (0.06 * side, 0.35 * side);
            panel.block(builder, [a.min(b), 0.035, low], [a.max(b), 0.042, high]);
        }
    }
    Part(DOOR, frame, place).block(builder, [-half, 0.0, high], [half, 0.05, high + 0.08]);
    Part(DOOR, steel, place).rod(builder, [0.37, 0.035, 1.0], [0.37, 0.08, 1.0], 0.012);
    Part(DOOR, steel, place).rod(builder, [0.38, 0.08, 1.0], [0.26, 0.08, 1.0], 0.011);
}
