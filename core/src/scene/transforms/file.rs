//! What `transforms.json` says, frame by frame.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use serde::Deserialize;

use crate::scene::camera::rigid;
use crate::scene::error::{LAST_ROW, refusal, refuse};
use crate::scene::files::cannot_read;
use crate::scene::{Camera, Distortion, Lens, SceneError};

/// The camera models whose images are those of a pinhole camera up to k1, k2, p1 and p2.
const CAMERA_MODELS: [&str; 6] = [
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "PERSPECTIVE",
];
/// Length of a step of the depth images where the file does not say it, in metres.
const DEPTH_UNIT: f64 = 1e-3;
/// Longest step, in the same unit: 65535 of them are still near enough.
const LONGEST_STEP: f64 = 1e6;

/// The whole file. Keys that are not listed here change nothing that is read.
///
/// `applied_transform` and `applied_scale` are among them: they tell how to come back from the poses in the
/// file to those of the program before, and the poses in the file already contain them.
#[derive(Deserialize)]
pub(in crate::scene) struct Transforms {
    /// What holds for all frames that do not say otherwise.
    #[serde(flatten)]
    pub shared: Intrinsics,
    /// The frames, in any order.
    #[serde(default)]
    pub frames: Vec<Entry>,
    /// Length of a step of the depth images, in the unit of the poses.
    depth_unit_scale_factor: Option<f64>,
    /// A point cloud, below the folder.
    pub ply_file_path: Option<String>,
}

/// One frame.
#[derive(Deserialize)]
pub(in crate::scene) struct Entry {
    /// The colour image below the folder, with or without its extension.
    pub file_path: String,
    /// Camera-to-world, rows of a 4x4 or 3x4 matrix, OpenGL's camera axes.
    pub transform_matrix: Vec<Vec<f64>>,
    /// The depth image below the folder.
    pub depth_file_path: Option<String>,
    /// The mask below the folder: 0 where the image shows no part of the scene.
    pub mask_path: Option<String>,
    /// What holds for this frame alone.
    #[serde(flatten)]
    pub own: Intrinsics,
}

/// A camera as far as it is given; lengths in pixels, angles in radians.
#[derive(Default, Deserialize)]
pub(in crate::scene) struct Intrinsics {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

impl Transforms {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read, is no such JSON, lists no frames or has an unusable step of depth.
    pub fn read(file: &Path) -> Result<Self, SceneError> {
        let bytes = std::fs::read(file).map_err(|error| cannot_read(file, error))?;
        Self::parse(file, &bytes)
    }

    /// Takes over the bytes of the file at `file`.
    ///
    /// # Errors
    /// As for [`Transforms::read`].
    pub fn parse(file: &Path, bytes: &[u8]) -> Result<Self, SceneError> {
        // Some editors save the text with a byte order mark.
        let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let transforms: Self = serde_json::from_slice(text).map_err(|error| {
            refusal!(
                file,
                "is not a list of posed images ({error}); write the file anew"
            )
        })?;
        if transforms.frames.is_empty() {
            refuse!(file, "lists no frames; register the images of the capture first");
        }
        let step = transforms.depth_unit();
        if !(step > 0.0 && step <= LONGEST_STEP) {
            refuse!(
                file,
                "has {step} as depth_unit_scale_factor; give the length of a step of the depth images, 0.001 \
                     for millimetres"
            );
        }
        Ok(transforms)
    }

    /// Length of a step of the depth images, in metres.
    pub fn depth_unit(&self) -> f64 {
        self.depth_unit_scale_factor.unwrap_or(DEPTH_UNIT)
    }

    /// The width and height that a frame is said to have.
    pub fn size(&self, entry: &Entry) -> Option<[f64; 2]> {
        let (own, shared) = (&entry.own, &self.shared);
        Some([own.w.or(shared.w)?, own.h.or(shared.h)?])
    }

    /// The lens of a frame with this width and height, and the pinhole camera that takes its place.
    ///
    /// # Errors
    /// What is wrong with it, and what to do.
    pub fn lens(&self, entry: &Entry, [width, height]: [f64; 2]) -> Result<(Lens, Camera), String> {
        let (own, shared) = (&entry.own, &self.shared);
        if own.is_fisheye.or(shared.is_fisheye) == Some(true) {
            return Err("it has a fisheye lens (is_fisheye); undistort the images first".to_owned());
        }
        let model = own.camera_model.as_deref().or(shared.camera_model.as_deref());
        if let Some(model) = model.filter(|model| !CAMERA_MODELS.contains(model)) {
            return Err(format!(
                "it has the camera model {}; undistort the images first, or use {}",
                model.escape_debug().take(40).collect::<String>(),
                CAMERA_MODELS.join(", ")
            ));
        }
        let given = |value: fn(&Intrinsics) -> Option<f64>| value(own).or_else(|| value(shared));
        let or_zero = |value| given(value).unwrap_or(0.0);
        if or_zero(|own| own.k3) != 0.0 || or_zero(|own| own.k4) != 0.0 {
            return Err(
                "its k3 or k4 is not 0, and only k1, k2, p1 and p2 can be undone; undistort the images \
                        first, or calibrate without k3 and k4"
                    .to_owned(),
            );
        }
        if width.fract() != 0.0 || height.fract() != 0.0 || width < 1.0 || height < 1.0 {
            return Err(format!(
                "{width} x {height} is not an image size in pixels; correct w and h, or remove them"
            ));
        }
        // The frame's own values first, lengths before angles, and square pixels where one axis is silent.
        let along_x = |given: &Intrinsics| focal(given.fl_x, given.camera_angle_x, width);
        let along_y = |given: &Intrinsics| focal(given.fl_y, given.camera_angle_y, height);
        let along_x = along_x(own).or_else(|| along_x(shared));
        let along_y = along_y(own).or_else(|| along_y(shared));
        let (Some(fx), Some(fy)) = (along_x.or(along_y), along_y.or(along_x)) else {
            return Err("it has no focal length; give fl_x or camera_angle_x".to_owned());
        };
        let cx = given(|own| own.cx).unwrap_or(0.5 * width);
        let cy = given(|own| own.cy).unwrap_or(0.5 * height);
        let distortion = Distortion::opencv([
            or_zero(|own| own.k1),
            or_zero(|own| own.k2),
            or_zero(|own| own.p1),
            or_zero(|own| own.p2),
        ]);
        Lens::checked([width as u64, height as u64], [fx, fy, cx, cy], distortion)
            .map_err(|error| format!("{error}; calibrate it anew"))
    }
}

/// A focal length in pixels: as given, or that with which `size` pixels span a field of view, in radians. Not finite or
/// not positive for what is no such angle; `None` where neither is given.
fn focal(length: Option<f64>, angle: Option<f64>, size: f64) -> Option<f64> {
    length.or_else(|| {
        angle.map(|angle| match angle < std::f64::consts::PI {
            true => 0.5 * size / (0.5 * angle).tan(),
            false => f64::NAN,
        })
    })
}

/// The pose of a camera-to-world matrix, three or four rows, with OpenGL's camera axes; or what is wrong with it.
pub(in crate::scene) fn pose_of_open_gl<R: AsRef<[f64]>>(rows: &[R]) -> Result<DAffine3, &'static str> {
    let rows: Vec<&[f64]> = rows.iter().map(AsRef::as_ref).collect();
    if !(3..=4).contains(&rows.len()) || rows.iter().any(|row| row.len() != 4) {
        return Err("it is not a matrix of 4 x 4 numbers");
    }
    if rows.get(3).is_some_and(|row| **row != [0.0, 0.0, 0.0, 1.0]) {
        return Err(LAST_ROW);
    }
    let column = |column: usize| DVec3::new(rows[0][column], rows[1][column], rows[2][column]);
    // OpenGL's cameras look along -z with y up, OpenCV's along z with y down.
    let rotation = DMat3::from_cols(column(0), -column(1), -column(2));
    rigid(DAffine3::from_mat3_translation(rotation, column(3)))
}
