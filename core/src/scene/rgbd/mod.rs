//! Captures with an image, a pose and mostly a depth image for each frame, all from one camera: what the
//! layouts of this kind have in common.

#[cfg(test)]
mod tests;
pub(super) mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DAffine3, DVec3};
use image::DynamicImage;
use rayon::prelude::*;

use super::camera::{median_position, orthonormalised};
use super::files::{Reach, decode_image, file_name, reader, stem, warn};
use super::{Camera, ColorImage, DepthMap, Frame, OpenOptions, Scene, SceneError, SceneSource};
use text::read_intrinsics;

/// Distance of the cameras from zero beyond which the scene gets its own origin, in metres.
const FAR_FROM_ZERO: f64 = 100.0;
/// Most frames that are taken of a long sequence: about what fits in 3 GB at 640 x 480 with depth.
const MOST_FRAMES: usize = 1000;

/// A frame that is still on disk.
pub(super) struct Listed {
    /// The colour image.
    pub path: PathBuf,
    /// The depth image, where there is one and it is wanted.
    pub depth: Option<PathBuf>,
    /// Camera-to-world in the capture's own coordinates, in metres.
    pub camera_to_world: DAffine3,
}

/// What the values of a 16-bit depth image mean, along the camera's z axis; 0 is always unknown.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthCode {
    /// The value of a metre.
    pub steps_per_metre: f32,
    /// Another value for unknown depth.
    pub none: u16,
}

/// How the layouts differ.
pub(super) struct Layout<'a> {
    /// Name of the format.
    pub format: &'static str,
    /// The capture; `intrinsics.txt` in it goes before the default camera.
    pub folder: &'a Path,
    /// What to read of it.
    pub options: OpenOptions,
    /// Folder of the colour images, for messages.
    pub images: &'a Path,
    /// Folder of the depth images, for messages.
    pub depths: &'a Path,
    /// What depth images mean.
    pub depth_code: DepthCode,
    /// The camera of images of this width and height in pixels, or why none is known and what to do.
    pub default_camera: &'a (dyn Fn(u32, u32) -> Result<Camera, String> + Sync),
    /// What to say where that camera was taken.
    pub default_camera_note: Option<String>,
}

/// Decodes the listed frames; those that cannot be used are left out and counted, up to half of them.
///
/// # Errors
/// More than that, an image outside the capture where that is not allowed, intrinsics that do not fit, or a depth
/// image of another size than its colour image.
pub(super) fn read(
    layout: &Layout,
    listed: &[Listed],
    mut warnings: Vec<String>,
    mut notes: Vec<String>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Scene, SceneError> {
    let reach = Reach::of(layout.folder, layout.options);
    for frame in listed {
        for path in [Some(&frame.path), frame.depth.as_ref()].into_iter().flatten() {
            reach.check_file(path)?;
        }
    }
    let (camera, listed) = choose_camera(layout, listed, &mut warnings, &mut notes)?;
    let depth_code = listed
        .iter()
        .any(|frame| frame.depth.is_some())
        .then_some(layout.depth_code);
    let origin = choose_origin(&listed);
    let done = AtomicUsize::new(0);
    let decoded = listed
        .par_iter()
        .map(|frame| {
            let decoded = decode(frame, &camera, origin, depth_code);
            progress(1 + done.fetch_add(1, Ordering::Relaxed), listed.len());
            decoded
        })
        .collect::<Result<Vec<_>, SceneError>>()?;
    let frames = keep_usable(layout, &listed, decoded, &mut warnings)?;
    Ok(Scene {
        source: SceneSource::Folder(layout.folder.to_path_buf()),
        format: layout.format,
        frames,
        origin,
        unit: 1.0,
        point_errors: None,
        warnings,
        notes,
    })
}

/// Evenly spaced frames of a sequence that is longer than fits in memory, which a note says.
pub(super) fn thinned(listed: Vec<Listed>, notes: &mut Vec<String>) -> Vec<Listed> {
    let total = listed.len();
    if total <= MOST_FRAMES {
        return listed;
    }
    notes.push(format!(
        "of the {total} usable frames {MOST_FRAMES} evenly spaced ones were taken"
    ));
    let kept_before = |index: usize| index * MOST_FRAMES / total;
    let is_kept = |index: usize| kept_before(index + 1) > kept_before(index);
    let numbered = listed.into_iter().enumerate();
    numbered
        .filter(|(index, _)| is_kept(*index))
        .map(|(_, frame)| frame)
        .collect()
}

/// A camera whose intrinsics are published for images of 640 x 480 pixels, at this size.
///
/// `focal` and `center` are `[x, y]` in pixels, with the centre of the top left pixel at (0.5, 0.5).
///
/// # Errors
/// Images of other proportions, which must have been cropped.
pub(super) fn published_camera(
    focal: [f32; 2],
    center: [f32; 2],
    width: u32,
    height: u32,
) -> Result<Camera, String> {
    if u64::from(width) * 480 != u64::from(height) * 640 {
        return Err(format!(
            "no such file, and the intrinsics that are known are for 640x480 pixels, not for images of \
             {width}x{height}; write six numbers there: fx fy cx cy width height"
        ));
    }
    let scale = width as f32 / 640.0;
    Ok(Camera {
        width,
        height,
        fx: scale * focal[0],
        fy: scale * focal[1],
        cx: scale * center[0],
        cy: scale * center[1],
    })
}

/// Refuses a capture most of whose poses are unusable; `bad` says where they are and why.
///
/// # Errors
/// More than half of the `total` poses are bad.
pub(super) fn check_poses(path: &Path, bad: &[String], total: usize) -> Result<(), SceneError> {
    match bad.first().filter(|_| 2 * bad.len() > total) {
        Some(first) => Err(SceneError::file(
            path,
            format!(
                "{} of {total} poses are unusable, first {first}; each must be rigid, camera-to-world, in metres",
                bad.len()
            ),
        )),
        None => Ok(()),
    }
}

/// The camera of all frames; and the frames whose images can be read and have its size.
fn choose_camera<'a>(
    layout: &Layout,
    listed: &'a [Listed],
    warnings: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<(Camera, Vec<&'a Listed>), SceneError> {
    let sizes: Vec<Result<(u32, u32), String>> = listed
        .par_iter()
        .map(|frame| {
            reader(&frame.path)?
                .into_dimensions()
                .map_err(|error| error.to_string())
        })
        .collect();
    let intrinsics = layout.folder.join("intrinsics.txt");
    let camera = if intrinsics.exists() {
        Some(read_intrinsics(&intrinsics)?)
    } else {
        None
    };
    let mut counts = BTreeMap::new();
    for &size in sizes.iter().flatten() {
        *counts.entry(size).or_insert(0_usize) += 1;
    }
    let Some((&(width, height), &common)) = counts.iter().max_by_key(|&(_, &count)| count) else {
        return too_many_unreadable(listed, &sizes);
    };
    if let Some(camera) = camera.filter(|camera| (camera.width, camera.height) != (width, height)) {
        return Err(SceneError::file(
            intrinsics,
            format!(
                "is for images of {}x{} pixels, but those in {}/ have {width}x{height}; \
                 scale the intrinsics or the images so that both agree",
                camera.width,
                camera.height,
                file_name(layout.images)
            ),
        ));
    }
    let readable = sizes.iter().flatten().count();
    if 2 * (sizes.len() - readable) > sizes.len() {
        return too_many_unreadable(listed, &sizes);
    }
    if 2 * (readable - common) > sizes.len() {
        return Err(SceneError::file(
            layout.images,
            "most images differ in size from each other; all frames must come from one camera",
        ));
    }
    let (mut unreadable, mut odd) = (Vec::new(), Vec::new());
    let mut usable = Vec::new();
    for (frame, size) in listed.iter().zip(sizes) {
        let name = file_name(&frame.path);
        match size {
            Ok(size) if size == (width, height) => usable.push(frame),
            Ok((w, h)) => odd.push(format!("{name} ({w}x{h})")),
            Err(error) => unreadable.push(format!("{name} ({error})")),
        }
    }
    warn(warnings, "images cannot be read and were left out", &unreadable);
    warn(
        warnings,
        &format!("images were left out because they are not {width}x{height} pixels like the others"),
        &odd,
    );
    let camera = match camera {
        Some(camera) => camera,
        None => {
            notes.extend(layout.default_camera_note.clone());
            (layout.default_camera)(width, height).map_err(|reason| SceneError::file(intrinsics, reason))?
        }
    };
    Ok((camera, usable))
}

fn too_many_unreadable<T>(listed: &[Listed], sizes: &[Result<(u32, u32), String>]) -> Result<T, SceneError> {
    let bad: Vec<(&Listed, &String)> = listed
        .iter()
        .zip(sizes)
        .filter_map(|(frame, size)| size.as_ref().err().map(|error| (frame, error)))
        .collect();
    let (path, error) = bad.first().map_or((PathBuf::new(), ""), |(frame, error)| {
        (frame.path.clone(), error.as_str())
    });
    Err(SceneError::file(
        path,
        format!(
            "cannot be read ({error}), like {} of {} images; copy the capture again",
            bad.len(),
            listed.len()
        ),
    ))
}

/// A decoded frame, or why there is none; and why it has no depth though there should be some.
struct Decoded {
    frame: Result<Frame, String>,
    depth_problem: Option<String>,
}

fn decode(
    listed: &Listed,
    camera: &Camera,
    origin: DVec3,
    depth_code: Option<DepthCode>,
) -> Result<Decoded, SceneError> {
    let color = match decode_image(&listed.path) {
        Ok(image) => ColorImage::new(camera.width, camera.height, image.into_rgb8().into_raw()),
        Err(reason) => {
            return Ok(Decoded {
                frame: Err(reason),
                depth_problem: None,
            });
        }
    };
    let (depth, depth_problem) = match (depth_code, &listed.depth) {
        (Some(code), Some(path)) => match decode_depth(path, camera, code)? {
            Ok(depth) => (Some(depth), None),
            Err(reason) => (None, Some(format!("{} ({reason})", file_name(path)))),
        },
        (Some(_), None) => (
            None,
            Some(format!("that of {} (no file)", file_name(&listed.path))),
        ),
        (None, _) => (None, None),
    };
    let pose = &listed.camera_to_world;
    let frame = color
        .map(|color| Frame {
            stem: stem(&listed.path),
            path: listed.path.clone(),
            camera: *camera,
            camera_to_world: Affine3A::from_mat3_translation(
                orthonormalised(pose.matrix3).as_mat3(),
                (pose.translation - origin).as_vec3(),
            ),
            color,
            depth,
            points: Vec::new(),
            lens: None,
        })
        .ok_or_else(|| "its size changed while it was read".to_owned());
    Ok(Decoded { frame, depth_problem })
}

/// Depth as ray lengths, or why it cannot be used; depth of another size than its image is an error.
fn decode_depth(
    path: &Path,
    camera: &Camera,
    code: DepthCode,
) -> Result<Result<DepthMap, String>, SceneError> {
    let image = match decode_image(path) {
        Ok(DynamicImage::ImageLuma16(image)) => image,
        Ok(_) => return Ok(Err("not a 16-bit greyscale PNG".to_owned())),
        Err(reason) => return Ok(Err(reason)),
    };
    if image.dimensions() != (camera.width, camera.height) {
        return Err(SceneError::file(
            path,
            format!(
                "has {}x{} pixels, but its colour image {}x{}; register depth to colour and save it at the same size",
                image.width(),
                image.height(),
                camera.width,
                camera.height
            ),
        ));
    }
    let metres = image.into_raw().into_iter().map(|steps| {
        if steps == code.none {
            0.0
        } else {
            f32::from(steps) / code.steps_per_metre
        }
    });
    Ok(Ok(DepthMap::from_z_depths(camera, metres.collect())))
}

/// The frames that could be decoded, if they are most of the capture.
fn keep_usable(
    layout: &Layout,
    listed: &[&Listed],
    decoded: Vec<Decoded>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Frame>, SceneError> {
    let total = decoded.len();
    let (mut frames, mut bad, mut bad_depth) = (Vec::new(), Vec::new(), Vec::new());
    for (decoded, listed) in decoded.into_iter().zip(listed) {
        match decoded.frame {
            Ok(frame) => frames.push(frame),
            Err(reason) => bad.push(format!("{} ({reason})", file_name(&listed.path))),
        }
        bad_depth.extend(decoded.depth_problem);
    }
    for (problems, folder, what, otherwise) in [
        (&bad, layout.images, "images cannot be read", ""),
        (
            &bad_depth,
            layout.depths,
            "depth images are missing or cannot be read",
            ", or open it without depth",
        ),
    ] {
        if let Some(first) = problems.first().filter(|_| 2 * problems.len() > total) {
            return Err(SceneError::file(
                folder,
                format!(
                    "{} of {total} {what}, first {first}; copy the capture again{otherwise}",
                    problems.len()
                ),
            ));
        }
    }
    warn(warnings, "images cannot be read and were left out", &bad);
    warn(
        warnings,
        "frames are used without depth because it is missing or cannot be read",
        &bad_depth,
    );
    Ok(frames)
}

/// The median camera position where it is far from zero, else zero.
fn choose_origin(listed: &[&Listed]) -> DVec3 {
    let median = median_position(listed.iter().map(|frame| frame.camera_to_world.translation));
    if median.length() > FAR_FROM_ZERO {
        median
    } else {
        DVec3::ZERO
    }
}
