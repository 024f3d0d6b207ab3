//! Light, computed once for the surfaces and then only looked up: soft shadows from the window and the
//! lamps, and one bounce between the surfaces.

use glam::{Vec2, Vec3A};
use rayon::prelude::*;

use super::cast::{Caster, SHELL};
use super::solid::CHARTS;

/// Side of a light texel, in metres.
const TEXEL: f32 = 0.055;
/// Samples of the window, across and up.
const PANE_GRID: (u32, u32) = (5, 4);
/// Directions of the bounce.
const BOUNCE_RAYS: u32 = 40;
/// Light that has bounced more than once.
const AMBIENT: Vec3A = Vec3A::new(0.155, 0.15, 0.14);
/// Distance from a surface at which rays start, in metres.
const LIFT: f32 = 1e-3;

/// A glowing rectangle; lengths in metres.
#[derive(Clone, Copy, Debug)]
pub struct Pane {
    /// Its middle.
    pub center: Vec3A,
    /// Half of its width, as a vector.
    pub across: Vec3A,
    /// Half of its height, as a vector.
    pub up: Vec3A,
    /// Unit direction into the room.
    pub facing: Vec3A,
    /// Light that it gives off, linear red, green and blue.
    pub radiance: Vec3A,
}

/// A glowing ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bulb {
    pub center: Vec3A,
    pub radius: f32,
    pub intensity: Vec3A,
}

/// Irradiance over pi at the texels of every chart of every solid.
pub(super) struct LightMap {
    charts: Vec<[Chart; CHARTS]>,
    texels: Vec<Vec3A>,
}

#[derive(Clone, Copy, Default)]
struct Chart {
    start: usize,
    width: usize,
    height: usize,
    wraps: bool,
}

/// A texel's place on its surface.
struct Site {
    point: Vec3A,
    normal: Vec3A,
}

impl LightMap {
    /// Lights a room.
    pub fn new(caster: &Caster, panes: &[Pane], bulbs: &[Bulb]) -> Self {
        let (charts, sites) = unfold(caster);
        let lit = |light: &(dyn Fn(&Site) -> Vec3A + Sync)| -> Vec<Option<Vec3A>> {
            sites.par_iter().map(|site| site.as_ref().map(light)).collect()
        };
        let direct = lit(&|site| direct_light(caster, panes, bulbs, site));
        let mut map = Self {
            charts,
            texels: Vec::new(),
        };
        map.texels = map.spread(direct, false);
        let directions = hemisphere(BOUNCE_RAYS);
        let bounced = lit(&|site| map.bounced_light(caster, site, &directions));
        let bounced = map.spread(bounced, true);
        for (texel, bounced) in map.texels.iter_mut().zip(bounced) {
            *texel += bounced;
        }
        map
    }

    /// Irradiance over pi at a surface point in the solid's own axes, between texels linearly.
    pub fn at(&self, solid: usize, chart: usize, position: Vec2) -> Vec3A {
        let chart = &self.charts[solid][chart];
        if chart.width == 0 || chart.height == 0 {
            return AMBIENT;
        }
        let x = position.x * chart.width as f32 - 0.5;
        let y = (position.y * chart.height as f32 - 0.5).clamp(0.0, (chart.height - 1) as f32);
        let column = |x: f32| {
            if chart.wraps {
                (x as i64).rem_euclid(chart.width as i64) as usize
            } else {
                x.clamp(0.0, (chart.width - 1) as f32) as usize
            }
        };
        let (left, lower) = (x.floor(), y as usize);
        let upper = (lower + 1).min(chart.height - 1);
        let (a, b) = (column(left), column(left + 1.0));
        let texel = |column: usize, row: usize| self.texels[chart.start + row * chart.width + column];
        let below = texel(a, lower).lerp(texel(b, lower), x - left);
        let above = texel(a, upper).lerp(texel(b, upper), x - left);
        below.lerp(above, y - lower as f32)
    }

    /// Light that comes by way of another surface, with what is missing of further bounces.
    fn bounced_light(&self, caster: &Caster, site: &Site, directions: &[Vec3A]) -> Vec3A {
        let (tangent, bitangent) = site.normal.any_orthonormal_pair();
        let origin = site.point + LIFT * site.normal;
        let sum: Vec3A = directions
            .iter()
            .map(|local| {
                let direction = local.x * tangent + local.y * bitangent + local.z * site.normal;
                let hit = caster.cast(origin, direction);
                let solid = &caster.solids[hit.solid];
                let point = solid.local(origin + hit.distance * direction);
                let (chart, position) = solid.chart_at(point);
                // Surfaces close by see little themselves: a corner's darkness.
                let open = (hit.distance / 0.5).min(1.0);
                solid.material.albedo(point, solid.half) * self.at(hit.solid, chart, position)
                    + AMBIENT * (0.35 + 0.65 * open)
            })
            .sum();
        sum / directions.len() as f32
    }

    /// Texels inside other solids take the light of their neighbours, so that no darkness bleeds out; with
    /// `smooth`, the others are averaged with theirs as well.
    fn spread(&self, mut texels: Vec<Option<Vec3A>>, smooth: bool) -> Vec<Vec3A> {
        for chart in self.charts.iter().flatten() {
            let range = chart.start..chart.start + chart.width * chart.height;
            for _ in 0..2 {
                let before = texels[range.clone()].to_vec();
                for (index, texel) in texels[range.clone()].iter_mut().enumerate() {
                    if smooth || texel.is_none() {
                        *texel = chart.mean_around(&before, index);
                    }
                }
            }
        }
        texels
            .into_iter()
            .map(|texel| texel.unwrap_or(0.3 * AMBIENT))
            .collect()
    }
}

impl Chart {
    /// Mean of the known texels among a texel and its eight neighbours.
    fn mean_around(&self, texels: &[Option<Vec3A>], index: usize) -> Option<Vec3A> {
        let (x, y) = (index % self.width, index / self.width);
        let (mut sum, mut count) = (Vec3A::ZERO, 0.0);
        for row in y.saturating_sub(1)..=(y + 1).min(self.height - 1) {
            for column in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                if let Some(texel) = texels[row * self.width + column] {
                    sum += texel;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }
}

/// Lays out the charts; texels that nobody can see have no site.
fn unfold(caster: &Caster) -> (Vec<[Chart; CHARTS]>, Vec<Option<Site>>) {
    let mut all = Vec::with_capacity(caster.solids.len());
    let mut places = Vec::new();
    for (index, solid) in caster.solids.iter().enumerate() {
        let mut charts = [Chart::default(); CHARTS];
        for (number, chart) in charts.iter_mut().enumerate() {
            // Of the shell only the side that faces the room: opposite to the wall's own side.
            let unseen = index < SHELL && number != index ^ 1;
            let size = solid.chart_size(number);
            if unseen || size == Vec2::ZERO {
                continue;
            }
            let wraps = solid.chart_wraps(number);
            let count = |length: f32, least: f32| (length / TEXEL).ceil().clamp(least, 128.0) as usize;
            *chart = Chart {
                start: places.len(),
                width: count(size.x, if wraps { 8.0 } else { 2.0 }),
                height: count(size.y, 2.0),
                wraps,
            };
            for texel in 0..chart.width * chart.height {
                let column = (texel % chart.width) as f32 + 0.5;
                let row = (texel / chart.width) as f32 + 0.5;
                let position = Vec2::new(column / chart.width as f32, row / chart.height as f32);
                places.push((index, number, position));
            }
        }
        all.push(charts);
    }
    let sites = places
        .into_par_iter()
        .map(|(index, chart, position)| {
            let (point, normal) = caster.solids[index].chart_point(chart, position);
            let hidden = caster.buried(point + 2.0 * LIFT * normal, index);
            (!hidden).then_some(Site { point, normal })
        })
        .collect();
    (all, sites)
}

fn direct_light(caster: &Caster, panes: &[Pane], bulbs: &[Bulb], site: &Site) -> Vec3A {
    let origin = site.point + LIFT * site.normal;
    let mut sum = Vec3A::ZERO;
    for pane in panes {
        let (columns, rows) = PANE_GRID;
        let area = 4.0 * pane.across.length() * pane.up.length() / (columns * rows) as f32;
        for sample in 0..columns * rows {
            let x = ((sample % columns) as f32 + 0.5) / columns as f32 * 2.0 - 1.0;
            let y = ((sample / columns) as f32 + 0.5) / rows as f32 * 2.0 - 1.0;
            let offset = pane.center + x * pane.across + y * pane.up - origin;
            let distance = offset.length();
            let direction = offset / distance;
            let cosines = direction.dot(site.normal).max(0.0) * (-direction.dot(pane.facing)).max(0.0);
            if cosines > 0.0 && !caster.blocked(origin, direction, distance - 0.02) {
                let weight = area * cosines / (distance * distance).max(0.01);
                sum += pane.radiance * weight / std::f32::consts::PI;
            }
        }
    }
    for bulb in bulbs {
        const CORNERS: [Vec3A; 5] = [
            Vec3A::ZERO,
            Vec3A::new(1.0, 1.0, 1.0),
            Vec3A::new(-1.0, -1.0, 1.0),
            Vec3A::new(-1.0, 1.0, -1.0),
            Vec3A::new(1.0, -1.0, -1.0),
        ];
        for corner in CORNERS {
            let offset = bulb.center + 0.58 * bulb.radius * corner - origin;
            let distance = offset.length();
            let direction = offset / distance;
            let cosine = direction.dot(site.normal);
            if cosine > 0.0 && !caster.blocked(origin, direction, distance) {
                let weight = cosine / (distance * distance).max(0.04) / CORNERS.len() as f32;
                sum += bulb.intensity * weight;
            }
        }
    }
    sum
}

/// Directions around +z, denser near it by the cosine (Hammersley points on a disc, lifted).
fn hemisphere(count: u32) -> Vec<Vec3A> {
    (0..count)
        .map(|i| {
            let u = (i as f32 + 0.5) / count as f32;
            let v = i.reverse_bits() as f32 / 2.0_f32.powi(32);
            let (sin, cos) = (v * std::f32::consts::TAU).sin_cos();
            Vec3A::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt())
        })
        .collect()
}
