//! Convex solids, and the charts that unfold their surfaces.

use std::f32::consts::TAU;

use glam::{Mat3A, Vec2, Vec3A};

use super::material::Material;
use crate::labels::ClassId;

/// Number of charts of a solid's surface: the faces of a box, at most.
pub(super) const CHARTS: usize = 6;

/// The form of a solid within its half extents, in its own axes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Fills its extents.
    Block,
    /// A block whose edges and corners are rounded with this radius.
    Rounded(f32),
    /// Touches the middle of each face of its extents.
    Ellipsoid,
    /// A cylinder or cone along z with these radii at its lower and upper end.
    Frustum { bottom: f32, top: f32 },
}

/// A piece of the room.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub shape: Shape,
    /// Half extents along its own axes, in metres.
    pub half: Vec3A,
    /// Own axes to world axes.
    pub rotation: Mat3A,
    /// Centre in the world, in metres.
    pub center: Vec3A,
    pub material: Material,
    pub class: ClassId,
    /// Which object of its room it is part of.
    pub object: u16,
}

impl Solid {
    /// A world point in the solid's own axes.
    pub fn local(&self, point: Vec3A) -> Vec3A {
        self.rotation.transpose() * (point - self.center)
    }

    /// Corners of the axis-aligned box around it, in the world.
    pub fn bounds(&self) -> (Vec3A, Vec3A) {
        let reach = self.rotation.abs() * self.half;
        (self.center - reach, self.center + reach)
    }

    /// Distance to where a ray of unit direction enters, if nearer than `limit`.
    pub fn intersect(&self, origin: Vec3A, direction: Vec3A, limit: f32) -> Option<f32> {
        let to_local = self.rotation.transpose();
        let origin = to_local * (origin - self.center);
        let direction = to_local * direction;
        let distance = match self.shape {
            Shape::Block => slab(self.half, origin, direction).map(|(near, _)| near),
            Shape::Rounded(radius) => self.trace_rounded(radius, origin, direction),
            Shape::Ellipsoid => {
                let (o, d) = (origin / self.half, direction / self.half);
                let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
                let discriminant = b * b - a * c;
                (discriminant > 0.0).then(|| (-b - discriminant.sqrt()) / a)
            }
            Shape::Frustum { bottom, top } => self.intersect_frustum(bottom, top, origin, direction),
        }?;
        (distance > 1e-5 && distance < limit).then_some(distance)
    }

    /// Sphere tracing; exact in the limit because a rounded block is convex.
    fn trace_rounded(&self, radius: f32, origin: Vec3A, direction: Vec3A) -> Option<f32> {
        let (near, far) = slab(self.half, origin, direction)?;
        let mut t = near.max(0.0);
        for _ in 0..64 {
            let q = (origin + t * direction).abs() - (self.half - radius);
            let distance = q.max(Vec3A::ZERO).length() + q.max_element().min(0.0) - radius;
            if distance < 1e-5 {
                return Some(t);
            }
            t += distance;
            if t > far {
                return None;
            }
        }
        None
    }

    fn intersect_frustum(&self, bottom: f32, top: f32, o: Vec3A, d: Vec3A) -> Option<f32> {
        let height = self.half.z;
        let mut nearest = f32::INFINITY;
        let mut offer = |t: f32, valid: bool| {
            if valid && t > 1e-5 && t < nearest {
                nearest = t;
            }
        };
        // The side, x^2 + y^2 = (middle + slope z)^2.
        let (middle, slope) = (0.5 * (bottom + top), 0.5 * (top - bottom) / height);
        let radius = middle + slope * o.z;
        let a = d.x * d.x + d.y * d.y - (slope * d.z).powi(2);
        let b = o.x * d.x + o.y * d.y - slope * d.z * radius;
        let c = o.x * o.x + o.y * o.y - radius * radius;
        let discriminant = b * b - a * c;
        if discriminant > 0.0 && a.abs() > 1e-9 {
            let root = discriminant.sqrt();
            for t in [(-b - root) / a, (-b + root) / a] {
                let z = o.z + t * d.z;
                offer(t, z.abs() <= height && middle + slope * z >= 0.0);
            }
        }
        for (z, radius) in [(-height, bottom), (height, top)] {
            let t = (z - o.z) / d.z;
            let (x, y) = (o.x + t * d.x, o.y + t * d.y);
            offer(t, x * x + y * y <= radius * radius);
        }
        nearest.is_finite().then_some(nearest)
    }

    /// Whether a world point is inside.
    pub fn contains(&self, point: Vec3A) -> bool {
        let p = self.local(point);
        match self.shape {
            Shape::Block => p.abs().cmple(self.half).all(),
            Shape::Rounded(radius) => {
                let q = (p.abs() - (self.half - radius)).max(Vec3A::ZERO);
                q.length() <= radius
            }
            Shape::Ellipsoid => (p / self.half).length_squared() <= 1.0,
            Shape::Frustum { bottom, top } => {
                let radius = bottom + (top - bottom) * 0.5 * (p.z / self.half.z + 1.0);
                p.z.abs() <= self.half.z && p.truncate().length_squared() <= radius * radius
            }
        }
    }

    /// Chart and position in it, each coordinate 0..=1, of a surface point in the solid's own axes.
    pub fn chart_at(&self, point: Vec3A) -> (usize, Vec2) {
        if let Shape::Frustum { bottom, top } = self.shape {
            let relative = point.z / self.half.z;
            let radius = bottom + (top - bottom) * 0.5 * (relative + 1.0);
            let across = point.truncate();
            if relative.abs() > 0.999 && across.length() < 0.999 * radius {
                return (if relative > 0.0 { 2 } else { 1 }, 0.5 + 0.5 * across / radius);
            }
            return (
                0,
                Vec2::new(
                    (across.y.atan2(across.x) / TAU).rem_euclid(1.0),
                    0.5 + 0.5 * relative,
                ),
            );
        }
        let mut relative = point / self.half;
        let size = relative.abs();
        let axis = size.max_position();
        let side = usize::from(relative[axis] > 0.0);
        if matches!(self.shape, Shape::Ellipsoid) {
            relative /= size[axis];
        }
        let across = Vec2::new(relative[(axis + 1) % 3], relative[(axis + 2) % 3]);
        (2 * axis + side, 0.5 + 0.5 * across)
    }

    /// Surface point and outward unit normal, in the world, at a position in a chart.
    pub fn chart_point(&self, chart: usize, position: Vec2) -> (Vec3A, Vec3A) {
        let across = 2.0 * position - 1.0;
        let (point, normal) = match self.shape {
            Shape::Frustum { bottom, top } => {
                let height = self.half.z;
                match chart {
                    0 => {
                        let (sin, cos) = (position.x * TAU).sin_cos();
                        let radius = bottom + (top - bottom) * position.y;
                        let slope = 0.5 * (top - bottom) / height;
                        (
                            Vec3A::new(radius * cos, radius * sin, across.y * height),
                            Vec3A::new(cos, sin, -slope).normalize(),
                        )
                    }
                    1 => ((across * bottom).extend(-height).into(), Vec3A::NEG_Z),
                    _ => ((across * top).extend(height).into(), Vec3A::Z),
                }
            }
            _ => {
                let (axis, sign) = (chart / 2, if chart % 2 == 1 { 1.0 } else { -1.0 });
                let mut relative = Vec3A::ZERO;
                relative[axis] = sign;
                relative[(axis + 1) % 3] = across.x;
                relative[(axis + 2) % 3] = across.y;
                match self.shape {
                    Shape::Ellipsoid => {
                        let unit = relative.normalize();
                        (unit * self.half, (unit / self.half).normalize())
                    }
                    Shape::Rounded(radius) => {
                        let outer = relative * self.half;
                        let inner = self.half - radius;
                        let core = outer.clamp(-inner, inner);
                        let normal = (outer - core).normalize_or(Vec3A::Z);
                        (core + radius * normal, normal)
                    }
                    _ => {
                        let mut normal = Vec3A::ZERO;
                        normal[axis] = sign;
                        (relative * self.half, normal)
                    }
                }
            }
        };
        (self.center + self.rotation * point, self.rotation * normal)
    }

    /// Width and height of a chart, in metres; zero where the solid has no such chart.
    pub fn chart_size(&self, chart: usize) -> Vec2 {
        match self.shape {
            Shape::Frustum { bottom, top } => match chart {
                0 => Vec2::new(TAU * bottom.max(top), 2.0 * self.half.z),
                1 => Vec2::splat(2.0 * bottom),
                2 => Vec2::splat(2.0 * top),
                _ => Vec2::ZERO,
            },
            _ => {
                let axis = chart / 2;
                2.0 * Vec2::new(self.half[(axis + 1) % 3], self.half[(axis + 2) % 3])
            }
        }
    }

    /// Whether the left and right edges of a chart are the same line of the surface.
    pub fn chart_wraps(&self, chart: usize) -> bool {
        chart == 0 && matches!(self.shape, Shape::Frustum { .. })
    }
}

/// Where a ray enters and leaves a block around the origin.
fn slab(half: Vec3A, origin: Vec3A, direction: Vec3A) -> Option<(f32, f32)> {
    let inverse = direction.recip();
    let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
    let near = a.min(b).max_element();
    let far = a.max(b).min_element();
    (near <= far).then_some((near, far))
}

#[cfg(test)]
mod tests {
    use super::super::material::{Material, srgb};
    use super::*;

    #[test]
    fn a_ray_at_a_chart_point_hits_that_point_and_finds_its_chart() {
        let shapes = [
            Shape::Block,
            Shape::Rounded(0.1),
            Shape::Ellipsoid,
            Shape::Frustum {
                bottom: 0.3,
                top: 0.2,
            },
        ];
        for shape in shapes {
            let solid = Solid {
                shape,
                half: Vec3A::new(0.3, 0.3, 0.5),
                rotation: Mat3A::from_rotation_x(0.4) * Mat3A::from_rotation_z(1.1),
                center: Vec3A::new(1.0, 2.0, 0.7),
                material: Material::plain(srgb(0xFF_FFFF)),
                class: 1,
                object: 0,
            };
            for chart in 0..CHARTS {
                if solid.chart_size(chart) == Vec2::ZERO {
                    continue;
                }
                let position = Vec2::new(0.62, 0.41);
                let (point, normal) = solid.chart_point(chart, position);
                let distance = solid.intersect(point + 2.0 * normal, -normal, 10.0);
                assert!(
                    distance.is_some_and(|d| (d - 2.0).abs() < 1e-3),
                    "{shape:?} {chart} {distance:?}"
                );
                let (found, at) = solid.chart_at(solid.local(point));
                assert_eq!(found, chart, "{shape:?}");
                assert!(at.distance(position) < 1e-3, "{shape:?} {at}");
                assert!(solid.contains(point - 0.01 * normal) && !solid.contains(point + 0.01 * normal));
            }
        }
    }
}
