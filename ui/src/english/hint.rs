//! What to do next, over the canvas.

/// There is no class yet.
pub const NO_CLASS: &str = "Click on something in the image and name its class";
/// There are classes and no strokes.
pub const NO_STROKES: &str = "No strokes yet: choose a class, then click or scribble on the image";
/// There are strokes and no surface to spread them over.
pub const NO_SURFACE: &str = "Finding the surface of the scene; your labels spread as soon as it is there";
