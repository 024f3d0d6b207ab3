//! The messages over the canvas.

/// Something worth knowing.
pub const INFO: &str = "Message";
/// Something failed.
pub const ERROR: &str = "Error";
/// Takes a message away.
pub const DISMISS: &str = "Dismiss message";
