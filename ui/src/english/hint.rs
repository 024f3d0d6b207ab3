//! What to do next, over the canvas.

/// There is no class yet; `key` goes to the first suggestion.
pub fn first_class(key: &str) -> String {
    let click = "Click on something in the image and name its class";
    match key {
        "" => click.to_owned(),
        key => format!("{click}, or press {key} to be shown a place"),
    }
}

/// There are classes and no strokes.
pub const FIRST_STROKE: &str = "No strokes yet: choose a class, then click or scribble on the image";
/// There are strokes and no surface to spread them over.
pub const NO_SURFACE: &str = "Finding the surface of the scene; your labels spread as soon as it is there";

/// There are places to label next; `key` goes through them.
pub fn suggestions(key: &str) -> String {
    let these = "These are the places whose label would settle most: click on one";
    match key {
        "" => format!("{these} to go there"),
        key => format!("{these}, or press {key}"),
    }
}

/// There is something worth exporting; `key` does that.
pub fn export(key: &str) -> String {
    let key = match key {
        "" => String::new(),
        key => format!(" ({key})"),
    };
    format!("When the frames look right: Export{key} writes the labels of every frame")
}

/// Name of the button that takes a hint away.
pub const DISMISS: &str = "Dismiss hint";
