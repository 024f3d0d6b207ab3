//! `inplace demo`: the demo scene as a folder.

use std::path::Path;

use inplace_core::scene::{GroundTruth, OpenOptions, Scene, SceneSource, demo, write_replica};

use super::Failure;

/// Renders the demo scene and writes it with its ground truth.
pub fn run(out: &Path) -> Result<(), Failure> {
    let scene = Scene::open(&SceneSource::Demo, OpenOptions::default(), &|_, _| {})?;
    let truth = GroundTruth {
        classes: &demo::classes(),
        labels: &demo::ground_truth(),
        held_out: &demo::held_out(),
    };
    write_replica(&scene, out, Some(&truth))?;
    println!(
        "wrote {} frames with depth and labels: {}",
        scene.frames.len(),
        out.display()
    );
    Ok(())
}
