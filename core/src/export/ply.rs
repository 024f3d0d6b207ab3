//! Files in the PLY format (Turk 1994), binary and little endian.

use std::fmt::Write as _;

use glam::{DVec3, Vec3};

use crate::labels::ClassId;

/// A vertex with what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    pub(super) position: DVec3,
    /// Of unit length; zero where it is not known.
    pub(super) normal: Vec3,
    pub(super) color: [u8; 3],
    pub(super) label: ClassId,
    /// In nats.
    pub(super) entropy: f32,
    /// Number of its object; 0 for none.
    pub(super) object: u16,
}

/// Properties of a vertex: positions in double precision, since some captures are far from their origin.
pub(super) const VERTEX: [(&str, &str); 12] = [
    ("double", "x"),
    ("double", "y"),
    ("double", "z"),
    ("float", "nx"),
    ("float", "ny"),
    ("float", "nz"),
    ("uchar", "red"),
    ("uchar", "green"),
    ("uchar", "blue"),
    ("ushort", "label"),
    ("float", "entropy"),
    ("ushort", "object"),
];
/// Bytes of a vertex and of a triangle.
pub(super) const VERTEX_BYTES: usize = 3 * 8 + 3 * 4 + 3 + 2 + 4 + 2;
const TRIANGLE_BYTES: usize = 1 + 3 * 4;

/// A file with these vertices, and faces if there are any to tell of. What is not ASCII in the comments is escaped, as
/// readers expect nothing else in a header.
pub(super) fn encode(comments: &[String], vertices: &[Vertex], triangles: Option<&[[u32; 3]]>) -> Vec<u8> {
    let mut header = "ply\nformat binary_little_endian 1.0\n".to_owned();
    // Writing to a string cannot fail.
    for comment in comments {
        let escaped = comment.chars().map(|c| match c {
            ' '..='~' => c.to_string(),
            c => c.escape_default().to_string(),
        });
        let _ = writeln!(header, "comment {}", escaped.collect::<String>());
    }
    let _ = writeln!(header, "element vertex {}", vertices.len());
    for (kind, name) in VERTEX {
        let _ = writeln!(header, "property {kind} {name}");
    }
    if let Some(triangles) = triangles {
        let _ = writeln!(header, "element face {}", triangles.len());
        header.push_str("property list uchar int vertex_indices\n");
    }
    header.push_str("end_header\n");
    let triangles = triangles.unwrap_or_default();
    let mut file = header.into_bytes();
    file.reserve(VERTEX_BYTES * vertices.len() + TRIANGLE_BYTES * triangles.len());
    for vertex in vertices {
        let position = vertex.position.to_array().map(f64::to_le_bytes);
        let normal = vertex.normal.to_array().map(f32::to_le_bytes);
        file.extend(position.into_iter().flatten());
        file.extend(normal.into_iter().flatten());
        file.extend(vertex.color);
        file.extend(vertex.label.to_le_bytes());
        file.extend(vertex.entropy.to_le_bytes());
        file.extend(vertex.object.to_le_bytes());
    }
    for triangle in triangles {
        file.push(3);
        file.extend(triangle.iter().flat_map(|vertex| vertex.to_le_bytes()));
    }
    file
}
