//! Placing solids in the room.

use glam::{Mat3, Quat, Vec3, Vec3A};

use super::light::Bulb;
use super::material::Material;
use super::solid::{Shape, Solid};
use crate::labels::ClassId;

/// A piece of furniture's own axes: x along it, y to its front, z up, standing on the floor.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    origin: Vec3,
    rotation: Mat3,
}

impl Place {
    /// Stands at (x, y) in the room, turned about z by `degrees`.
    pub fn new(x: f32, y: f32, degrees: f32) -> Self {
        Self {
            origin: Vec3::new(x, y, 0.0),
            rotation: Mat3::from_rotation_z(degrees.to_radians()),
        }
    }

    /// A place inside this one, turned further.
    pub fn inner(&self, offset: [f32; 3], degrees: f32) -> Self {
        Self {
            origin: self.point(offset),
            rotation: self.rotation * Mat3::from_rotation_z(degrees.to_radians()),
        }
    }

    /// A point in the room.
    pub fn point(&self, own: [f32; 3]) -> Vec3 {
        self.origin + self.rotation * Vec3::from(own)
    }

    /// A direction in the room.
    pub fn direction(&self, own: [f32; 3]) -> Vec3 {
        self.rotation * Vec3::from(own)
    }
}

/// What solids of a piece of furniture share: class, material, and the axes that their corners and points are in.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a>(pub ClassId, pub Material, pub &'a Place);

impl Part<'_> {
    fn push(&self, builder: &mut Builder, shape: Shape, half: Vec3, center: Vec3, rotation: Mat3) {
        builder.solids.push(Solid {
            shape,
            half: half.into(),
            rotation: rotation.into(),
            center: center.into(),
            material: self.1,
            class: self.0,
            object: builder.object,
        });
    }

    /// A block between two corners.
    pub fn block(&self, builder: &mut Builder, min: [f32; 3], max: [f32; 3]) {
        self.between(builder, Shape::Block, min, max);
    }

    /// A block with rounded edges between two corners.
    pub fn soft(&self, builder: &mut Builder, min: [f32; 3], max: [f32; 3], radius: f32) {
        self.between(builder, Shape::Rounded(radius), min, max);
    }

    fn between(&self, builder: &mut Builder, shape: Shape, min: [f32; 3], max: [f32; 3]) {
        let (min, max) = (Vec3::from(min), Vec3::from(max));
        let center = self.2.point((0.5 * (min + max)).to_array());
        self.push(builder, shape, 0.5 * (max - min), center, self.2.rotation);
    }

    /// An upright cylinder or cone with the middle of its lower end at `base`; radii at its lower and upper end.
    pub fn column(&self, builder: &mut Builder, base: [f32; 3], [bottom, top]: [f32; 2], height: f32) {
        let [x, y, z] = base;
        let radius = bottom.max(top);
        let half = Vec3::new(radius, radius, 0.5 * height);
        let center = self.2.point([x, y, z + 0.5 * height]);
        let shape = Shape::Frustum { bottom, top };
        self.push(builder, shape, half, center, self.2.rotation);
    }

    /// A thin cylinder from one point to another.
    pub fn rod(&self, builder: &mut Builder, from: [f32; 3], to: [f32; 3], radius: f32) {
        let (from, to) = (self.2.point(from), self.2.point(to));
        let rotation = Mat3::from_quat(Quat::from_rotation_arc(Vec3::Z, (to - from).normalize()));
        let half = Vec3::new(radius, radius, 0.5 * from.distance(to));
        let shape = Shape::Frustum {
            bottom: radius,
            top: radius,
        };
        self.push(builder, shape, half, 0.5 * (from + to), rotation);
    }

    /// A cushion around `center`, leaning back by `lean` degrees and turned by `turn`.
    pub fn cushion(&self, builder: &mut Builder, center: [f32; 3], half: [f32; 3], (lean, turn): (f32, f32)) {
        let rotation = self.2.rotation
            * Mat3::from_rotation_z(turn.to_radians())
            * Mat3::from_rotation_x(lean.to_radians());
        let half = Vec3::from(half);
        let shape = Shape::Rounded(0.94 * half.min_element());
        self.push(builder, shape, half, self.2.point(center), rotation);
    }

    /// An ellipsoid, rotated in its place.
    pub fn ball(&self, builder: &mut Builder, center: [f32; 3], half: [f32; 3], rotation: Mat3) {
        let (center, rotation) = (self.2.point(center), self.2.rotation * rotation);
        self.push(builder, Shape::Ellipsoid, half.into(), center, rotation);
    }
}

/// Collects the solids and lamps of a room. Corners and points are in metres, in the axes of a [`Place`].
#[derive(Debug, Default)]
pub struct Builder {
    pub(super) solids: Vec<Solid>,
    pub(super) bulbs: Vec<Bulb>,
    /// Number of the object that solids belong to.
    pub(super) object: u16,
}

impl Builder {
    /// A light inside a shade.
    pub(super) fn bulb(&mut self, place: &Place, center: [f32; 3], radius: f32, power: f32) {
        self.bulbs.push(Bulb {
            center: place.point(center).into(),
            radius,
            intensity: power * Vec3A::new(1.0, 0.82, 0.6),
        });
    }
}
