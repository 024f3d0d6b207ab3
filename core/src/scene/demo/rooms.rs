//! Rooms built of blocks, rods and cushions, to be photographed in place of the demo's
//! ([`Shot::scene_in`](super::Shot::scene_in)).

pub use super::build::{Builder, Part, Place};
pub use super::cast::{SHELL, Zone};
pub use super::light::Pane;
pub use super::material::{Material, Optics, Pattern, srgb};
pub use super::room::{CEILING, Room, SIZE, shell};
