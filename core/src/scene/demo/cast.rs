//! Ray casting: the room's shell, and a bounding-volume hierarchy over what stands in it.

use glam::Vec3A;

use super::solid::Solid;
use crate::labels::ClassId;

/// Where a ray ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Distance along the ray, in metres.
    pub distance: f32,
    /// Index of the solid.
    pub solid: usize,
}

/// A closed room that answers rays.
///
/// The first six solids are its shell, in the order of the faces -x, +x, -y, +y, -z, +z: every ray from
/// inside ends at one of them unless something stands in front.
pub(super) struct Caster {
    pub solids: Vec<Solid>,
    pub min: Vec3A,
    pub max: Vec3A,
    /// Parts of solids that are of another class than the rest.
    pub zones: Vec<Zone>,
    bounds: Vec<(Vec3A, Vec3A)>,
    nodes: Vec<Node>,
    /// Indices into `solids`, leaf after leaf.
    order: Vec<usize>,
}

/// A box in which the solids of one class are of another one.
#[derive(Clone, Copy, Debug)]
pub struct Zone {
    /// The class of the solids.
    pub of: ClassId,
    /// What they are inside; void where nobody could tell.
    pub class: ClassId,
    /// Lower corner, in metres.
    pub min: Vec3A,
    /// Upper corner, in metres.
    pub max: Vec3A,
}

struct Node {
    min: Vec3A,
    max: Vec3A,
    /// A leaf: where its solids start in `order`. An inner node: its second child (the first follows it).
    link: usize,
    /// Number of solids of a leaf; 0 = inner node.
    count: usize,
}

/// Number of faces of a room: -x, +x, -y, +y, -z, +z.
pub const SHELL: usize = 6;
const LEAF: usize = 3;

impl Caster {
    /// Prepares a room with inner corners `min` and `max`.
    pub fn new(solids: Vec<Solid>, min: Vec3A, max: Vec3A) -> Self {
        let mut order: Vec<usize> = (SHELL..solids.len()).collect();
        let bounds: Vec<(Vec3A, Vec3A)> = solids.iter().map(Solid::bounds).collect();
        let mut nodes = Vec::new();
        let count = order.len();
        build(&bounds, &mut order, 0, count, &mut nodes);
        Self {
            solids,
            min,
            max,
            zones: Vec::new(),
            bounds,
            nodes,
            order,
        }
    }

    /// First solid along a ray of unit direction that starts inside the room.
    pub fn cast(&self, origin: Vec3A, direction: Vec3A) -> Hit {
        let direction = without_zeros(direction);
        let inverse = direction.recip();
        let exit = ((self.min - origin) * inverse).max((self.max - origin) * inverse);
        let axis = exit.min_position();
        let mut hit = Hit {
            distance: exit[axis],
            solid: 2 * axis + usize::from(direction[axis] > 0.0),
        };
        self.visit(origin, inverse, hit.distance, |solid| {
            if let Some(distance) = self.solids[solid].intersect(origin, direction, hit.distance) {
                hit = Hit { distance, solid };
            }
            hit.distance
        });
        hit
    }

    /// Class of a solid at a point of its surface.
    pub fn class(&self, solid: usize, point: Vec3A) -> ClassId {
        let class = self.solids[solid].class;
        let own =
            |zone: &&Zone| zone.of == class && point.cmpge(zone.min).all() && point.cmple(zone.max).all();
        self.zones.iter().find(own).map_or(class, |zone| zone.class)
    }

    /// Whether anything that casts a shadow lies on a ray before `limit` metres.
    pub fn blocked(&self, origin: Vec3A, direction: Vec3A, limit: f32) -> bool {
        let direction = without_zeros(direction);
        let mut blocked = false;
        self.visit(origin, direction.recip(), limit, |index| {
            let solid = &self.solids[index];
            if solid.material.casts_shadow() && solid.intersect(origin, direction, limit).is_some() {
                blocked = true;
                return 0.0;
            }
            limit
        });
        blocked
    }

    /// Whether a point is inside a solid other than `except`, or outside the room.
    pub fn buried(&self, point: Vec3A, except: usize) -> bool {
        let within = |min: Vec3A, max: Vec3A| point.cmpge(min).all() && point.cmple(max).all();
        !within(self.min, self.max)
            || self
                .bounds
                .iter()
                .enumerate()
                .skip(SHELL)
                .any(|(index, &(min, max))| {
                    index != except && within(min, max) && self.solids[index].contains(point)
                })
    }

    /// Calls `test` for the solids near a ray; it returns the distance from which nothing matters any more.
    fn visit(&self, origin: Vec3A, inverse: Vec3A, mut limit: f32, mut test: impl FnMut(usize) -> f32) {
        let enters = |node: &Node, limit: f32| {
            let (a, b) = ((node.min - origin) * inverse, (node.max - origin) * inverse);
            let near = a.min(b).max_element();
            let far = a.max(b).min_element();
            near <= far && far >= 0.0 && near <= limit
        };
        let mut stack = [0_usize; 32];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index];
            if !enters(node, limit) {
                continue;
            }
            if node.count == 0 {
                stack[depth] = node.link;
                stack[depth + 1] = index + 1;
                depth += 2;
            } else {
                for &solid in &self.order[node.link..node.link + node.count] {
                    limit = test(solid);
                }
            }
        }
    }
}

/// Appends the hierarchy over `order[start..end]`, split at the median of the widest axis.
fn build(bounds: &[(Vec3A, Vec3A)], order: &mut [usize], start: usize, end: usize, nodes: &mut Vec<Node>) {
    let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    let (mut first, mut last) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for &solid in &order[start..end] {
        let (low, high) = bounds[solid];
        min = min.min(low);
        max = max.max(high);
        first = first.min(low + high);
        last = last.max(low + high);
    }
    let index = nodes.len();
    let count = end - start;
    nodes.push(Node {
        min: min - 1e-4,
        max: max + 1e-4,
        link: start,
        count,
    });
    if count <= LEAF {
        return;
    }
    let axis = (last - first).max_position();
    order[start..end].sort_by(|&a, &b| {
        let middle = |solid: usize| bounds[solid].0[axis] + bounds[solid].1[axis];
        middle(a).total_cmp(&middle(b))
    });
    let split = start + count / 2;
    build(bounds, order, start, split, nodes);
    nodes[index].link = nodes.len();
    nodes[index].count = 0;
    build(bounds, order, split, end, nodes);
}

/// Keeps reciprocals finite: a component of exactly zero would make 0 * infinity at a face.
fn without_zeros(direction: Vec3A) -> Vec3A {
    Vec3A::select(
        direction.abs().cmplt(Vec3A::splat(1e-9)),
        Vec3A::splat(1e-9),
        direction,
    )
}
