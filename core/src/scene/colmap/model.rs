//! What a model says, whichever way it is written.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::DVec3;

use super::{FEWEST_VIEWS, MOST_ERROR};
use crate::scene::error::{refusal, refuse};
use crate::scene::{Camera, Distortion, Lens, SceneError};

/// The camera models by their number: name, and number of parameters of those that can be used.
pub(super) const CAMERA_MODELS: [(&str, Option<usize>); 12] = [
    ("SIMPLE_PINHOLE", Some(3)),
    ("PINHOLE", Some(4)),
    ("SIMPLE_RADIAL", Some(4)),
    ("RADIAL", Some(5)),
    ("OPENCV", Some(8)),
    ("OPENCV_FISHEYE", Some(8)),
    ("FULL_OPENCV", Some(12)),
    ("FOV", None),
    ("SIMPLE_RADIAL_FISHEYE", Some(4)),
    ("RADIAL_FISHEYE", Some(5)),
    ("THIN_PRISM_FISHEYE", None),
    ("RAD_TAN_THIN_PRISM_FISHEYE", None),
];

/// A whole model, in its own coordinates and unit.
#[derive(Debug, Default)]
pub(super) struct Model {
    /// Cameras by id.
    pub cameras: BTreeMap<u32, ModelCamera>,
    /// Registered images.
    pub images: Vec<ModelImage>,
    /// Points by id.
    pub points: HashMap<u64, ModelPoint>,
}

/// A camera of a model.
#[derive(Debug)]
pub(super) struct ModelCamera {
    /// Name of the camera model.
    pub model: &'static str,
    /// Its size, intrinsics and distortion.
    pub lens: Lens,
    /// The pinhole camera that takes its place.
    pub pinhole: Camera,
}

/// An image of a model.
#[derive(Debug)]
pub(super) struct ModelImage {
    /// Path below the folder of the images.
    pub name: String,
    /// World-to-camera rotation, a quaternion (w, x, y, z).
    pub rotation: [f64; 4],
    /// World-to-camera translation.
    pub translation: DVec3,
    /// Id of the camera.
    pub camera: u32,
    /// Where it shows which point.
    pub observations: Vec<Observation>,
}

/// A place in an image that shows a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Image position in pixels.
    pub x: f64,
    /// Image position in pixels.
    pub y: f64,
    /// Id of the point.
    pub point: u64,
}

/// A point of a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModelPoint {
    /// Position.
    pub position: DVec3,
    /// Mean reprojection error, in pixels.
    pub error: f64,
    /// Number of images that show it.
    pub views: u64,
}

/// What reads the bytes of a file of cameras, of images and of points into a model; the path is for messages.
pub(super) type Readers = [fn(&Path, &[u8], &mut Model) -> Result<(), SceneError>; 3];

impl Model {
    /// Reads the files of a folder that have this extension; that of the points may be missing.
    pub fn read(folder: &Path, extension: &str, readers: Readers) -> Result<Self, SceneError> {
        let mut model = Self::default();
        for (name, reader) in ["cameras", "images", "points3D"].into_iter().zip(readers) {
            let path = folder.join(name).with_extension(extension);
            if name == "points3D" && !path.exists() {
                break;
            }
            let bytes = std::fs::read(&path).map_err(|error| {
                let form = format!("cameras.{extension}, images.{extension} and points3D.{extension}");
                refusal!(&path, "cannot be read ({error}); a model is {form} together")
            })?;
            reader(&path, &bytes, &mut model)?;
        }
        Ok(model)
    }

    /// The position of a point that enough images agree on.
    pub fn trusted(&self, id: u64) -> Option<DVec3> {
        self.points
            .get(&id)
            .filter(|point| point.views >= FEWEST_VIEWS && point.error <= MOST_ERROR)
            .map(|point| point.position)
    }
}

/// Number of the parameters of a camera model, or a refusal that names the camera.
pub(super) fn parameters_of(file: &Path, camera: u32, model: i64) -> Result<usize, SceneError> {
    let known = usize::try_from(model)
        .ok()
        .and_then(|model| CAMERA_MODELS.get(model));
    match known {
        Some(&(name, None)) => Err(refused(file, camera, name)),
        Some(&(_, Some(count))) => Ok(count),
        None => Err(refused(file, camera, &format!("number {model}"))),
    }
}

/// The number of a camera model by its name, or a refusal that names the camera.
pub(super) fn model_named(file: &Path, camera: u32, name: &str) -> Result<i64, SceneError> {
    let known = CAMERA_MODELS
        .iter()
        .position(|(known, count)| *known == name && count.is_some());
    // At most a dozen models.
    known
        .map(|model| model as i64)
        .ok_or_else(|| refused(file, camera, name))
}

fn refused(file: &Path, camera: u32, model: &str) -> SceneError {
    let usable = CAMERA_MODELS.iter().filter(|(_, count)| count.is_some());
    let usable: Vec<&str> = usable.map(|(name, _)| *name).collect();
    refusal!(
        file,
        "camera {camera} has the camera model {}, which cannot be used; undistort the images first (colmap \
             image_undistorter), or use {}",
        model.escape_debug().take(40).collect::<String>(),
        usable.join(", ")
    )
}

impl ModelCamera {
    /// A camera from its parameters, as many as [`parameters_of`] says.
    ///
    /// # Errors
    /// An unusable model or value: a sentence that names the camera.
    pub fn new(
        file: &Path,
        id: u32,
        model: i64,
        size: [u64; 2],
        parameters: &[f64],
    ) -> Result<Self, SceneError> {
        let unusable = |reason: String| {
            refusal!(
                file,
                "camera {id} cannot be used: {reason}; copy the model again, or calibrate anew"
            )
        };
        let expected = parameters_of(file, id, model)?;
        let (intrinsics, distortion) = match (model, parameters) {
            (0, &[f, cx, cy]) => ([f, f, cx, cy], Distortion::default()),
            (1, &[fx, fy, cx, cy]) => ([fx, fy, cx, cy], Distortion::default()),
            (2, &[f, cx, cy, k]) => ([f, f, cx, cy], Distortion::opencv([k])),
            (3, &[f, cx, cy, k1, k2]) => ([f, f, cx, cy], Distortion::opencv([k1, k2])),
            (4, &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
                ([fx, fy, cx, cy], Distortion::opencv([k1, k2, p1, p2]))
            }
            (5, &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
                ([fx, fy, cx, cy], Distortion::fisheye([k1, k2, k3, k4]))
            }
            (6, &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
                let distortion = Distortion::opencv([k1, k2, p1, p2, k3, k4, k5, k6]);
                ([fx, fy, cx, cy], distortion)
            }
            (8, &[f, cx, cy, k]) => ([f, f, cx, cy], Distortion::fisheye([k])),
            (9, &[f, cx, cy, k1, k2]) => ([f, f, cx, cy], Distortion::fisheye([k1, k2])),
            _ => {
                let count = parameters.len();
                return Err(unusable(format!(
                    "it has {count} parameters instead of {expected}"
                )));
            }
        };
        let (lens, pinhole) =
            Lens::checked(size, intrinsics, distortion).map_err(|error| unusable(error.to_string()))?;
        Ok(Self {
            model: CAMERA_MODELS[model as usize].0,
            lens,
            pinhole,
        })
    }
}

/// Puts a camera into the model; each id may come once.
pub(super) fn add_camera(
    file: &Path,
    model: &mut Model,
    id: u32,
    camera: ModelCamera,
) -> Result<(), SceneError> {
    if model.cameras.insert(id, camera).is_some() {
        refuse!(file, "holds camera {id} twice; copy the model again");
    }
    Ok(())
}
