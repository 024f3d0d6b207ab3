//! The keys and gestures, as the help window and the settings show them.

/// A line of the help window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// The keys by default.
    pub keys: &'static str,
    /// What they do.
    pub does: &'static str,
}

/// Labels by hand.
pub const LABEL: Line = Line {
    keys: "Left click, drag",
    does: "Label a point, or scribble, with the current class",
};

/// Labels along a line.
pub const STRAIGHT: Line = Line {
    keys: "Shift+click",
    does: "Label along a straight line from where the last one ended",
};

/// Erases with any tool.
pub const ERASE: Line = Line {
    keys: "Right drag",
    does: "Erase",
};

/// Chooses what the left button draws.
pub const DRAWING_TOOLS: Line = Line {
    keys: "B, L, G",
    does: "Brush, polyline, polygon",
};

/// Ends what is being drawn.
pub const END_DRAFT: Line = Line {
    keys: "Enter or double-click",
    does: "End the polyline or polygon",
};

/// Takes back what is being drawn.
pub const DROP_DRAFT: Line = Line {
    keys: "Backspace, Escape",
    does: "Take its last corner back, drop it",
};

/// Chooses the eraser.
pub const TOGGLE_ERASER: Line = Line {
    keys: "E",
    does: "Switch the left button between labelling and erasing",
};

/// Chooses the tool that selects.
pub const SELECT: Line = Line {
    keys: "S",
    does: "Select strokes by clicking on them",
};

/// Deletes a stroke.
pub const DELETE: Line = Line {
    keys: "Delete",
    does: "Delete the selected stroke",
};

/// Chooses a class by its number.
pub const CLASS_DIGITS: Line = Line {
    keys: "1 to 9, 0",
    does: "Choose a class, or change that of the stroke selected with S; 0 is void",
};

/// Chooses a class by its name.
pub const FIND_CLASS: Line = Line {
    keys: "C",
    does: "Find a class by typing part of its name, or make one",
};

/// Orders the classes.
pub const MOVE_CLASS: Line = Line {
    keys: "Alt+Up and Alt+Down",
    does: "Move the class that has the focus in the list",
};

/// Sizes the brush.
pub const BRUSH_SIZE: Line = Line {
    keys: "[ and ], Ctrl+wheel",
    does: "Smaller and larger brush",
};

/// Zooms.
pub const ZOOM: Line = Line {
    keys: "Wheel",
    does: "Zoom at the cursor",
};

/// Pans.
pub const MOVE_IMAGE: Line = Line {
    keys: "Space+drag, middle drag",
    does: "Move the image",
};

/// Fits.
pub const FIT: Line = Line {
    keys: "F",
    does: "Fit the image, or the scene in the 3D view, into the window",
};

/// Chooses between frame and space.
pub const SPACE: Line = Line {
    keys: "V",
    does: "Switch between the frame and the 3D view",
};

/// Goes from frame to frame.
pub const STEP_FRAME: Line = Line {
    keys: "A and D, Left and Right",
    does: "Previous and next frame, of those that the filmstrip shows",
};

/// Goes from suggestion to suggestion.
pub const STEP_SUGGESTION: Line = Line {
    keys: "N, Shift+N",
    does: "Go to the next suggestion, or the one before",
};

/// Chooses what is shown at the right.
pub const SIDE: Line = Line {
    keys: "T",
    does: "Show the other tab at the right: what to label next, progress",
};

/// Shows the image alone.
pub const HIDE_OVERLAY: Line = Line {
    keys: "Tab (hold)",
    does: "Hide the overlay while the pointer is over the frame",
};

/// Chooses the layer.
pub const LAYER: Line = Line {
    keys: "Q",
    does: "Next layer: colour, labels, entropy, disagreement, depth, rendered colour",
};

/// Splits the canvas.
pub const COMPARE: Line = Line {
    keys: "W",
    does: "Compare two layers side by side",
};

/// Goes through the history.
pub const UNDO_REDO: Line = Line {
    keys: "Ctrl+Z, Ctrl+Shift+Z",
    does: "Undo and redo, also on other frames",
};

/// Keeps the work.
pub const SAVE: Line = Line {
    keys: "Ctrl+S",
    does: "Save",
};

/// Opens something.
pub const OPEN: Line = Line {
    keys: "Ctrl+O",
    does: "Open a scene or a project",
};

/// Writes the maps.
pub const EXPORT: Line = Line {
    keys: "Ctrl+E",
    does: "Export",
};

/// Stops and starts the worker.
pub const PAUSE: Line = Line {
    keys: "P",
    does: "Pause or resume training",
};

/// Opens the settings.
pub const SETTINGS: Line = Line {
    keys: "Ctrl+,",
    does: "Settings",
};

/// Sizes the window's contents.
pub const SCALE: Line = Line {
    keys: "Ctrl++, Ctrl+-, Ctrl+0",
    does: "Everything larger, smaller, as it comes",
};

/// Shows the keys.
pub const HELP: Line = Line {
    keys: "?",
    does: "This table",
};

/// Answers with a likely class.
pub const ANSWER_LIKELY: Line = Line {
    keys: "Enter, Shift+Enter",
    does: "At a suggestion: label it with its first or second likely class",
};

/// Answers with a class by its number.
pub const ANSWER_DIGITS: Line = Line {
    keys: "1 to 9, 0",
    does: "At a suggestion: label it with a class of the list; 0 is void",
};

/// Answers with a class by its name.
pub const ANSWER_NAME: Line = Line {
    keys: "C",
    does: "At a suggestion: type the name of its class",
};

/// Leaves a suggestion out.
pub const SKIP: Line = Line {
    keys: "X, Delete",
    does: "At a suggestion: skip it",
};

/// Ends the suggestions.
pub const LEAVE: Line = Line {
    keys: "Escape",
    does: "Leave the suggestions",
};
