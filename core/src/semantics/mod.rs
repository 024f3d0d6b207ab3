//! How labels spread: over the scene's surface by shortest paths, and into a semantic head on the field.

mod depth;
mod geodesic;
mod graph;
mod head;
mod posterior;
mod surface;

pub use depth::{FieldDepth, pixel_lengths};
pub use geodesic::{Geodesics, Propagation};
pub use graph::{Node, SurfaceGraph};
pub use head::{RayTargets, SemanticHead, SoftTargets};
pub use posterior::{ENTROPY_STEPS_PER_NAT, Posterior};
pub use surface::{NO_NODE, Surface};
