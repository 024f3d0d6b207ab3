//! Wrong poses, and scenes of other sizes and places.

use glam::{Affine3A, DVec3, Quat, Vec3};
use rand::{Rng, rngs::SmallRng};

use super::trial::{Measured, Settings, Trial};
use super::{Condition, Figure, Line, disturbed};
use crate::EvalError;
use inplace_core::scene::{OpenOptions, Scene, SceneSource, write_replica};

pub(super) fn conditions() -> Vec<Condition> {
    let noisy = "every camera is off by so much";
    let placed = |name, what, answer, line, course| Condition {
        figure: Figure::Miou,
        ..Condition::course(name, what, answer, line, course)
    };
    vec![
        disturbed(
            "pose-5mm",
            noisy,
            "averages over views in voxels larger than the error",
            Line::OfClean(0.95),
            |trial, rng| shake(trial, rng, 0.005, 0.0),
        ),
        disturbed(
            "pose-1cm",
            noisy,
            "averages over views in voxels larger than the error",
            Line::OfClean(0.9),
            |trial, rng| shake(trial, rng, 0.01, 0.0),
        ),
        disturbed(
            "pose-2cm",
            noisy,
            "averages over views in voxels about as large as the error",
            Line::OfClean(0.8),
            |trial, rng| shake(trial, rng, 0.02, 0.0),
        ),
        disturbed(
            "pose-0.2deg",
            noisy,
            "averages over views in voxels larger than the error",
            Line::OfClean(0.95),
            |trial, rng| shake(trial, rng, 0.0, 0.2),
        ),
        disturbed(
            "pose-0.5deg",
            noisy,
            "averages over views in voxels larger than the error",
            Line::OfClean(0.9),
            |trial, rng| shake(trial, rng, 0.0, 0.5),
        ),
        disturbed(
            "pose-1deg",
            noisy,
            "averages over views; surfaces that come apart into layers are joined where they are nearest",
            Line::OfClean(0.75),
            |trial, rng| shake(trial, rng, 0.0, 1.0),
        )
        .in_short(),
        placed(
            "millimetres",
            "poses in millimetres and no depth to tell",
            "scales a scene without depth to the size of a room, and says so",
            Line::OfCleanWithoutDepth(0.9),
            |trial, settings, _| elsewhere(trial, settings, 1000.0, DVec3::ZERO, false),
        ),
        placed(
            "kilometres",
            "poses in kilometres and no depth to tell",
            "scales a scene without depth to the size of a room, and says so",
            Line::OfCleanWithoutDepth(0.9),
            |trial, settings, _| elsewhere(trial, settings, 0.001, DVec3::ZERO, false),
        ),
        placed(
            "far-origin",
            "the origin is 10 km away",
            "moves the origin to the cameras in double precision, and back in what it exports",
            Line::OfClean(0.95),
            |trial, settings, _| elsewhere(trial, settings, 1.0, DVec3::new(6e3, -8e3, 30.0), true),
        )
        .in_short(),
    ]
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

/// Writes the scene with poses in another unit, somewhere else in the world, reads it as a person's and labels that.
fn elsewhere(
    trial: &Trial,
    settings: &Settings,
    scale: f32,
    offset: DVec3,
    depth: bool,
) -> Result<Measured, EvalError> {
    let failed = |reason: String| EvalError::Session(format!("the capture could not be written: {reason}"));
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
    let source = SceneSource::Folder(folder);
    let placed = Trial {
        scene: Scene::open(&source, options, &|_, _| {})?,
        ..trial.clone()
    };
    placed.labelled(settings)
}
