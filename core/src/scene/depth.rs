//! Depth images beside colour images.

use std::path::Path;
use std::sync::Arc;

use image::DynamicImage;

use super::error::ImageError;
use super::files::decode_image;
use super::frame::to_image;
use super::images::ImageFile;
use super::{Camera, ColorImage, DepthMap};

/// Pixels by which single precision of the intrinsics may move a place: one on the border between two pixels falls on
/// the same side everywhere.
const ROUNDING: f64 = 1e-3;

/// The camera of depth images of this width and height in pixels. It has the place and the direction of the colour
/// camera.
pub(super) type DepthCamera = dyn Fn(u32, u32) -> Result<Camera, String> + Send + Sync;

/// How the depth images of a capture are read: 16 bits a pixel, along the camera's z axis; 0 is always unknown.
#[derive(Clone)]
pub(super) struct DepthImages {
    /// The value of a metre.
    pub steps_per_metre: f32,
    /// Another value for unknown depth.
    pub none: u16,
    /// Their camera; `None` where they show what their colour images show, at any size.
    pub camera: Option<Arc<DepthCamera>>,
}

impl DepthImages {
    /// Millimetres, 0 where the depth is unknown, of what the colour images show.
    pub const MILLIMETRES: Self = Self {
        steps_per_metre: 1000.0,
        none: 0,
        camera: None,
    };

    /// Depth of the pixels of the frame of a colour image as ray lengths: each pixel has the step that the depth image has
    /// in the direction of its centre, as a mean across a border would be a surface that is not there. Hidden pixels have
    /// none.
    ///
    /// # Errors
    /// A file that cannot be decoded, or of a size for which there is no camera.
    pub fn decode(&self, path: &Path, image: &ImageFile, color: &ColorImage) -> Result<DepthMap, ImageError> {
        let DynamicImage::ImageLuma16(depth) = decode_image(path)? else {
            return Err(ImageError::NotDepth);
        };
        let (width, height) = depth.dimensions();
        let (shown, camera, lens) = (&image.lens.image, &image.pinhole, image.bent());
        let own = match &self.camera {
            Some(camera) => camera(width, height).map_err(ImageError::DepthCamera)?,
            None => {
                let shape = ImageError::Shape((width, height), (shown.width, shown.height));
                shown.resized(width, height).ok_or(shape)?
            }
        };
        let columns = lookup(shown.width, [shown.fx, shown.cx], width, [own.fx, own.cx]);
        let rows = lookup(shown.height, [shown.fy, shown.cy], height, [own.fy, own.cy]);
        let mut metres = Vec::with_capacity(camera.pixels());
        for row in 0..camera.height {
            for column in 0..camera.width {
                let place = to_image(camera, lens.as_ref(), [column, row]);
                let place = place.filter(|_| !color.is_hidden(metres.len()));
                let place = place.and_then(|[x, y]| columns[x as usize].zip(rows[y as usize]));
                let steps = place.map(|(x, y)| depth.get_pixel(x, y).0[0]);
                let known = steps.filter(|&steps| steps != self.none);
                metres.push(f32::from(known.unwrap_or(0)) / self.steps_per_metre);
            }
        }
        Ok(DepthMap::from_z_depths(camera, metres))
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
