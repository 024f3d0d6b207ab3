//! Propagation of labels: over the scene's surface by shortest paths and diffusion, and by a semantic field.

mod borders;
mod depth;
mod diffusion;
mod geodesic;
mod graph;
mod imported;
mod leave_one_out;
mod likeness;
mod look;
mod map;
mod mesh;
mod nearest;
mod node_map;
mod novel_view;
mod objects;
mod places;
mod posterior;
mod prior_evaluation;
mod propagation;
mod queue;
mod segments;
mod semantic_field;
mod strays;
mod summary;
mod superpixels;
mod surface;
mod targets;
#[cfg(test)]
pub(crate) mod testing;
mod views;
mod votes;
mod voxels;

pub use depth::{FieldDepth, pixel_length, pixel_lengths};
pub use diffusion::diffuse;
pub use geodesic::{ClassGeodesics, Geodesics};
pub(crate) use graph::{DisjointSets, cube};
pub use graph::{Node, SurfaceGraph};
pub use imported::SurfaceImport;
pub use leave_one_out::{CrossValidation, LeaveOneOut, StrokeCheck};
pub use likeness::Likeness;
pub use look::Look;
pub use map::{FrameMap, PixelAnswer};
pub use mesh::{Mesh, MeshVertex};
pub use nearest::NearestNodes;
pub(crate) use nearest::NodeCells;
pub use node_map::{NO_NODE, NodeMap};
pub use novel_view::NovelViews;
pub use objects::{KnownPart, SurfaceObjects, innermost};
pub use places::{RayTargets, SoftTargets};
pub(crate) use posterior::most_likely;
pub use posterior::{CERTAIN, ENTROPY_STEPS_PER_NAT, Evidence, Posterior};
pub(crate) use posterior::{Weights, stretched, weight_at};
pub use prior_evaluation::PriorEvaluation;
pub use propagation::{LabelPropagation, Preview};
pub(crate) use queue::DistanceQueue;
pub use semantic_field::{SemanticField, SemanticPart};
pub use summary::FrameSummary;
pub use superpixels::Superpixels;
pub use surface::Surface;
pub use views::best_view;
pub use votes::NodeVotes;
pub use voxels::OtherFrames;

#[cfg(test)]
mod tests;
