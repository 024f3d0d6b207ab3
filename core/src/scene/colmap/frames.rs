//! Images and points of a model to frames.

use std::collections::BTreeMap;
use std::path::Path;

use super::model::{Model, Observation};
use super::{Images, MOST_ERROR};
use crate::scene::camera::FARTHEST;
use crate::scene::depth::DepthImages;
use crate::scene::reading::{Listed, Placing, Progress, Unusable, keep_usable, read_frames};
use crate::scene::{ColorImage, Frame, OpenOptions, SceneError, SparsePoint};

/// Decodes the images and finds the points that they show; images that cannot be used are left out, up to
/// half of them.
///
/// The frames, and the distances between the places that show a point of the model, trusted or not, and the points'
/// projections, in pixels of the images on disk.
pub(super) fn decode(
    folder: &Path,
    (listed, observations): &Images,
    model: &Model,
    (placing, options): (Placing, OpenOptions),
    progress: Progress,
    warnings: &mut Vec<String>,
) -> Result<(Vec<Frame>, Vec<f64>), SceneError> {
    let project = |number: usize, color: &ColorImage| {
        let mut projected = Projected::new(&listed[number], &observations[number], model);
        projected
            .trusted
            .retain(|&pixel, _| !color.is_hidden(pixel as usize));
        projected
    };
    // No frame lists a depth image.
    let depth = &DepthImages::MILLIMETRES;
    let read = read_frames(listed, placing, options, progress, depth, project)?;
    let unusable = Unusable {
        images: folder,
        depths: folder,
        of: "of the model's",
        remedy: "use the images that the model was made from, or copy the capture again",
        depth: "",
    };
    let mut errors = Vec::new();
    let read = keep_usable(listed, read, &unusable, warnings)?.into_iter();
    let frames = read.map(|(mut frame, projected)| {
        frame.points = projected.points(placing.unit);
        errors.extend(projected.errors);
        frame
    });
    Ok((frames.collect(), errors))
}

/// What an image shows of the model's points.
struct Projected {
    /// Distances between the places of points and their projections, in pixels; where there is no projection,
    /// such as behind the camera, the diagonal of the image.
    errors: Vec<f64>,
    /// Trusted points by the frame's pixel: distance in the model's unit and reprojection error; the most
    /// exact where a pixel has several.
    trusted: BTreeMap<u32, (f64, f64)>,
}

impl Projected {
    fn new(listed: &Listed, observations: &[Observation], model: &Model) -> Self {
        let world_to_camera = listed.camera_to_world.inverse();
        let (lens, pinhole) = (&listed.image.lens, &listed.image.pinhole);
        let diagonal = f64::from(lens.image.width).hypot(f64::from(lens.image.height));
        let mut projected = Self {
            errors: Vec::new(),
            trusted: BTreeMap::new(),
        };
        for seen in observations {
            let Some(point) = model.points.get(&seen.point) else {
                continue;
            };
            let local = world_to_camera.transform_point3(point.position);
            let place = lens.place(local.x / local.z, local.y / local.z);
            let error = place
                .filter(|_| local.z > 0.0)
                .map_or(f64::NAN, |(x, y)| (x - seen.x).hypot(y - seen.y));
            projected
                .errors
                .push(if error.is_finite() { error } else { diagonal });
            let pixel = lens.to_pinhole(pinhole, seen.x, seen.y);
            let Some((x, y)) = pixel.filter(|_| error <= MOST_ERROR && model.trusted(seen.point).is_some())
            else {
                continue;
            };
            let pixel = y as u32 * pinhole.width + x as u32;
            let entry = projected.trusted.entry(pixel).or_insert((0.0, f64::INFINITY));
            if error < entry.1 {
                *entry = (local.length(), error);
            }
        }
        projected
    }

    /// The trusted points, in metres of `unit` each.
    fn points(&self, unit: f64) -> Vec<SparsePoint> {
        let points = self
            .trusted
            .iter()
            .map(|(&pixel, &(distance, error))| SparsePoint {
                pixel,
                length: (distance / unit) as f32,
                error: error as f32,
                by_stereo: false,
            });
        points
            .filter(|point| point.length > 0.0 && f64::from(point.length) <= FARTHEST)
            .collect()
    }
}
