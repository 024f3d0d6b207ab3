//! The Replica / Semantic-NeRF layout.
//!
//! - `rgb/rgb_N.png` (or any PNG or JPEG whose name ends in a number N)
//! - `traj_w_c.txt`: line N, counted from 0, is the row-major 4x4 camera-to-world of frame N, OpenCV axes
//! - `depth/depth_N.png`, where there is depth: 16 bit, millimetres along z, 0 = none
//! - `intrinsics.txt`: `fx fy cx cy width height`; without it, 90 degrees of horizontal field of view and the
//!   principal point in the middle, as in Semantic-NeRF

#[cfg(test)]
mod tests;
mod text;
mod write;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DAffine3, DVec3};
use image::DynamicImage;
use rayon::prelude::*;

use super::camera::{median_position, orthonormalised};
use super::files::{decode_image, file_name, reader, stem, warn};
use super::{Camera, ColorImage, DepthMap, Frame, OpenOptions, Scene, SceneError, SceneSource, transforms};
use text::{read_intrinsics, read_poses};
pub use write::{GroundTruth, write};

/// Name of the format.
pub(super) const NAME: &str = "Replica";
/// What a folder in this layout holds.
pub(super) const EXPECTED: &str =
    "colour images rgb/rgb_N.png with one camera-to-world matrix a line in traj_w_c.txt";

/// Horizontal field of view of captures without `intrinsics.txt`, in degrees.
const DEFAULT_FIELD_OF_VIEW: f32 = 90.0;
/// Distance of the cameras from zero beyond which the scene gets its own origin, in metres.
const FAR_FROM_ZERO: f64 = 100.0;

/// Whether a folder looks like this layout, complete or not.
pub(super) fn recognise(folder: &Path) -> bool {
    // A folder named rgb is also what a transforms.json may list images in.
    let named_alike = folder.join("rgb").is_dir() && !transforms::recognise(folder);
    named_alike || folder.join("traj_w_c.txt").is_file()
}

/// A frame that is still on disk.
struct Listed {
    number: usize,
    path: PathBuf,
    camera_to_world: DAffine3,
}

/// Reads a folder in this layout.
pub(super) fn read(
    folder: &Path,
    options: OpenOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Scene, SceneError> {
    let mut warnings = Vec::new();
    let images = list_images(&folder.join("rgb"), &mut warnings)?;
    let mut listed = with_poses(folder, images, &mut warnings)?;
    let camera = choose_camera(folder, &mut listed, &mut warnings)?;
    let depths = list_depths(folder, options)?;
    let origin = choose_origin(&listed);
    let done = AtomicUsize::new(0);
    let decoded = listed
        .par_iter()
        .map(|frame| {
            let decoded = decode(frame, &camera, origin, &depths);
            progress(1 + done.fetch_add(1, Ordering::Relaxed), listed.len());
            decoded
        })
        .collect::<Result<Vec<_>, SceneError>>()?;
    let frames = keep_usable(folder, &listed, decoded, &mut warnings)?;
    Ok(Scene {
        source: SceneSource::Folder(folder.to_path_buf()),
        format: NAME,
        frames,
        origin,
        unit: 1.0,
        warnings,
        notes: Vec::new(),
    })
}

/// The colour images by number.
fn list_images(rgb: &Path, warnings: &mut Vec<String>) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    if !rgb.is_dir() {
        return Err(SceneError::file(
            rgb,
            "no such folder; put the colour images there, as rgb_0.png, rgb_1.png, ...",
        ));
    }
    let mut unnumbered = Vec::new();
    let images = numbered_files(rgb, &["png", "jpg", "jpeg"], &mut unnumbered)?;
    if images.is_empty() {
        return Err(SceneError::file(
            rgb,
            "holds no PNG or JPEG whose name ends in a number; put the colour images there, as rgb_0.png, rgb_1.png, ...",
        ));
    }
    warn(
        warnings,
        "colour images without a number in their name were left out",
        &unnumbered,
    );
    Ok(images)
}

/// Depth images by number; empty where there is no depth or none is wanted.
fn list_depths(folder: &Path, options: OpenOptions) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let depth = folder.join("depth");
    if options.depth && depth.is_dir() {
        numbered_files(&depth, &["png"], &mut Vec::new())
    } else {
        Ok(BTreeMap::new())
    }
}

/// Files of a folder with one of these extensions, by the number at the end of their stem.
fn numbered_files(
    folder: &Path,
    extensions: &[&str],
    unnumbered: &mut Vec<String>,
) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let unreadable = |error: std::io::Error| SceneError::file(folder, format!("cannot be read: {error}"));
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let wanted = path
            .extension()
            .is_some_and(|own| extensions.iter().any(|e| own.eq_ignore_ascii_case(e)));
        let name = file_name(&path);
        if !wanted || name.starts_with('.') {
            continue;
        }
        let Some(number) = trailing_number(&stem(&path)) else {
            unnumbered.push(name);
            continue;
        };
        if let Some(other) = files.insert(number, path) {
            return Err(SceneError::file(
                other,
                format!("has the same number as {name}; keep one of the two"),
            ));
        }
    }
    unnumbered.sort();
    Ok(files)
}

/// Gives each image its pose; those without a usable one are left out and counted.
fn with_poses(
    folder: &Path,
    images: BTreeMap<usize, PathBuf>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Listed>, SceneError> {
    let trajectory = folder.join("traj_w_c.txt");
    let poses = read_poses(&trajectory)?;
    let without_pose: Vec<String> = images
        .range(poses.len()..)
        .map(|(_, path)| file_name(path))
        .collect();
    if let Some(first) = without_pose
        .first()
        .filter(|_| !few(without_pose.len(), images.len()))
    {
        return Err(SceneError::file(
            trajectory,
            format!(
                "has {} poses, but {} of the {} images need a later line ({first} is the first); \
                 write one pose a line, line N for rgb_N counted from 0",
                poses.len(),
                without_pose.len(),
                images.len()
            ),
        ));
    }
    warn(
        warnings,
        "images without a pose in traj_w_c.txt were left out",
        &without_pose,
    );
    let without_image: Vec<String> = (0..poses.len())
        .filter(|number| !images.contains_key(number))
        .map(|number| format!("frame {number}"))
        .collect();
    if let Some(first) = without_image
        .first()
        .filter(|_| !few(without_image.len(), poses.len()))
    {
        return Err(SceneError::file(
            trajectory,
            format!(
                "has {} poses, but rgb/ has no image for {} of them ({first} is the first); \
                 restore the images, or remove the lines and number the images anew",
                poses.len(),
                without_image.len()
            ),
        ));
    }
    warn(warnings, "poses have no image in rgb/", &without_image);

    let mut listed = Vec::new();
    let mut bad = Vec::new();
    for (number, path) in images {
        match poses.get(number).map(|pose| (pose.line, pose.checked())) {
            Some((_, Ok(camera_to_world))) => listed.push(Listed {
                number,
                path,
                camera_to_world,
            }),
            Some((line, Err(problem))) => bad.push(format!("line {line} ({problem})")),
            None => {}
        }
    }
    if let Some(first) = bad.first().filter(|_| 2 * bad.len() > bad.len() + listed.len()) {
        return Err(SceneError::file(
            trajectory,
            format!(
                "{} of {} poses are unusable, first on {first}; each line must be a rigid camera-to-world matrix, \
                 row by row, in metres",
                bad.len(),
                bad.len() + listed.len()
            ),
        ));
    }
    warn(
        warnings,
        "frames were left out because their pose in traj_w_c.txt is unusable",
        &bad,
    );
    Ok(listed)
}

/// The camera of all frames; images that cannot be read or differ in size are dropped from the list.
fn choose_camera(
    folder: &Path,
    listed: &mut Vec<Listed>,
    warnings: &mut Vec<String>,
) -> Result<Camera, SceneError> {
    let sizes: Vec<Result<(u32, u32), String>> = listed
        .par_iter()
        .map(|frame| {
            reader(&frame.path)?
                .into_dimensions()
                .map_err(|error| error.to_string())
        })
        .collect();
    let intrinsics = folder.join("intrinsics.txt");
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
                "is for images of {}x{} pixels, but those in rgb/ have {width}x{height}; \
                 scale the intrinsics or the images so that both agree",
                camera.width, camera.height
            ),
        ));
    }
    let readable = sizes.iter().flatten().count();
    if 2 * (sizes.len() - readable) > sizes.len() {
        return too_many_unreadable(listed, &sizes);
    }
    if 2 * (readable - common) > sizes.len() {
        return Err(SceneError::file(
            folder.join("rgb"),
            "most images differ in size from each other; all frames must come from one camera",
        ));
    }
    let (mut unreadable, mut odd) = (Vec::new(), Vec::new());
    let mut sizes = sizes.into_iter();
    listed.retain(|frame| {
        let name = file_name(&frame.path);
        match sizes.next() {
            Some(Ok(size)) if size == (width, height) => return true,
            Some(Ok((w, h))) => odd.push(format!("{name} ({w}x{h})")),
            Some(Err(error)) => unreadable.push(format!("{name} ({error})")),
            None => {}
        }
        false
    });
    warn(warnings, "images cannot be read and were left out", &unreadable);
    warn(
        warnings,
        &format!("images were left out because they are not {width}x{height} pixels like the others"),
        &odd,
    );
    Ok(camera.unwrap_or_else(|| Camera::with_horizontal_fov(width, height, DEFAULT_FIELD_OF_VIEW)))
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
    depths: &BTreeMap<usize, PathBuf>,
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
    let (depth, depth_problem) = match depths.get(&listed.number) {
        Some(path) => match decode_depth(path, camera)? {
            Ok(depth) => (Some(depth), None),
            Err(reason) => (None, Some(format!("{} ({reason})", file_name(path)))),
        },
        None if depths.is_empty() => (None, None),
        None => (None, Some(format!("frame {} (no file)", listed.number))),
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
fn decode_depth(path: &Path, camera: &Camera) -> Result<Result<DepthMap, String>, SceneError> {
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
    let metres = image.into_raw().into_iter().map(|mm| f32::from(mm) * 1e-3);
    Ok(Ok(DepthMap::from_z_depths(camera, metres.collect())))
}

/// The frames that could be decoded, if they are most of the capture.
fn keep_usable(
    folder: &Path,
    listed: &[Listed],
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
    for (problems, part, what) in [
        (&bad, "rgb", "images cannot be read"),
        (&bad_depth, "depth", "depth images are missing or cannot be read"),
    ] {
        if let Some(first) = problems.first().filter(|_| 2 * problems.len() > total) {
            return Err(SceneError::file(
                folder.join(part),
                format!(
                    "{} of {total} {what}, first {first}; copy the capture again{}",
                    problems.len(),
                    if part == "depth" {
                        ", or open it without depth"
                    } else {
                        ""
                    }
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
fn choose_origin(listed: &[Listed]) -> DVec3 {
    let median = median_position(listed.iter().map(|frame| frame.camera_to_world.translation));
    if median.length() > FAR_FROM_ZERO {
        median
    } else {
        DVec3::ZERO
    }
}

/// Whether this many of `total` are a small remainder: a tenth, or one.
fn few(count: usize, total: usize) -> bool {
    count < total && count <= (total / 10).max(1)
}

/// The number that a name ends in.
fn trailing_number(name: &str) -> Option<usize> {
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name[name.len() - digits..].parse().ok()
}
