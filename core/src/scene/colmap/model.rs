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

/// A camera model that can be used: its name and the number of its parameters.
pub(super) type CameraModel = (&'static str, usize);

/// The camera model with this number, or a refusal that names the camera.
pub(super) fn model_numbered(file: &Path, camera: u32, number: i32) -> Result<CameraModel, SceneError> {
    let known = usize::try_from(number).ok();
    match known.and_then(|number| CAMERA_MODELS.get(number)) {
        Some(&(name, Some(count))) => Ok((name, count)),
        Some(&(name, None)) => Err(refused(file, camera, name)),
        None => Err(refused(file, camera, &format!("number {number}"))),
    }
}

/// The camera model of this name, or a refusal that names the camera.
pub(super) fn model_named(file: &Path, camera: u32, name: &str) -> Result<CameraModel, SceneError> {
    match CAMERA_MODELS.iter().find(|(known, _)| *known == name) {
        Some(&(name, Some(count))) => Ok((name, count)),
        _ => Err(refused(file, camera, name)),
    }
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
    /// A camera of this model from its parameters.
    ///
    /// # Errors
    /// Another number of parameters or an unusable value: a sentence that names the camera.
    pub fn new(
        file: &Path,
        id: u32,
        (model, expected): CameraModel,
        size: [u64; 2],
        parameters: &[f64],
    ) -> Result<Self, SceneError> {
        let unusable = |reason: String| {
            refusal!(
                file,
                "camera {id} cannot be used: {reason}; copy the model again, or calibrate anew"
            )
        };
        let (intrinsics, distortion) = match (model, parameters) {
            ("SIMPLE_PINHOLE", &[f, cx, cy]) => ([f, f, cx, cy], Distortion::default()),
            ("PINHOLE", &[fx, fy, cx, cy]) => ([fx, fy, cx, cy], Distortion::default()),
            ("SIMPLE_RADIAL", &[f, cx, cy, k]) => ([f, f, cx, cy], Distortion::opencv([k])),
            ("RADIAL", &[f, cx, cy, k1, k2]) => ([f, f, cx, cy], Distortion::opencv([k1, k2])),
            ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
                ([fx, fy, cx, cy], Distortion::opencv([k1, k2, p1, p2]))
            }
            ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
                ([fx, fy, cx, cy], Distortion::fisheye([k1, k2, k3, k4]))
            }
            ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
                let distortion = Distortion::opencv([k1, k2, p1, p2, k3, k4, k5, k6]);
                ([fx, fy, cx, cy], distortion)
            }
            ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => ([f, f, cx, cy], Distortion::fisheye([k])),
            ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => ([f, f, cx, cy], Distortion::fisheye([k1, k2])),
            _ => {
                let count = parameters.len();
                return Err(unusable(format!(
                    "it has {count} parameters instead of {expected}"
                )));
            }
        };
        let (lens, pinhole) = Lens::checked(size, intrinsics, distortion).map_err(unusable)?;
        Ok(Self { model, lens, pinhole })
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
