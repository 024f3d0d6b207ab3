//! Classifying pixels by what their surroundings look like, without geometry: in the way of ilastik (Berg et al.
//! 2019), a random forest on the responses of a filter bank.

mod filters;
mod forest;

pub use filters::{FilterBank, RESPONSES};
pub use forest::{Forest, Sample};
