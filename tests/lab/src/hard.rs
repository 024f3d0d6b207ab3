//! Rooms in which methods of this kind fail: of the demo's size and gone through on its way, each with few solids.

use glam::{Vec3, Vec3A};

use inplace_core::labels::{Class, ClassId, VOID, is_thing};
use inplace_core::scene::Scene;
use inplace_core::scene::demo::rooms::{
    Builder, CEILING, Material, Optics, Pane, Part, Pattern, Place, Room, SHELL, SIZE, Zone, shell, srgb,
};
use inplace_core::scene::demo::{Shot, classes};

/// A room in which methods of this kind fail. All have walls, a floor and a ceiling of classes 1 to 3; further
/// classes are their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HardRoom {
    /// Rods of 1 to 2 cm: legs, poles, a rack, cables.
    Thin,
    /// Blocks, walls, floor and ceiling of one white, without texture: only their geometry tells them apart.
    Plain,
    /// Two classes of one material, flush, without a seam. Nobody could say to the centimetre where one ends, so
    /// the truth is void within 10 cm of that.
    SameColour,
    /// Eight blocks of one class in eight colours, far from each other.
    SameClassApart,
    /// A mirror of 1.2 x 1.6 m on a wall. Its pixels have the colours and the depth of what it shows.
    Mirror,
    /// A glazed cabinet. Its panes have the colours, slightly tinted, and the depth of what is behind them.
    Glass,
}

const WHITE: u32 = 0xEA_E6DE;
const OAK: u32 = 0xA8_7B4F;
const WALNUT: u32 = 0x6E_4A31;

/// Ids of a room's own classes, in the order of their names.
const OWN: [ClassId; 5] = [CEILING + 1, CEILING + 2, CEILING + 3, CEILING + 4, CEILING + 5];
const FIRST: ClassId = OWN[0];

/// Half of the width of what is void around a border that cannot be seen, in metres.
const UNCLEAR: f32 = 0.1;
/// Blocks of [`HardRoom::SameClassApart`] that an annotator clicks.
const CLICKED: usize = 2;

impl HardRoom {
    /// The classes, ids from 1.
    pub fn classes(self) -> Vec<Class> {
        let shell = classes().into_iter().take(usize::from(CEILING));
        let own: &[(&str, u32)] = match self {
            Self::Thin => &[
                ("table", 0xC8_4B31),
                ("chair", 0xE6_3995),
                ("pole", 0x00_72B2),
                ("rack", 0x8C_9A2B),
                ("cable", 0xFF_D23F),
            ],
            Self::Plain | Self::SameClassApart => &[("block", 0x00_72B2)],
            Self::SameColour => &[("cabinet", 0x00_72B2), ("counter", 0xE6_9F00)],
            Self::Mirror => &[("mirror", 0x16_C5C5), ("block", 0x00_72B2)],
            Self::Glass => &[("cabinet", 0x6B_4A2E), ("glass", 0x16_C5C5), ("block", 0x00_72B2)],
        };
        let own = own.iter().zip(CEILING + 1..).map(class_named);
        shell.chain(own).collect()
    }

    /// Renders the room, depth included; of the shot all but the number of rooms counts.
    pub fn scene(self, shot: &Shot) -> Scene {
        shot.scene_in(self.room(true))
    }

    /// True classes of every frame, row-major `[height, width]` each, at the pixel centres.
    pub fn ground_truth(self, shot: &Shot) -> Vec<Vec<ClassId>> {
        shot.ground_truth_in(self.room(true))
    }

    /// The same for where an annotator clicks; void where none does, and else the truth: in
    /// [`HardRoom::SameClassApart`] two blocks of eight are clicked.
    pub fn clickable(self, shot: &Shot) -> Vec<Vec<ClassId>> {
        shot.ground_truth_in(self.room(false))
    }

    /// The room; unless `all`, what an annotator leaves out is void.
    fn room(self, all: bool) -> Room {
        let mut builder = Builder::default();
        let mut zones = Vec::new();
        match self {
            Self::Thin => thin(&mut builder),
            Self::Plain => plain(&mut builder),
            Self::SameColour => zones = same_colour(&mut builder),
            Self::SameClassApart => apart(&mut builder, if all { usize::MAX } else { CLICKED }),
            Self::Mirror => mirror(&mut builder),
            Self::Glass => glass(&mut builder),
        }
        Room::new(builder, vec![skylight()], zones)
    }
}

/// A class with a name and a display colour 0xRRGGBB.
fn class_named((&(name, color), id): (&(&str, u32), ClassId)) -> Class {
    Class {
        id,
        name: name.to_owned(),
        thing: is_thing(name),
        color: [(color >> 16) as u8, (color >> 8) as u8, color as u8],
    }
}

/// Light from the middle of the ceiling; it is not seen itself.
fn skylight() -> Pane {
    Pane {
        center: Vec3A::new(0.5 * SIZE.x, 0.5 * SIZE.y, SIZE.z - 0.02),
        across: Vec3A::new(1.2, 0.0, 0.0),
        up: Vec3A::new(0.0, 0.9, 0.0),
        facing: Vec3A::NEG_Z,
        radiance: Vec3A::new(2.3, 2.25, 2.15),
    }
}

fn paint(hex: u32) -> Material {
    Material::plain(srgb(hex))
}

fn wood(hex: u32) -> Material {
    Material::patterned(srgb(hex), Pattern::Wood)
}

/// White walls and ceiling over floor boards.
fn usual_shell(builder: &mut Builder) {
    let mut materials = [paint(WHITE); SHELL];
    materials[4] = Material::patterned(srgb(0xB9_885A), Pattern::Planks);
    shell(builder, materials);
}

/// The room's own axes.
fn world() -> Place {
    Place::new(0.0, 0.0, 0.0)
}

fn thin(builder: &mut Builder) {
    const TABLE: ClassId = OWN[0];
    const CHAIR: ClassId = OWN[1];
    const POLE: ClassId = OWN[2];
    const RACK: ClassId = OWN[3];
    const CABLE: ClassId = OWN[4];
    usual_shell(builder);
    let table = Place::new(2.45, 1.9, 15.0);
    Part(TABLE, wood(OAK), &table).block(builder, [-0.6, -0.35, 0.72], [0.6, 0.35, 0.745]);
    for x in [-0.56, 0.56] {
        for y in [-0.31, 0.31] {
            Part(TABLE, wood(OAK), &table).rod(builder, [x, y, 0.0], [x, y, 0.73], 0.01);
        }
    }
    for (x, y, turn, colour) in [(0.75, 1.3, -70.0, 0xB8_4A3A), (4.2, 2.3, 100.0, 0x3F_6F9C)] {
        wire_chair(builder, CHAIR, &Place::new(x, y, turn), colour);
    }
    let brass = paint(0x8C_7443);
    for (x, y, radius) in [
        (0.4, 3.5, 0.01),
        (4.6, 0.5, 0.0075),
        (4.5, 3.6, 0.01),
        (0.5, 0.4, 0.005),
    ] {
        let (foot, top) = ([x, y, 0.001], [x, y, SIZE.z - 0.001]);
        Part(POLE, brass, &world()).rod(builder, foot, top, radius);
    }
    let steel = paint(0x6A_6660);
    let rack = Place::new(2.4, SIZE.y - 0.3, 0.0);
    for x in [-0.8, 0.8] {
        Part(RACK, steel, &rack).rod(builder, [x, 0.0, 0.001], [x, 0.0, 1.9], 0.01);
    }
    for level in 0..8 {
        let z = 0.3 + 0.22 * level as f32;
        Part(RACK, steel, &rack).rod(builder, [-0.8, 0.0, z], [0.8, 0.0, z], 0.0075);
    }
    let black = paint(0x33_302C);
    for (from, to) in [
        // Down from the ceiling to the table.
        ([2.5, 1.9, SIZE.z - 0.001], [2.5, 1.9, 0.75]),
        // Along walls.
        ([0.6, 0.03, 0.35], [2.6, 0.03, 0.9]),
        ([2.6, 0.03, 0.9], [4.4, 0.03, 1.7]),
        ([4.97, 1.0, 0.4], [4.97, 3.0, 1.8]),
        // Across the floor.
        ([1.2, 0.6, 0.008], [1.6, 3.2, 0.008]),
    ] {
        Part(CABLE, black, &world()).rod(builder, from, to, 0.006);
    }
}

/// A chair of rods around the origin, facing its front.
fn wire_chair(builder: &mut Builder, class: ClassId, place: &Place, colour: u32) {
    let lacquer = paint(colour);
    let mut rod = |from, to| Part(class, lacquer, place).rod(builder, from, to, 0.0075);
    for x in [-0.2, 0.2] {
        rod([x, 0.2, 0.0], [x, 0.2, 0.45]);
        rod([x, -0.2, 0.0], [x, -0.24, 0.9]);
        rod([x, -0.2, 0.45], [x, 0.2, 0.45]);
    }
    for step in 0..6 {
        let y = -0.2 + 0.08 * step as f32;
        rod([-0.2, y, 0.45], [0.2, y, 0.45]);
    }
    for z in [0.6, 0.7, 0.8, 0.9] {
        let y = -0.2 - 0.04 * z / 0.9;
        rod([-0.2, y, z], [0.2, y, z]);
    }
}

/// A block between two corners of the room, of a colour 0xRRGGBB.
type Block = ([f32; 3], [f32; 3], u32);

/// Blocks of one class.
fn blocks(builder: &mut Builder, class: ClassId, blocks: &[Block]) {
    for &(min, max, colour) in blocks {
        Part(class, paint(colour), &world()).block(builder, min, max);
    }
}

fn plain(builder: &mut Builder) {
    shell(builder, [paint(WHITE); SHELL]);
    let all = [
        ([0.0, 0.5, 0.0], [0.5, 1.4, 0.9], WHITE),
        ([0.0, 2.9, 0.0], [0.7, 4.0, 1.5], WHITE),
        ([1.6, 3.4, 0.0], [2.9, 4.0, 0.6], WHITE),
        ([4.2, 3.1, 0.0], [5.0, 4.0, 0.8], WHITE),
        ([4.5, 0.9, 0.0], [5.0, 1.7, 1.9], WHITE),
        ([2.2, 0.0, 0.0], [3.4, 0.45, 1.1], WHITE),
    ];
    blocks(builder, FIRST, &all);
}

fn same_colour(builder: &mut Builder) -> Vec<Zone> {
    const CABINET: ClassId = OWN[0];
    const COUNTER: ClassId = OWN[1];
    usual_shell(builder);
    // Along the two long walls: cabinets up to a seam, counters beyond it. Each pair is one solid, so that light
    // and grain know nothing of the seam.
    let depth = 0.5;
    let runs = [
        ([0.8, SIZE.y - depth, 0.0], [4.2, SIZE.y, 0.85], 2.5),
        ([1.0, 0.0, 0.0], [4.0, depth, 1.15], 2.3),
    ];
    let mut zones = Vec::new();
    for (min, max, seam) in runs {
        Part(CABINET, paint(0x7F_8C93), &world()).block(builder, min, max);
        let (low, high) = (Vec3::from(min) - 0.01, Vec3::from(max) + 0.01);
        let mut zone = |class, from: f32, to: f32| {
            zones.push(Zone {
                of: CABINET,
                class,
                min: Vec3A::new(from, low.y, low.z),
                max: Vec3A::new(to, high.y, high.z),
            });
        };
        zone(VOID, seam - UNCLEAR, seam + UNCLEAR);
        zone(COUNTER, seam + UNCLEAR, high.x);
    }
    zones
}

/// The first `known` blocks have their class, the others none.
fn apart(builder: &mut Builder, known: usize) {
    usual_shell(builder);
    let all = [
        ([0.0, 0.0, 0.0], [0.6, 0.6, 0.7], 0xB8_3A30),
        ([4.5, 3.3, 0.0], [5.0, 4.0, 1.2], 0x2F_5D9B),
        ([4.4, 0.0, 0.0], [5.0, 0.7, 0.5], 0xD8_B23C),
        ([0.0, 3.4, 0.0], [0.6, 4.0, 1.0], 0x3F_8C45),
        ([2.1, 0.0, 0.0], [2.9, 0.4, 0.9], 0x6B_3A7A),
        ([2.2, 3.5, 0.0], [3.0, 4.0, 0.6], 0x2A_2A2C),
        ([0.0, 1.6, 0.0], [0.4, 2.4, 0.8], 0xE0_7B2C),
        ([4.6, 1.7, 0.0], [5.0, 2.3, 1.4], 0x3C_9A9A),
    ];
    let (known, others) = all.split_at(known.min(all.len()));
    blocks(builder, FIRST, known);
    blocks(builder, VOID, others);
}

fn mirror(builder: &mut Builder) {
    const MIRROR: ClassId = OWN[0];
    const BLOCK: ClassId = OWN[1];
    usual_shell(builder);
    let silver = Material::passing(Vec3A::splat(0.92), Optics::Mirror);
    Part(MIRROR, silver, &world()).block(builder, [0.0, 1.4, 0.4], [0.02, 2.6, 2.0]);
    let others = [
        ([0.0, 3.2, 0.0], [0.7, 4.0, 0.9], 0x2F_5D9B),
        ([2.0, 3.4, 0.0], [3.2, 4.0, 0.7], 0xB8_3A30),
        ([4.5, 0.8, 0.0], [5.0, 1.9, 1.3], 0xD8_9A3C),
        ([4.4, 2.8, 0.0], [5.0, 3.6, 0.6], 0x3F_8C45),
        ([1.8, 0.0, 0.0], [2.8, 0.5, 1.0], 0x6B_3A7A),
    ];
    blocks(builder, BLOCK, &others);
}

fn glass(builder: &mut Builder) {
    const CABINET: ClassId = OWN[0];
    const GLASS: ClassId = OWN[1];
    const BLOCK: ClassId = OWN[2];
    usual_shell(builder);
    // A closed base with a glazed case on it, its back at the wall.
    let place = Place::new(2.5, SIZE.y, 180.0);
    let (half, depth, base, top) = (0.8, 0.45, 0.6, 1.9);
    let (oak, walnut) = (wood(OAK), wood(WALNUT));
    let mut board = |material, min, max| Part(CABINET, material, &place).block(builder, min, max);
    board(walnut, [-half, 0.0, 0.0], [half, depth, base]);
    board(walnut, [-half, 0.0, top], [half, depth, top + 0.08]);
    board(oak, [-half, 0.0, base], [half, 0.02, top]);
    for z in [1.02, 1.46] {
        let inner = half - 0.015;
        board(oak, [-inner, 0.02, z], [inner, depth - 0.05, z + 0.02]);
    }
    let vases = [0x3F_7C8C, 0xC2_4F3D, 0xE9_E4DA, 0x5C_7F63, 0xD0_9A3E, 0x2F_5266];
    for (number, colour) in vases.into_iter().enumerate() {
        let (row, column) = (number / 3, number % 3);
        let (x, z) = (0.45 * (column as f32 - 1.0), [base, 1.04][row]);
        Part(BLOCK, paint(colour), &place).column(builder, [x, 0.22, z], [0.09, 0.06], 0.28);
    }
    // The light of what is seen by way of the panes is greenish and a little less.
    let pane = Material::passing(Vec3A::new(0.86, 0.92, 0.88), Optics::Glass);
    let thick = 0.008;
    let front = [[-half, depth - thick, base], [half, depth, top]];
    let left = [[-half, 0.02, base], [-half + thick, depth - thick, top]];
    let right = [[half - thick, 0.02, base], [half, depth - thick, top]];
    for [min, max] in [front, left, right] {
        Part(GLASS, pane, &place).block(builder, min, max);
    }
    let others = [
        ([0.0, 0.4, 0.0], [0.6, 1.3, 0.9], 0x2F_5D9B),
        ([4.4, 2.6, 0.0], [5.0, 3.5, 0.7], 0xB8_3A30),
        ([2.3, 0.0, 0.0], [3.3, 0.5, 1.1], 0xD8_9A3C),
    ];
    blocks(builder, BLOCK, &others);
}

#[cfg(test)]
mod tests;
