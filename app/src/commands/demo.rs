//! `inplace demo`: the demo scene as a folder.

use std::path::Path;

use inplace_core::export::write_strokes;
use inplace_core::scene::{GroundTruth, TrueObjects, demo, write_replica};
use inplace_core::session::Progress;

use super::Failure;

/// Renders the demo scene as photographed in `shot` and writes it with its ground truth and some clicks.
pub fn run(out: &Path, shot: demo::Shot) -> Result<(), Failure> {
    if shot.frames < 2 * shot.rooms {
        return Err(format!(
            "{} frames are too few for {} rooms, as each needs one to label and one to measure on; give --frames {} or more",
            shot.frames,
            shot.rooms,
            2 * shot.rooms
        )
        .into());
    }
    let progress = Progress::default();
    progress.show(format!("rendering {} frames", shot.frames));
    let scene = shot.unrendered();
    let (listed, of_frame) = shot.objects();
    let truth = GroundTruth {
        classes: &demo::classes(),
        labels: &shot.labels(),
        objects: Some(TrueObjects {
            listed: &listed,
            of_frame: &of_frame,
        }),
        held_out: &shot.held_out(),
    };
    write_replica(&scene, out, Some(&truth))?;
    write_strokes(&out.join("strokes.json"), &shot.clicks(), &scene.frames)?;
    drop(progress);
    println!(
        "wrote {} frames with depth and labels: {}",
        scene.frames.len(),
        out.display()
    )
}
