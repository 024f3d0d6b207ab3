//! Propagation of labels: over the scene's surface by shortest paths and diffusion, and by semantic heads on the field.

mod borders;
mod depth;
mod diffusion;
mod geodesic;
mod graph;
mod head;
mod head_evaluation;
mod imported;
mod leave_one_out;
mod map;
mod mesh;
mod nearest;
mod node_map;
mod novel_view;
mod places;
mod posterior;
mod propagation;
mod queue;
mod strays;
mod summary;
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
pub use graph::{Node, SurfaceGraph};
pub use head::SemanticHead;
pub use head_evaluation::HeadEvaluation;
pub use imported::{NodeLabels, SurfaceImport};
pub use leave_one_out::{CrossValidation, LeaveOneOut, StrokeCheck};
pub use map::{FrameMap, PixelAnswer};
pub use mesh::{Mesh, MeshVertex};
pub use nearest::NearestNodes;
pub use node_map::{NO_NODE, NodeMap};
pub use novel_view::NovelViews;
pub use places::{RayTargets, SoftTargets};
pub use posterior::{CERTAIN, ENTROPY_STEPS_PER_NAT, Posterior};
pub use propagation::LabelPropagation;
pub(crate) use queue::DistanceQueue;
pub use summary::FrameSummary;
pub use surface::Surface;
pub use views::best_view;
pub use votes::NodeVotes;
pub use voxels::OtherFrames;

#[cfg(test)]
mod tests;
