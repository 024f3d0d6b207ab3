//! Pictures of the room.

use std::sync::LazyLock;

use glam::{DAffine3, Vec3A};

use super::cast::{Caster, Hit};
use super::light::LightMap;
use super::material::Optics;
use crate::labels::ClassId;
use crate::scene::Camera;

/// Rays of a camera in a room.
pub(super) struct View<'a> {
    pub caster: &'a Caster,
    pub camera: Camera,
    /// Camera to the room's axes.
    pub camera_to_room: DAffine3,
}

/// What a ray shows in the end: what is behind glass, or in a mirror.
struct Sight {
    solid: usize,
    /// Where, in the room.
    point: Vec3A,
    /// All the way there, in metres.
    length: f32,
    /// What is left of the light on that way.
    tint: Vec3A,
}

/// What the centre of a pixel shows.
#[derive(Clone, Copy)]
struct Shade {
    solid: usize,
    chart: usize,
    /// Display colour, 0..=1 each.
    color: Vec3A,
}

/// Offsets of the extra samples of an edge pixel (a rotated grid).
const SUBPIXELS: [(f32, f32); 4] = [(-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125)];
/// Mirrors and panes that a ray meets, at most.
const PASSED: usize = 4;
/// How far beyond a surface its way goes on, in metres.
const LIFT: f32 = 1e-4;
/// Difference of display colours beyond which a pixel is an edge.
const CONTRAST: f32 = 0.04;

impl View<'_> {
    /// First surface at an image position, and the unit direction of its ray.
    fn cast(&self, x: f32, y: f32) -> (Hit, Vec3A) {
        let rotation = self.camera_to_room.matrix3.as_mat3();
        let direction = (rotation * self.camera.direction(x, y)).normalize().into();
        (self.caster.cast(self.eye(), direction), direction)
    }

    fn eye(&self) -> Vec3A {
        self.camera_to_room.translation.as_vec3a()
    }

    /// First surface at the centre of a pixel.
    pub fn hit(&self, index: usize) -> Hit {
        let (x, y) = self.camera.center_of(index);
        self.cast(x, y).0
    }

    /// Classes at the pixel centres, row-major `[height, width]`: of the first surface, be it a mirror or glass.
    pub fn labels(&self) -> Vec<ClassId> {
        self.objects().into_iter().map(|(class, _)| class).collect()
    }

    /// The same with the objects of the room.
    pub fn objects(&self) -> Vec<(ClassId, u16)> {
        (0..self.camera.pixels())
            .map(|index| {
                let (x, y) = self.camera.center_of(index);
                let (hit, direction) = self.cast(x, y);
                let point = self.eye() + hit.distance * direction;
                let object = self.caster.solids[hit.solid].object;
                (self.caster.class(hit.solid, point), object)
            })
            .collect()
    }

    /// Follows a ray by way of mirrors and through glass.
    fn sight(&self, x: f32, y: f32) -> Sight {
        let (mut hit, mut direction) = self.cast(x, y);
        let mut sight = Sight {
            solid: hit.solid,
            point: self.eye() + hit.distance * direction,
            length: hit.distance,
            tint: Vec3A::ONE,
        };
        for _ in 0..PASSED {
            let solid = &self.caster.solids[hit.solid];
            match solid.material.optics {
                Optics::Opaque => break,
                Optics::Mirror => {
                    let (chart, position) = solid.chart_at(solid.local(sight.point));
                    let normal = solid.chart_point(chart, position).1;
                    direction -= 2.0 * direction.dot(normal) * normal;
                }
                Optics::Glass => {}
            }
            sight.tint *= solid.material.color;
            hit = self.caster.cast(sight.point + LIFT * direction, direction);
            sight.solid = hit.solid;
            sight.point += (LIFT + hit.distance) * direction;
            sight.length += LIFT + hit.distance;
        }
        sight
    }

    fn shade(&self, light: &LightMap, x: f32, y: f32) -> (Shade, f32) {
        let sight = self.sight(x, y);
        let solid = &self.caster.solids[sight.solid];
        let point = solid.local(sight.point);
        let (chart, position) = solid.chart_at(point);
        let radiance = solid.material.albedo(point, solid.half)
            * (light.at(sight.solid, chart, position) + solid.material.emission);
        let shade = Shade {
            solid: sight.solid,
            chart,
            color: display(sight.tint * radiance),
        };
        (shade, sight.length)
    }

    /// Colours (8-bit sRGB, `[height, width, 3]`) and ray lengths (metres, `[height, width]`).
    ///
    /// Ray lengths are those of the pixel centres; colours are averaged where a pixel differs from a
    /// neighbour, so that edges are smooth.
    pub fn render(&self, light: &LightMap) -> (Vec<u8>, Vec<f32>) {
        let (shades, lengths): (Vec<Shade>, Vec<f32>) = (0..self.camera.pixels())
            .map(|index| {
                let (x, y) = self.camera.center_of(index);
                self.shade(light, x, y)
            })
            .unzip();
        let mut bytes = Vec::with_capacity(3 * shades.len());
        for (index, shade) in shades.iter().enumerate() {
            let mut color = shade.color;
            if self.is_edge(&shades, index) {
                let (x, y) = self.camera.center_of(index);
                for (dx, dy) in SUBPIXELS {
                    color += self.shade(light, x + dx, y + dy).0.color;
                }
                color /= 1.0 + SUBPIXELS.len() as f32;
            }
            bytes.extend(color.to_array().map(|v| (v * 255.0).round() as u8));
        }
        (bytes, lengths)
    }

    fn is_edge(&self, shades: &[Shade], index: usize) -> bool {
        let here = shades[index];
        self.camera.beside(index).any(|other| {
            let there = shades[other];
            there.solid != here.solid
                || there.chart != here.chart
                || (there.color - here.color).abs().max_element() > CONTRAST
        })
    }
}

/// Steps of the display curve for one unit of radiance.
const CURVE_STEPS: f32 = 1024.0;
/// Display values of radiances 0, 1 / [`CURVE_STEPS`], ...: exposure, a soft shoulder, gamma 2.2.
static CURVE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let display = |step: u32| (1.0 - (-1.55 * step as f32 / CURVE_STEPS).exp()).powf(1.0 / 2.2);
    (0..4096).map(display).collect()
});

/// Radiance to display values 0..=1.
fn display(radiance: Vec3A) -> Vec3A {
    let curve = &CURVE[..];
    let channel = |value: f32| {
        let position = (value * CURVE_STEPS).clamp(0.0, (curve.len() - 2) as f32);
        let below = position as usize;
        curve[below] + (position - below as f32) * (curve[below + 1] - curve[below])
    };
    Vec3A::new(channel(radiance.x), channel(radiance.y), channel(radiance.z))
}
