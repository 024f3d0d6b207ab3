//! Depth images beside colour images.

use std::path::Path;

use image::DynamicImage;

use crate::scene::error::ImageError;
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

impl DepthCode {
    /// Millimetres, 0 where the depth is unknown.
    pub const MILLIMETRES: Self = Self {
        steps_per_metre: 1000.0,
        none: 0,
    };
}

/// The camera of depth images of this width and height in pixels. It has the place and the direction of the colour
/// camera.
pub(in crate::scene) type DepthCamera = dyn Fn(u32, u32) -> Result<Camera, String> + Send + Sync;

/// Depth of the pixels of a frame with the camera `shown` and this colour image as ray lengths: each pixel has the step
/// that the depth image has in the direction of its centre, as a mean across a border would be a surface that is not
/// there. Hidden pixels have none. `own` is the camera of the depth image; `None` where it shows what the colour image
/// shows, at any size.
///
/// # Errors
/// A depth image of a size for which there is no camera.
pub(super) fn decode_depth(
    path: &Path,
    (code, own): (DepthCode, Option<&DepthCamera>),
    shown: &Camera,
    color: &ColorImage,
) -> Result<Result<DepthMap, ImageError>, SceneError> {
    let image = match decode_image(path) {
        Ok(DynamicImage::ImageLuma16(image)) => image,
        Ok(_) => return Ok(Err(ImageError::NotDepth)),
        Err(error) => return Ok(Err(error)),
    };
    let (width, height) = image.dimensions();
    let own = match own {
        Some(camera) => camera(width, height),
        None => shown.resized(width, height).ok_or_else(|| {
            format!(
                "has {width}x{height} pixels, which is another shape than that of its colour image, {}x{}; register \
                 depth to colour and save it in the same proportions",
                shown.width, shown.height
            )
        }),
    };
    let own = own.map_err(|error| SceneError::file(path, error))?;
    let columns = lookup(shown.width, [shown.fx, shown.cx], width, [own.fx, own.cx]);
    let rows = lookup(shown.height, [shown.fy, shown.cy], height, [own.fy, own.cy]);
    let mut metres = Vec::with_capacity(shown.pixels());
    for &row in &rows {
        for &column in &columns {
            let steps = column.zip(row).map_or(0, |(x, y)| image.get_pixel(x, y).0[0]);
            let known = steps != code.none && !color.is_hidden(metres.len());
            metres.push(if known {
                f32::from(steps) / code.steps_per_metre
            } else {
                0.0
            });
        }
    }
    Ok(Ok(DepthMap::from_z_depths(shown, metres)))
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
