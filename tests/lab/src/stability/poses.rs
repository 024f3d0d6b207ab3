//! Wrong poses, and scenes of other sizes and places.

use std::rc::Rc;
use std::sync::Arc;

use glam::{Affine3A, DVec3, Quat, Vec3};
use rand::{Rng, rngs::SmallRng};

use super::trial::Trial;
use super::{Condition, Line, Way, disturbed};
use crate::Failure;
use inplace_core::scene::{OpenOptions, Scene, SceneSource, write_replica};

pub(super) fn conditions() -> Vec<Condition> {
    let larger = "averages over views in voxels larger than the error";
    let as_large = "averages over views in voxels about as large as the error";
    let layers =
        "averages over views; surfaces that come apart into layers are joined where they are nearest";
    let shaken = [
        ("pose-5mm", 0.005, 0.0, larger, 0.95),
        ("pose-1cm", 0.01, 0.0, larger, 0.9),
        ("pose-2cm", 0.02, 0.0, as_large, 0.8),
        ("pose-0.2deg", 0.0, 0.2, larger, 0.95),
        ("pose-0.5deg", 0.0, 0.5, larger, 0.9),
        ("pose-1deg", 0.0, 1.0, layers, 0.75),
    ];
    let shaken = shaken.map(|(name, metres, degrees, answer, share)| {
        let what = "every camera is off by so much";
        let quick = name == "pose-1deg";
        let shaken = disturbed(name, what, answer, Line::OfClean(share), move |trial, rng| {
            shake(trial, rng, metres, degrees);
        });
        Condition { quick, ..shaken }
    });
    let alone = disturbed(
        "pose-no-depth",
        "every camera is off by 1 cm and 0.5 degrees, colours alone",
        "adjusts the poses to corners that views share before it matches the views",
        Line::OfCleanWithoutDepth(0.8),
        |trial, rng| {
            trial.without_depth();
            shake(trial, rng, 0.01, 0.5);
        },
    );
    let no_depth = "scales a scene without depth to the size of a room, and says so";
    let far = "moves the origin to the cameras in double precision, and back in what it exports";
    let placed = [
        (
            "millimetres",
            "poses in millimetres and no depth to tell",
            no_depth,
            1000.0,
            DVec3::ZERO,
        ),
        (
            "kilometres",
            "poses in kilometres and no depth to tell",
            no_depth,
            0.001,
            DVec3::ZERO,
        ),
        (
            "far-origin",
            "the origin is 10 km away",
            far,
            1.0,
            DVec3::new(6e3, -8e3, 30.0),
        ),
    ];
    let placed = placed.map(|(name, what, answer, scale, offset)| {
        // Without another unit the depth fits and is kept.
        let depth = scale == 1.0;
        let line = if depth {
            Line::OfClean(0.95)
        } else {
            Line::OfCleanWithoutDepth(0.9)
        };
        let way = Way::Disturb(Rc::new(move |trial, _, _| elsewhere(trial, scale, offset, depth)));
        Condition {
            quick: depth,
            ..Condition::new(name, what, answer, line, way)
        }
    });
    shaken.into_iter().chain([alone]).chain(placed).collect()
}

/// Moves and turns every camera about a random axis: by so many metres and degrees, the standard deviation.
fn shake(trial: &mut Trial, rng: &mut SmallRng, metres: f32, degrees: f32) {
    for frame in &mut trial.scene.frames {
        let axis = loop {
            let axis = Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            if (0.1..1.0).contains(&axis.length()) {
                break axis.normalize();
            }
        };
        let turn = Quat::from_axis_angle(axis, degrees.to_radians() * normal(rng));
        let step = Vec3::from_array(std::array::from_fn(|_| metres * normal(rng) / 3.0_f32.sqrt()));
        let pose = frame.camera_to_world;
        frame.camera_to_world = Affine3A::from_rotation_translation(
            turn * Quat::from_mat3a(&pose.matrix3),
            Vec3::from(pose.translation) + step,
        );
    }
}

/// A standard normal number (Box and Muller, 1958).
fn normal(rng: &mut SmallRng) -> f32 {
    let (u, v) = (1.0 - rng.random::<f32>(), rng.random::<f32>());
    (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * v).cos()
}

/// Writes the scene with poses in another unit, somewhere else in the world, and reads it as a person's.
fn elsewhere(trial: &mut Trial, scale: f32, offset: DVec3, depth: bool) -> Result<(), Failure> {
    let failed = |reason: String| Failure::from(format!("the capture could not be written: {reason}"));
    let root = tempfile::tempdir().map_err(|error| failed(error.to_string()))?;
    let folder = root.path().join("scene");
    let mut moved = trial.scene.clone();
    moved.origin = offset;
    for frame in &mut moved.frames {
        frame.camera_to_world.translation *= scale;
        if !depth {
            frame.set_depth(None);
        }
    }
    write_replica(&moved, &folder, None).map_err(|error| failed(error.to_string()))?;
    let options = OpenOptions {
        depth,
        ..OpenOptions::default()
    };
    trial.scene = Scene::open(&SceneSource::Folder(folder), options, &|_, _| {})?;
    trial.folder = Some(Arc::new(root));
    Ok(())
}
