//! Surface colours and the patterns painted on them.

use std::sync::LazyLock;

use glam::{Vec2, Vec3A};
use serde::Deserialize;

/// What a surface looks like.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Diffuse reflectance, linear.
    pub color: Vec3A,
    /// What is painted on it.
    pub pattern: Pattern,
    /// Radiance that the surface gives off by itself, times its pattern; 0 for most.
    pub emission: f32,
    /// What becomes of a ray at it.
    pub optics: Optics,
}

/// What becomes of a ray at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optics {
    /// It ends.
    Opaque,
    /// It is reflected, tinted by the surface's colour.
    Mirror,
    /// It goes on as it came, tinted by the surface's colour.
    Glass,
}

/// How the colour varies over a solid.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Nothing.
    #[default]
    Plain,
    /// Wood grain along the longest side.
    Wood,
    /// Floor boards along x.
    Planks,
    /// A bordered rug with diamonds.
    Rug,
    /// Two stripes across y.
    Stripes,
    /// A framed sunset over hills.
    Sunset,
    /// A framed composition of discs.
    Discs,
    /// A framed grid of colour fields.
    Fields,
    /// A book's spine with a title band.
    Spine,
    /// Sky and trees behind a pane.
    Outside,
}

/// Linear values of the 8-bit display values.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|value| (value as f32 / 255.0).powf(2.2)));

/// A linear colour from sRGB 0xRRGGBB.
pub fn srgb(hex: u32) -> Vec3A {
    let [_, r, g, b] = hex.to_be_bytes().map(|channel| LINEAR[usize::from(channel)]);
    Vec3A::new(r, g, b)
}

impl Material {
    /// One colour everywhere.
    pub fn plain(color: Vec3A) -> Self {
        Self::patterned(color, Pattern::Plain)
    }

    /// A colour with a pattern.
    pub fn patterned(color: Vec3A, pattern: Pattern) -> Self {
        Self {
            color,
            pattern,
            emission: 0.0,
            optics: Optics::Opaque,
        }
    }

    /// A surface of one colour that rays do not end at.
    pub fn passing(color: Vec3A, optics: Optics) -> Self {
        Self {
            optics,
            ..Self::plain(color)
        }
    }

    /// A surface that glows.
    pub fn glowing(color: Vec3A, pattern: Pattern, emission: f32) -> Self {
        Self {
            emission,
            ..Self::patterned(color, pattern)
        }
    }

    /// Whether light is held up. What glows lets it through, so that a lamp is not dark inside its shade.
    pub fn casts_shadow(&self) -> bool {
        self.emission == 0.0 && self.optics != Optics::Glass
    }

    /// Reflectance at a point of a solid, in the solid's own axes.
    pub fn albedo(&self, point: Vec3A, half: Vec3A) -> Vec3A {
        let relative = point / half;
        match self.pattern {
            Pattern::Plain => self.color,
            Pattern::Wood => self.color * wood(point, half),
            Pattern::Planks => self.color * planks(point),
            Pattern::Rug => rug(self.color, point, half),
            Pattern::Stripes => {
                let y = relative.y;
                let stripe = (-0.66..-0.56).contains(&y) || (-0.48..-0.44).contains(&y);
                if stripe { srgb(0xE8_DFC8) } else { self.color }
            }
            Pattern::Sunset => framed(self.color, point, half, sunset),
            Pattern::Discs => framed(self.color, point, half, discs),
            Pattern::Fields => framed(self.color, point, half, fields),
            Pattern::Spine => {
                let band = (0.45..0.62).contains(&relative.z) || (-0.8..-0.72).contains(&relative.z);
                if band {
                    0.5 * self.color + 0.5 * srgb(0xF2_E3B8)
                } else {
                    self.color
                }
            }
            Pattern::Outside => outside(relative),
        }
    }
}

/// Grain: noise stretched along the longest side.
fn wood(point: Vec3A, half: Vec3A) -> f32 {
    let along = half.max_position();
    let [first, second] = [[1, 2], [0, 2], [0, 1]][along];
    let across = point[first] + point[second];
    let rings = noise(Vec2::new(1.5 * point[along], 26.0 * across));
    0.82 + 0.3 * rings
}

/// Boards of 15 cm, shifted row by row, each with its own tint and grain.
fn planks(point: Vec3A) -> f32 {
    let row = (point.y / 0.15).floor();
    let along = point.x / 1.4 + 0.37 * row;
    let board = along.floor();
    let tint = hash(board as i32, row as i32);
    let grain = noise(Vec2::new(2.2 * point.x + 17.0 * tint, 45.0 * point.y));
    let across = (point.y / 0.15 - row).min(row + 1.0 - point.y / 0.15) * 0.15;
    let end = (along - board).min(board + 1.0 - along) * 1.4;
    let gap = if across.min(end) < 0.004 { 0.62 } else { 1.0 };
    gap * (0.74 + 0.34 * tint + 0.2 * grain)
}

fn rug(color: Vec3A, point: Vec3A, half: Vec3A) -> Vec3A {
    let cream = srgb(0xE9_DCC0);
    let navy = srgb(0x35_4A66);
    let edge = (half - point.abs()).truncate().min_element();
    if edge < 0.05 || (0.13..0.16).contains(&edge) {
        return navy;
    }
    if edge < 0.13 {
        return cream;
    }
    let cell = 0.24;
    let centred = |v: f32| ((v / cell + 0.5).rem_euclid(1.0) - 0.5).abs();
    let diamond = centred(point.x) + centred(point.y);
    if diamond < 0.16 {
        cream
    } else if diamond < 0.3 {
        navy
    } else {
        color
    }
}

/// A frame and a mat around `paint`, which gets positions -1..=1 (right, up).
fn framed(frame: Vec3A, point: Vec3A, half: Vec3A, paint: fn(Vec2) -> Vec3A) -> Vec3A {
    let edge = (half.x - point.x.abs()).min(half.z - point.z.abs());
    if edge < 0.025 {
        frame
    } else if edge < 0.06 {
        srgb(0xF1_EEE6)
    } else {
        paint(Vec2::new(-point.x / (half.x - 0.06), point.z / (half.z - 0.06)))
    }
}

fn sunset(at: Vec2) -> Vec3A {
    let hills = -0.35 + 0.16 * (3.1 * at.x + 0.6).sin() + 0.07 * (7.3 * at.x).sin();
    let near = -0.68 + 0.12 * (2.3 * at.x + 2.4).sin();
    if at.y < near {
        srgb(0x23_3A44)
    } else if at.y < hills {
        srgb(0x4B_6670)
    } else if at.distance(Vec2::new(0.3, 0.05)) < 0.24 {
        srgb(0xFB_E3A1)
    } else {
        srgb(0xE8_8A5B).lerp(srgb(0x6C_7FA8), 0.5 + 0.5 * at.y)
    }
}

fn discs(at: Vec2) -> Vec3A {
    const DISCS: [(f32, f32, f32, u32); 5] = [
        (-0.35, 0.3, 0.42, 0xC9_5B42),
        (0.35, 0.5, 0.26, 0xE0_B04C),
        (0.3, -0.25, 0.48, 0x3C_6E71),
        (-0.45, -0.55, 0.25, 0x2E_3F57),
        (0.05, 0.05, 0.16, 0xF0_E2C8),
    ];
    let covers = |&&(x, y, radius, _): &&(f32, f32, f32, u32)| at.distance(Vec2::new(x, y)) < radius;
    DISCS
        .iter()
        .rev()
        .find(covers)
        .map_or(srgb(0xEA_DFCB), |&(_, _, _, color)| srgb(color))
}

fn fields(at: Vec2) -> Vec3A {
    let columns = [-0.3, 0.45];
    let rows = [-0.45, 0.25];
    let near_line = |v: f32, lines: [f32; 2]| lines.iter().any(|line| (v - line).abs() < 0.04);
    if near_line(at.x, columns) || near_line(at.y, rows) {
        return srgb(0x22_2222);
    }
    let index = |v: f32, lines: [f32; 2]| lines.iter().filter(|&&line| v > line).count();
    const COLORS: [[u32; 3]; 3] = [
        [0x2F_5D9B, 0xF0_ECE0, 0xD8_B23C],
        [0xF0_ECE0, 0xC2_4434, 0xF0_ECE0],
        [0xD8_B23C, 0xF0_ECE0, 0x2F_5D9B],
    ];
    srgb(COLORS[index(at.y, rows)][index(at.x, columns)])
}

/// Sky, a far line of trees and a lawn: painted on the pane, so that its depth is the pane's.
fn outside(relative: Vec3A) -> Vec3A {
    let trees = -0.38 + 0.2 * noise(Vec2::new(5.0 * relative.x + 3.0, 0.5));
    if relative.z < -0.72 {
        srgb(0xA9_C08A)
    } else if relative.z < trees {
        srgb(0x7F_A07C)
    } else {
        srgb(0xF2_F4EE).lerp(srgb(0x9C_C4EA), 0.5 + 0.5 * relative.z)
    }
}

/// A repeatable number 0..1 for a pair of integers.
pub(super) fn hash(x: i32, y: i32) -> f32 {
    let mut bits = (x as u32)
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add((y as u32).wrapping_mul(0x85EB_CA77));
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x2C1B_3C6D);
    bits ^= bits >> 12;
    bits = bits.wrapping_mul(0x297A_2D39);
    bits ^= bits >> 15;
    (bits >> 8) as f32 / (1 << 24) as f32
}

/// Smooth value noise, 0..=1, with features of size one.
fn noise(at: Vec2) -> f32 {
    let cell = at.floor();
    let f = at - cell;
    let f = f * f * (3.0 - 2.0 * f);
    let (x, y) = (cell.x as i32, cell.y as i32);
    let lower = hash(x, y) + f.x * (hash(x + 1, y) - hash(x, y));
    let upper = hash(x, y + 1) + f.x * (hash(x + 1, y + 1) - hash(x, y + 1));
    lower + f.y * (upper - lower)
}
