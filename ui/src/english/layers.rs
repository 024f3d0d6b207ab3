//! The canvas's layers, their legends, the comparison and the readout under the pointer.

/// Name of the canvas for screen readers.
pub const CANVAS: &str = "Frame canvas";
/// Names of the layers, in their order.
pub const NAMES: [&str; 6] = [
    "Colour",
    "Labels",
    "Entropy",
    "Disagreement",
    "Depth",
    "Rendered colour",
];

/// What the layers show, in their order.
pub const EXPLANATIONS: [&str; 6] = [
    "The image alone",
    "The class of every pixel",
    "How unsure the class of every pixel is",
    "Where what you or an imported image said is another class than what became of it",
    "How far away every pixel is: as measured, or as rendered where the capture has no depth",
    "The learnt scene as seen from this frame",
];

/// Name of the control that chooses the layer.
pub const LAYER: &str = "Layer";
/// What the key does, after the layer's explanation.
pub const NEXT_LAYER: &str = "Next layer (Q)";
/// Name of the control that makes the layer more or less opaque.
pub const OPACITY: &str = "Opacity";
/// What the opacity is.
pub const OPACITY_EXPLAINED: &str = "Opacity of the layer";
/// Of layers that take the place of the image.
pub const NO_OPACITY: &str = "This layer does not lie over the image";
/// The borders in the view menu.
pub const BORDERS: &str = "Borders between classes";
/// The legend in the view menu.
pub const LEGEND: &str = "Legend";

/// Name of the button that splits the canvas.
pub const COMPARE: &str = "Compare two layers (W)";
/// The same in the view menu.
pub const COMPARE_IN_MENU: &str = "Compare two layers";
/// Name of the handle between the two layers.
pub const HANDLE: &str = "Border between the layers";
/// Name of the control that chooses the layer on the left.
pub const LEFT_LAYER: &str = "Layer on the left";
/// Name of the control that chooses the layer on the right.
pub const RIGHT_LAYER: &str = "Layer on the right";

/// There are no maps yet.
pub const NO_MAP: &str = "No labels to show yet";
/// Nothing was said about this frame.
pub const NOTHING_SAID: &str = "Nothing is labelled in this frame: no strokes, no imported image";
/// The rendered view is on its way.
pub const RENDERING: &str = "The view is being rendered";
/// Depth has to be rendered first.
pub const RENDERING_DEPTH: &str = "No measured depth: it is being rendered";
/// The plane is on its way.
pub const PREPARING: &str = "One moment";

/// Of a map without any class.
pub const ALL_VOID: &str = "Nothing has a class here yet";
/// Disagreement: pixels where an imported image and the map say different classes.
pub const IMPORT_CONTRADICTED: &str = "Imported label, and the map says otherwise";
/// Disagreement: pixels of strokes that the others contradict.
pub const STROKE_CONTRADICTED: &str = "Your stroke, and the others say otherwise";
/// Disagreement: labelled pixels that are undisputed.
pub const AGREED: &str = "Labelled, and undisputed";
/// Disagreement: the rest.
pub const UNSAID: &str = "Not labelled by hand or import";
/// Depth without a value.
pub const NO_DEPTH: &str = "not measured";
/// Rendered depth without a value.
pub const NO_RENDERED_DEPTH: &str = "nothing met";
/// Title of measured depth.
pub const MEASURED_DEPTH: &str = "Measured depth";
/// Title of rendered depth.
pub const RENDERED_DEPTH: &str = "Rendered depth";

/// Classes that found no place in the legend.
pub fn and_more(count: usize) -> String {
    format!("and {count} more")
}

/// A rendered view, by the training that it shows.
pub fn after_steps(steps: u64) -> String {
    format!("after {steps} training steps")
}

/// An entropy.
pub fn nats(entropy: f32) -> String {
    format!("{entropy:.2} nats")
}

/// A length.
pub fn metres(length: f32) -> String {
    if length < 99.95 {
        format!("{length:.2} m")
    } else {
        format!("{length:.0} m")
    }
}

/// Name of the strip for screen readers while nothing is pointed at.
pub const POINT: &str = "Point at the image to read its pixels";
/// A pixel without a class.
pub const VOID: &str = "no class";
/// A depth that was rendered.
pub fn about(length: f32) -> String {
    format!("about {}", metres(length))
}

/// A probability.
pub fn percent(probability: f32) -> String {
    // 100% is kept for what is certain.
    if probability < 1.0 {
        format!("{:.0}%", (100.0 * probability).min(99.0))
    } else {
        "100%".to_owned()
    }
}

/// The second most likely class.
pub fn or(name: &str) -> String {
    format!("or {name}")
}
