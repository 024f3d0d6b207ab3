//! The surface as a triangle mesh.
//!
//! The voxels are points with normals. The signed distance to them is that of implicit moving least squares (Kolluri
//! 2008): the mean of the distances to the points' tangent planes, weighted by (1 - r^2 / 4)^4 at r voxels as in
//! Guennebaud and Gross 2007, positive on the cameras' side. Its zero is found by surface nets (Gibson 1998): a vertex
//! in every cell of the voxel grid that the zero passes, at the mean of where it crosses the cell's edges, and a
//! quadrilateral around every edge that it crosses.

use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;

use super::{NearestNodes, Node, Surface};

/// How far a point counts, in voxels.
const SUPPORT: f32 = 2.0;
/// How far a vertex may be from the nearest node, in voxels: the signed distance is defined beyond the ends of the
/// surface too.
const MARGIN: f32 = 1.0;

/// A vertex of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshVertex {
    /// In metres, relative to the scene's origin.
    pub position: Vec3,
    /// The node of the surface that is nearest to it.
    pub node: u32,
}

/// A triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices.
    pub vertices: Vec<MeshVertex>,
    /// Three vertices each, counterclockwise as the cameras see them.
    pub triangles: Vec<[u32; 3]>,
}

/// Sums at a corner of the grid.
#[derive(Clone, Copy, Default)]
struct GridCorner {
    weight: f32,
    distance: f32,
}

/// Signed distances at the corners of the voxel grid, near the surface.
struct Distances {
    side: f32,
    corners: FxHashMap<IVec3, GridCorner>,
}

impl Mesh {
    /// The mesh of a surface, without the shell around the scene. Things thinner than about two voxels may be torn,
    /// since points on both of their sides count.
    pub fn of_surface(surface: &Surface) -> Self {
        let nodes = surface.graph.nodes();
        let distances = Distances::of(
            nodes.iter().filter(|node| !surface.is_on_shell(node)),
            surface.voxel,
        );
        let nearest = NearestNodes::new(surface);
        let mut cells: Vec<(IVec3, MeshVertex)> = distances
            .corners
            .keys()
            .filter_map(|&cell| {
                let position = distances.crossing(cell)?;
                let node = nearest.nearest(position, MARGIN * surface.voxel)?;
                Some((cell, MeshVertex { position, node }))
            })
            .collect();
        // A fixed order, whatever order the table has.
        cells.sort_by_key(|(cell, _)| cell.to_array());
        let index: FxHashMap<IVec3, u32> = (0..)
            .zip(&cells)
            .map(|(vertex, (cell, _))| (*cell, vertex))
            .collect();
        let vertices: Vec<MeshVertex> = cells.iter().map(|(_, vertex)| *vertex).collect();
        let mut triangles = Vec::new();
        for (cell, _) in &cells {
            for axis in 0..3 {
                if let Some(quad) = distances.quad(*cell, axis, &index) {
                    triangles.extend(split(&vertices, quad));
                }
            }
        }
        Self { vertices, triangles }
    }
}

impl Distances {
    fn of<'a>(nodes: impl Iterator<Item = &'a Node>, side: f32) -> Self {
        let mut corners: FxHashMap<IVec3, GridCorner> = FxHashMap::default();
        for node in nodes.filter(|node| node.normal != Vec3::ZERO) {
            let first = (node.position / side).floor().as_ivec3() - 1;
            for k in 0..64 {
                let corner = first + IVec3::new(k % 4, k / 4 % 4, k / 16);
                let gap = corner.as_vec3() * side - node.position;
                let near = 1.0 - gap.length_squared() / (SUPPORT * side).powi(2);
                if near > 0.0 {
                    let weight = near.powi(4);
                    let sums = corners.entry(corner).or_default();
                    sums.weight += weight;
                    sums.distance += weight * gap.dot(node.normal);
                }
            }
        }
        Self { side, corners }
    }

    /// The signed distance at a corner, in metres; `None` far from every point.
    fn at(&self, corner: IVec3) -> Option<f32> {
        let sums = self.corners.get(&corner)?;
        Some(sums.distance / sums.weight)
    }

    /// The mean of where the zero crosses the edges of a cell, named by its corner of smallest coordinates.
    fn crossing(&self, cell: IVec3) -> Option<Vec3> {
        let mut values = [0.0; 8];
        for (k, value) in (0..).zip(&mut values) {
            *value = self.at(cell + IVec3::new(k & 1, k >> 1 & 1, k >> 2))?;
        }
        let (mut sum, mut crossings) = (Vec3::ZERO, 0.0);
        for corner in 0..8_usize {
            for axis in 0..3 {
                let other = corner | 1 << axis;
                let (a, b) = (values[corner], values[other]);
                if other != corner && is_outside(a) != is_outside(b) {
                    let mut place = Vec3::new(
                        (corner & 1) as f32,
                        (corner >> 1 & 1) as f32,
                        (corner >> 2) as f32,
                    );
                    place[axis] = a / (a - b);
                    sum += place;
                    crossings += 1.0;
                }
            }
        }
        (crossings > 0.0).then(|| (cell.as_vec3() + sum / crossings) * self.side)
    }

    /// The vertices around the edge from a cell's first corner along an axis, counterclockwise from outside, where the
    /// zero crosses it.
    fn quad(&self, cell: IVec3, axis: usize, index: &FxHashMap<IVec3, u32>) -> Option<[u32; 4]> {
        let step = |axis: usize| IVec3::AXES[axis % 3];
        let (from, to) = (self.at(cell)?, self.at(cell + step(axis))?);
        if is_outside(from) == is_outside(to) {
            return None;
        }
        let (right, up) = (step(axis + 1), step(axis + 2));
        let around = [cell - right - up, cell - up, cell, cell - right];
        let mut quad = [0; 4];
        for (vertex, cell) in quad.iter_mut().zip(around) {
            *vertex = *index.get(&cell)?;
        }
        if is_outside(from) {
            quad.reverse();
        }
        Some(quad)
    }
}

/// Whether a signed distance is that of a place on the cameras' side.
fn is_outside(distance: f32) -> bool {
    distance >= 0.0
}

/// A quadrilateral as two triangles, divided along its shorter diagonal.
fn split(vertices: &[MeshVertex], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let gap = |a: u32, b: u32| {
        let place = |vertex: u32| vertices[vertex as usize].position;
        place(a).distance_squared(place(b))
    };
    if gap(a, c) <= gap(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::wall;
    use crate::semantics::testing::{loose, node};

    /// A ball of radius 1 seen from outside, with something on a shell around it.
    fn ball() -> Surface {
        let voxel = 0.1;
        let count = 4000;
        let mut nodes: Vec<Node> = (0..count)
            .map(|k| {
                // A Fibonacci lattice.
                let z = 1.0 - (2 * k + 1) as f32 / count as f32;
                let (sin, cos) = (2.399_963 * k as f32).sin_cos();
                let normal = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                Node {
                    normal,
                    voxel,
                    ..node(normal)
                }
            })
            .collect();
        nodes.push(Node {
            voxel: 1.5,
            ..node(30.0 * Vec3::Z)
        });
        loose(nodes, voxel)
    }

    #[test]
    fn a_ball_becomes_a_closed_mesh_that_faces_outwards() {
        let surface = ball();
        let mesh = Mesh::of_surface(&surface);
        for vertex in &mesh.vertices {
            let length = vertex.position.length();
            assert!((length - 1.0).abs() < 0.01, "{length}");
            let node = surface.graph.nodes()[vertex.node as usize];
            assert!(node.position.distance(vertex.position) < 0.1);
        }
        let mut edges: FxHashMap<(u32, u32), i32> = FxHashMap::default();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize].position);
            assert!((b - a).cross(c - a).dot(a) >= 0.0, "faces inwards");
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry((triangle[from], triangle[to])).or_default() += 1;
            }
        }
        // Every edge has a triangle on either side, that is, once in each direction.
        for (&(a, b), &count) in &edges {
            assert_eq!((count, edges.get(&(b, a))), (1, Some(&1)));
        }
        let euler = mesh.vertices.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64;
        assert_eq!(euler, 2, "a sphere");
    }

    #[test]
    fn a_wall_becomes_a_sheet_that_faces_the_cameras_and_ends_where_it_ends() {
        let surface = Surface::build(&wall(9, 64, 48), &[], 4.0).unwrap();
        let mesh = Mesh::of_surface(&surface);
        assert!(mesh.triangles.len() > 500);
        let reach = surface.graph.nodes().iter().map(|node| node.position.abs());
        let reach = reach.fold(Vec3::ZERO, Vec3::max) + surface.voxel;
        let mut area = 0.0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize].position);
            assert!((a.z - 2.0).abs() < 0.01 && a.abs().cmple(reach).all(), "{a}");
            let normal = (b - a).cross(c - a);
            assert!(normal.z <= 0.0, "the cameras are at smaller z");
            area += 0.5 * normal.length();
        }
        // Cameras 0.4 m apart see 4.4 m x 3 m of it.
        assert!((11.5..14.5).contains(&area), "{area} square metres");
    }
}
