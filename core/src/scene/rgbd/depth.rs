//! Depth images beside colour images.

use std::path::PathBuf;
use std::sync::Arc;

use image::DynamicImage;

use crate::scene::files::decode_image;
use crate::scene::{Camera, ColorImage, DepthMap, SceneError};

/// Pixels by which single precision of the intrinsics may move a place: one on the border between two pixels falls on
/// the same side everywhere.
const ROUNDING: f64 = 1e-3;

/// What the values of a 16-bit depth image mean, along the camera's z axis; 0 is always unknown.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct DepthCode {
    /// The value of a metre.
    pub steps_per_metre: f32,
    /// Another value for unknown depth.
    pub none: u16,
}

/// The camera of depth images of this width and height in pixels, or why none is known and what to do. It stands where
/// the colour camera stands and looks the same way.
pub(in crate::scene) type DepthCamera = dyn Fn(u32, u32) -> Result<Camera, String> + Send + Sync;

/// A depth image on disk.
#[derive(Clone)]
pub(super) struct DepthFile {
    pub path: PathBuf,
    /// What its values mean.
    pub code: DepthCode,
    /// Its own camera; `None` where it shows what the colour image shows, at any size.
    pub camera: Option<Arc<DepthCamera>>,
}

impl DepthFile {
    /// Depth of the pixels of a frame with the camera `shown` and this colour image as ray lengths, or why it cannot be
    /// used: each pixel has the step that the depth image shows in the direction of its centre, as a mean across a border
    /// would be a surface that is not there. Hidden pixels have none.
    ///
    /// # Errors
    /// A depth image of a size for which there is no camera.
    pub fn decode(&self, shown: &Camera, color: &ColorImage) -> Result<Result<DepthMap, String>, SceneError> {
        let image = match decode_image(&self.path) {
            Ok(DynamicImage::ImageLuma16(image)) => image,
            Ok(_) => return Ok(Err("not a 16-bit greyscale PNG".to_owned())),
            Err(reason) => return Ok(Err(reason)),
        };
        let (width, height) = image.dimensions();
        let own = match &self.camera {
            Some(camera) => camera(width, height),
            None => shown.resized(width, height).ok_or_else(|| {
                format!(
                    "has {width}x{height} pixels, which is another shape than that of its colour image, {}x{}; register \
                     depth to colour and save it in the same proportions",
                    shown.width, shown.height
                )
            }),
        };
        let own = own.map_err(|reason| SceneError::file(&self.path, reason))?;
        let columns = lookup(shown.width, [shown.fx, shown.cx], width, [own.fx, own.cx]);
        let rows = lookup(shown.height, [shown.fy, shown.cy], height, [own.fy, own.cy]);
        let mut metres = Vec::with_capacity(shown.pixels());
        for &row in &rows {
            for &column in &columns {
                let steps = column.zip(row).map_or(0, |(x, y)| image.get_pixel(x, y).0[0]);
                let known = steps != self.code.none && !color.is_hidden(metres.len());
                metres.push(if known {
                    f32::from(steps) / self.code.steps_per_metre
                } else {
                    0.0
                });
            }
        }
        Ok(Ok(DepthMap::from_z_depths(shown, metres)))
    }
}

/// For each of `size` pixels along an axis of one camera, the pixel of another, of `own_size` pixels, that looks where
/// its centre looks; `None` outside. Each camera by its focal length and principal point along this axis, in pixels.
fn lookup(size: u32, [focal, center]: [f32; 2], own_size: u32, own: [f32; 2]) -> Vec<Option<u32>> {
    let [focal, center, own_focal, own_center] = [focal, center, own[0], own[1]].map(f64::from);
    let place = |pixel: u32| {
        let place = (f64::from(pixel) + 0.5 - center) / focal * own_focal + own_center + ROUNDING;
        (place >= 0.0 && place < f64::from(own_size)).then_some(place as u32)
    };
    (0..size).map(place).collect()
}
