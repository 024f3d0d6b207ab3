//! The 3D view.

/// Name of the view for screen readers.
pub const NAME: &str = "3D view";
/// Shows the frame in view in the middle of the window.
pub const SHOW_FRAME: &str = "Frame";
/// Shows the surface in the middle of the window.
pub const SHOW_SPACE: &str = "3D";
/// About both.
pub const SWITCH_HINT: &str = "Switch between the frame and the 3D view (V)";
/// There is no surface yet.
pub const NO_SURFACE: &str =
    "The surface of the scene is shown here as soon as it is found; until then you can label the frames";
/// The surface is there and not yet ready to be drawn.
pub const PREPARING: &str = "Preparing the surface";
/// Moves the camera to where the frame in view was taken.
pub const FLY: &str = "Fly to this frame";
/// About that.
pub const FLY_HINT: &str = "Looks from where the frame in view was taken";
/// Leaves out what faces away.
pub const SEE_THROUGH: &str = "See into rooms";
/// About that.
pub const SEE_THROUGH_HINT: &str =
    "Leaves out walls and ceilings that are seen from behind, so that you look into the room from outside";
/// Shows where the frames were taken.
pub const CAMERAS: &str = "Cameras";
/// About that.
pub const CAMERAS_HINT: &str = "Shows where the frames were taken; click on one to go to its frame";
/// What the pointer does, a gesture and what it does each.
pub const GESTURES: [(&str, &str); 6] = [
    ("Click", "label"),
    ("Drag", "turn"),
    ("Middle drag", "move"),
    ("Wheel", "zoom"),
    ("Double-click", "turn around that place"),
    ("F", "fit"),
];
/// A click met nothing.
pub const NOTHING_THERE: &str = "There is no surface under the pointer";
/// A click met something that cannot be labelled.
pub const NOT_SEEN: &str = "No frame shows this place well enough to label it";

/// A click became a stroke on a frame.
pub fn labelled(class: &str, frame: &str) -> String {
    format!("{class}, on frame {frame}")
}
