//! Captures with an image, a pose and mostly a depth image for each frame, all from one camera: what the
//! layouts of this kind have in common.

pub(super) mod pose_files;
pub(super) mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::camera::median_position;
use super::depth::DepthImages;
use super::error::{ImageError, refuse};
use super::files::{dimensions, file_name, leave_out, numbered_files, stem};
use super::images::ImageFile;
use super::reading::{Listed, Placing, Progress, Unusable, keep_usable, read_frames};
use super::{Camera, OpenOptions, Scene, SceneError, SceneSource};
use text::read_intrinsics;

/// Distance of the cameras from zero beyond which the scene gets its own origin, in metres.
const FAR_FROM_ZERO: f64 = 100.0;

/// What to do where most images are unusable.
const COPY_AGAIN: &str = "copy the capture again";

/// A frame whose image has not been looked at.
pub(super) struct Found {
    /// The colour image.
    pub path: PathBuf,
    /// The depth image, where there is one and it is wanted.
    pub depth: Option<PathBuf>,
    /// Camera-to-world in the capture's own coordinates, in metres.
    pub camera_to_world: DAffine3,
}

/// How the layouts differ.
pub(super) struct Layout<'a> {
    /// Name of the format.
    pub format: &'static str,
    /// The capture; `intrinsics.txt` in it goes before the default camera.
    pub folder: &'a Path,
    /// Folder of the colour images, for messages.
    pub images: &'a Path,
    /// Folder of the depth images, for messages.
    pub depths: &'a Path,
    /// How depth images are read.
    pub depth: DepthImages,
    /// The camera of images of this width and height in pixels.
    pub default_camera: &'a (dyn Fn(u32, u32) -> Result<Camera, String> + Sync),
    /// What to say where that camera was taken.
    pub default_camera_note: Option<String>,
}

/// Depth images in `depth/` by number; empty where there is no depth or none is wanted.
pub(super) fn depths(folder: &Path, options: OpenOptions) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let depth = folder.join("depth");
    if options.depth && depth.is_dir() {
        numbered_files(&depth, &["png"], &mut Vec::new())
    } else {
        Ok(BTreeMap::new())
    }
}

/// Decodes the listed frames; those that cannot be used are left out and counted, up to half of them.
///
/// # Errors
/// More than that, or intrinsics that do not fit.
pub(super) fn read(
    layout: &Layout,
    found: Vec<Found>,
    mut warnings: Vec<String>,
    mut notes: Vec<String>,
    options: OpenOptions,
    progress: Progress,
) -> Result<Scene, SceneError> {
    let listed = with_cameras(layout, found, &mut warnings, &mut notes)?;
    let has_depth = listed.iter().any(|frame| frame.depth.is_some());
    let median = median_position(listed.iter().map(|frame| frame.camera_to_world.translation));
    let is_far = median.length() > FAR_FROM_ZERO;
    let origin = if is_far { median } else { DVec3::ZERO };
    let placing = Placing { origin, unit: 1.0 };
    let mut read = read_frames(&listed, placing, options, progress, &layout.depth, |_, _| ())?;
    for (frame, read) in listed.iter().zip(&mut read) {
        if let Ok(read) = read
            && has_depth
            && frame.depth.is_none()
        {
            read.depth_problem = Some(format!("that of {} (no file)", frame.name));
        }
    }
    let unusable = Unusable {
        images: layout.images,
        depths: layout.depths,
        of: "of",
        remedy: COPY_AGAIN,
        depth: "missing or cannot be read",
    };
    let read = keep_usable(&listed, read, &unusable, &mut warnings)?;
    let frames = read.into_iter().map(|(frame, ())| frame).collect();
    let source = SceneSource::Folder(layout.folder.to_path_buf());
    Ok(Scene {
        origin,
        warnings,
        notes,
        ..Scene::new(source, layout.format, frames)
    })
}

/// A camera whose intrinsics are published for images of 640 x 480 pixels, at this size.
///
/// `intrinsics` are fx, fy, cx and cy in pixels, with the centre of the top left pixel at (0.5, 0.5).
///
/// # Errors
/// Images of other proportions, which must have been cropped.
pub(super) fn published_camera(intrinsics: [f32; 4], width: u32, height: u32) -> Result<Camera, String> {
    if u64::from(width) * 480 != u64::from(height) * 640 {
        return Err(format!(
            "no such file, and the intrinsics that are known are for 640x480 pixels, not for images of \
             {width}x{height}; write six numbers there: fx fy cx cy width height"
        ));
    }
    Ok(Camera::new([640, 480], intrinsics).stretched(width, height))
}

/// The refusal of a capture with so many unusable poses, the first of which this says.
pub(super) fn unusable_poses(count: usize, total: usize, first: &str) -> String {
    format!(
        "{count} of {total} poses are unusable, first {first}; each must be rigid, camera-to-world, in metres"
    )
}

/// The frames, each with its camera: that of the capture, scaled where the image has the same proportions but another size.
/// Images of other proportions are left out, up to half of them; those that cannot be read are not yet.
fn with_cameras(
    layout: &Layout,
    found: Vec<Found>,
    warnings: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<Vec<Listed>, SceneError> {
    let sizes: Vec<Result<(u32, u32), ImageError>> =
        found.par_iter().map(|frame| dimensions(&frame.path)).collect();
    let total = found.len();
    let mut counts = BTreeMap::new();
    for &size in sizes.iter().flatten() {
        *counts.entry(size).or_insert(0_usize) += 1;
    }
    let Some((&(width, height), _)) = counts.iter().max_by_key(|&(_, &count)| count) else {
        let first = found.iter().zip(&sizes).find_map(|(frame, size)| {
            let error = size.as_ref().err()?;
            Some(format!("{} ({error})", file_name(&frame.path)))
        });
        let first = first.unwrap_or_default();
        refuse!(
            layout.images,
            "{total} of {total} images cannot be used, first {first}; {COPY_AGAIN}"
        );
    };
    let given = given_camera(layout, (width, height), notes)?;
    let camera = match given {
        Some(camera) => camera,
        None => {
            let camera = (layout.default_camera)(width, height);
            let camera = camera.and_then(|camera| match camera.problem() {
                None => Ok(camera),
                Some(problem) => Err(format!(
                    "no such file, and the usual camera does not fit images of {width}x{height} pixels ({problem}); \
                     write six numbers there: fx fy cx cy width height"
                )),
            });
            let intrinsics = layout.folder.join("intrinsics.txt");
            camera.map_err(|error| SceneError::file(intrinsics, error))?
        }
    };
    let (mut odd, mut scaled) = (Vec::new(), 0);
    let mut usable = Vec::new();
    for (frame, size) in found.into_iter().zip(sizes) {
        let name = file_name(&frame.path);
        let (w, h) = size.unwrap_or((width, height));
        let Some(own) = camera.resized(w, h).filter(|own| own.problem().is_none()) else {
            odd.push(format!("{name} ({w}x{h})"));
            continue;
        };
        scaled += usize::from((w, h) != (width, height));
        usable.push(Listed {
            stem: stem(&frame.path),
            name,
            image: ImageFile::plain(frame.path, own),
            depth: frame.depth,
            camera_to_world: frame.camera_to_world,
        });
    }
    let what = format!(
        "images were left out because they do not have the proportions of the others, which have {width}x{height} pixels"
    );
    leave_out(warnings, layout.images, (&odd, total), &what, |_, _| {
        "most images differ in size and proportions from each other; all frames must come from one camera"
            .to_owned()
    })?;
    if scaled > 0 {
        notes.push(format!(
            "{scaled} images are smaller or larger than {width}x{height} pixels but have the same proportions: their \
             intrinsics were scaled"
        ));
    }
    if given.is_none() {
        notes.extend(layout.default_camera_note.clone());
    }
    Ok(usable)
}

/// The camera in `intrinsics.txt` for images of this size, if there is that file; what is for images of the same
/// proportions is scaled, which a note says.
fn given_camera(
    layout: &Layout,
    (width, height): (u32, u32),
    notes: &mut Vec<String>,
) -> Result<Option<Camera>, SceneError> {
    let path = layout.folder.join("intrinsics.txt");
    if !path.exists() {
        return Ok(None);
    }
    let given = read_intrinsics(&path)?;
    let Some(camera) = given.resized(width, height) else {
        refuse!(
            path,
            "is for images of {}x{} pixels, but those in {}/ have {width}x{height}, which is another shape; write \
                 intrinsics for these images",
            given.width,
            given.height,
            file_name(layout.images)
        );
    };
    if let Some(problem) = camera.problem() {
        refuse!(
            path,
            "does not fit images of {width}x{height} pixels ({problem}); write intrinsics for these images"
        );
    }
    if camera != given {
        notes.push(format!(
            "intrinsics.txt is for images of {}x{} pixels and was scaled to {width}x{height}",
            given.width, given.height
        ));
    }
    Ok(Some(camera))
}
