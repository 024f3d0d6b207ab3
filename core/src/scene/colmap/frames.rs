//! Images and points of a model to frames.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::model::Model;
use super::{Listed, MOST_ERROR};
use crate::scene::camera::{FARTHEST, placed};
use crate::scene::files::{refuse_most, warn};
use crate::scene::images::{ImageFile, ImageProblem, warn_of_turns};
use crate::scene::keyframes::Keeping;
use crate::scene::{Frame, FramePixels, OpenOptions, Pixels, SceneError, SparsePoint};

/// From the model's coordinates to the scene's.
pub(super) struct Placing {
    /// The zero of the scene, in the model's coordinates.
    pub origin: DVec3,
    /// The length of a metre, in the model's unit.
    pub unit: f64,
}

/// The frames that could be decoded.
pub(super) struct Read {
    pub frames: Vec<Frame>,
    /// Distances between the places that show a point of the model, trusted or not, and the points' projections,
    /// in pixels of the images on disk.
    pub errors: Vec<f64>,
}

/// Decodes the images and finds the points that they show; images that cannot be used are left out, up to
/// half of them.
pub(super) fn decode(
    folder: &Path,
    listed: &[Listed],
    model: &Model,
    (placing, options): (&Placing, OpenOptions),
    progress: &(dyn Fn(usize, usize) + Sync),
    warnings: &mut Vec<String>,
) -> Result<Read, SceneError> {
    let keeping = Keeping::of(listed.iter().map(|listed| (&listed.pinhole, false)), options);
    let (done, total) = (AtomicUsize::new(0), listed.len());
    let decoded: Vec<_> = listed
        .par_iter()
        .enumerate()
        .map(|(number, listed)| {
            let image = ImageFile {
                path: listed.path.clone(),
                mask: listed.mask.clone(),
                lens: listed.lens,
                pinhole: listed.pinhole,
            };
            let decoded = image.decode();
            progress(1 + done.fetch_add(1, Ordering::Relaxed), total);
            decoded.map(|(color, turn)| {
                let mut projected = Projected::new(listed, model);
                projected
                    .trusted
                    .retain(|&pixel, _| !color.is_hidden(pixel as usize));
                let again = move || Ok(Pixels::new(image.decode_again()?, None));
                let pixels = keeping.keep(number, Pixels::new(color, None), again);
                (pixels, turn, projected)
            })
        })
        .collect();
    let mut read = Read {
        frames: Vec::new(),
        errors: Vec::new(),
    };
    let (mut missing, mut unreadable, mut odd) = (Vec::new(), Vec::new(), Vec::new());
    let (mut badly_masked, mut turns) = (Vec::new(), Vec::new());
    for (listed, decoded) in listed.iter().zip(decoded) {
        let name = listed.path.strip_prefix(folder).unwrap_or(&listed.path);
        let name = format!("{:?}", name.to_string_lossy());
        match decoded {
            Ok((pixels, turn, projected)) => {
                turns.push((name, turn));
                read.frames.push(frame(listed, pixels, &projected, placing));
                read.errors.extend(projected.errors);
            }
            Err(ImageProblem::Missing) => missing.push(name),
            Err(ImageProblem::Unreadable(reason)) => unreadable.push(format!("{name} ({reason})")),
            Err(ImageProblem::Mask(reason)) => badly_masked.push(format!("{name} ({reason})")),
            Err(problem @ ImageProblem::Size(..)) => {
                odd.push(format!("{name} ({})", problem.describe(&listed.lens)));
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
        refuse_most(folder, names, total, |count, first| {
            format!("{count} of {total} images {what}, first {first}; {remedy}")
        })?;
        warn(warnings, &format!("images {what} and were left out"), names);
    }
    warn_of_turns(warnings, &turns);
    if read.frames.is_empty() {
        return Err(SceneError::file(
            folder,
            "holds no usable image of the model; put the images that the model was made from there",
        ));
    }
    Ok(read)
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
    fn new(listed: &Listed, model: &Model) -> Self {
        let world_to_camera = listed.camera_to_world.inverse();
        let diagonal = f64::from(listed.lens.image.width).hypot(f64::from(listed.lens.image.height));
        let mut projected = Self {
            errors: Vec::new(),
            trusted: BTreeMap::new(),
        };
        for seen in &listed.observations {
            let Some(point) = model.points.get(&seen.point) else {
                continue;
            };
            let local = world_to_camera.transform_point3(point.position);
            let place = listed.lens.place(local.x / local.z, local.y / local.z);
            let error = place
                .filter(|_| local.z > 0.0)
                .map_or(f64::NAN, |(x, y)| (x - seen.x).hypot(y - seen.y));
            projected
                .errors
                .push(if error.is_finite() { error } else { diagonal });
            let pixel = listed.lens.to_pinhole(&listed.pinhole, seen.x, seen.y);
            let Some((x, y)) = pixel.filter(|_| error <= MOST_ERROR && model.trusted(seen.point).is_some())
            else {
                continue;
            };
            let pixel = y as u32 * listed.pinhole.width + x as u32;
            let entry = projected.trusted.entry(pixel).or_insert((0.0, f64::INFINITY));
            if error < entry.1 {
                *entry = (local.length(), error);
            }
        }
        projected
    }
}

fn frame(listed: &Listed, pixels: FramePixels, projected: &Projected, placing: &Placing) -> Frame {
    let points = projected
        .trusted
        .iter()
        .map(|(&pixel, &(distance, error))| SparsePoint {
            pixel,
            length: (distance / placing.unit) as f32,
            error: error as f32,
        })
        .filter(|point| point.length > 0.0 && f64::from(point.length) <= FARTHEST);
    Frame {
        stem: listed.stem.clone(),
        path: listed.path.clone(),
        camera: listed.pinhole,
        camera_to_world: placed(&listed.camera_to_world, placing.origin, placing.unit),
        pixels,
        points: points.collect(),
        lens: (!listed.lens.distortion.is_none()).then_some(listed.lens),
    }
}
