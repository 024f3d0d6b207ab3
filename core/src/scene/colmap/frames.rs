//! Images and points of a model to frames.

use std::collections::BTreeMap;
use std::path::Path;

use super::model::{Model, Observation};
use super::{Images, MOST_ERROR};
use crate::scene::camera::FARTHEST;
use crate::scene::error::{ImageError, refuse};
use crate::scene::files::leave_out;
use crate::scene::images::warn_of_turns;
use crate::scene::reading::{Listed, Placing, Progress, ReadDepth, read_frames};
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
    let no_depth = |_: &Listed| -> ReadDepth { Box::new(|_, _| Ok(Err(ImageError::Missing))) };
    let decoded = read_frames(listed, placing, options, progress, no_depth, project)?;
    let total = listed.len();
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    let (mut missing, mut unreadable, mut odd) = (Vec::new(), Vec::new(), Vec::new());
    let (mut badly_masked, mut turns) = (Vec::new(), Vec::new());
    for (listed, decoded) in listed.iter().zip(decoded) {
        let name = listed.name.clone();
        match decoded {
            Ok(mut decoded) => {
                turns.push((name, decoded.turn));
                decoded.frame.points = decoded.seen.points(placing.unit);
                frames.push(decoded.frame);
                errors.extend(decoded.seen.errors);
            }
            Err(ImageError::Missing) => missing.push(name),
            Err(error) => {
                let problems = match error {
                    ImageError::Size(..) => &mut odd,
                    ImageError::Mask(_) => &mut badly_masked,
                    _ => &mut unreadable,
                };
                problems.push(format!("{name} ({error})"));
            }
        }
    }
    for (names, what, remedy) in [
        (
            &missing,
            "of the model are missing",
            "put the images that the model was made from there",
        ),
        (&unreadable, "cannot be read", "copy the capture again"),
        (
            &odd,
            "have another size than their camera in the model",
            "use the images that the model was made from, or scale the model's cameras",
        ),
        (
            &badly_masked,
            "have a mask that cannot be used",
            "correct the masks, or remove them",
        ),
    ] {
        let left_out = format!("images {what} and were left out");
        leave_out(warnings, folder, (names, total), &left_out, |count, first| {
            format!("{count} of {total} images {what}, first {first}; {remedy}")
        })?;
    }
    warn_of_turns(warnings, &turns);
    if frames.is_empty() {
        refuse!(
            folder,
            "holds no usable image of the model; put the images that the model was made from there"
        );
    }
    Ok((frames, errors))
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
