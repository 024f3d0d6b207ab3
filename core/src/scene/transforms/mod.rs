//! Captures with a `transforms.json`, as nerfstudio and instant-ngp write and read them.
//!
//! - `transforms.json`: for each frame its image, its pose and, its own or shared, its camera
//! - the colour images, and the depth images where there are any, by the paths in that file
//!
//! Poses in the file are camera-to-world with OpenGL's camera axes (x right, y up, z back); the centre of
//! the top left pixel is at (0.5, 0.5), as here.

mod file;
#[cfg(test)]
mod tests;

use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DAffine3, DVec3};
use image::DynamicImage;
use rayon::prelude::*;

use super::camera::{median_position, orthonormalised, unit_of_cameras};
use super::files::{
    ImageProblem, decode_color, decode_image, file_name, frame_names, is_inside, reader, warn,
};
use super::{Camera, DepthMap, Frame, Lens, OpenOptions, Scene, SceneError, SceneSource};
use file::Entry;
pub(super) use file::Transforms;

/// Name of the format.
pub(super) const NAME: &str = "transforms.json";
/// What a folder in this format holds.
pub(super) const EXPECTED: &str = "colour images with their poses in transforms.json";

/// What is tried at the end of an image's path that has no file.
const EXTENSIONS: [&str; 4] = ["", ".png", ".jpg", ".jpeg"];

/// Whether a folder looks like this format, complete or not.
pub(super) fn recognise(folder: &Path) -> bool {
    folder.join("transforms.json").is_file()
}

/// A frame that is still on disk, in the file's own coordinates.
struct Listed {
    /// Path of the colour image below the folder.
    name: String,
    path: PathBuf,
    depth: Option<PathBuf>,
    camera_to_world: DAffine3,
    lens: Lens,
    /// The camera of the frame: the lens's own where it bends nothing.
    pinhole: Camera,
}

/// From the file's coordinates to the scene's.
struct Placing {
    /// The zero of the scene, in the file's coordinates.
    origin: DVec3,
    /// The length of a metre, in the file's unit.
    unit: f64,
    /// The length of a step of the depth images, in metres; `None` to leave them unread.
    depth: Option<f64>,
}

/// Reads a folder in this format.
pub(super) fn read(
    folder: &Path,
    options: OpenOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Scene, SceneError> {
    let file = folder.join("transforms.json");
    let transforms = Transforms::read(&file)?;
    let (mut warnings, mut notes) = (Vec::new(), Vec::new());
    let listed = list(folder, &file, &transforms, &mut warnings)?;
    let centres = || listed.iter().map(|frame| frame.camera_to_world.translation);
    // Measured depth is in metres, and so are poses that agree with it; whether it is read does not matter.
    let metric = listed.iter().any(|frame| frame.depth.is_some());
    let placing = Placing {
        origin: median_position(centres()),
        unit: if metric { 1.0 } else { unit_of_cameras(centres()) },
        depth: options.depth.then(|| transforms.depth_unit()),
    };
    if !metric {
        notes.push(format!(
            "a metre here is {:.4} units of transforms.json, whose scale is taken for arbitrary as there is no depth: \
             the cameras now span 2 m",
            placing.unit
        ));
    }
    let masks = transforms.frames.iter().filter(|entry| entry.mask_path.is_some());
    let masks = masks.count();
    if masks > 0 {
        notes.push(format!(
            "the masks of {masks} frames (mask_path) were not read: all of each image counts"
        ));
    }
    if let Some(points) = &transforms.ply_file_path {
        notes.push(format!("the points in {points:?} were not read"));
    }
    let frames = decode(folder, &file, &listed, &placing, progress, &mut warnings)?;
    Ok(Scene {
        source: SceneSource::Folder(folder.to_path_buf()),
        format: NAME,
        frames,
        origin: placing.origin,
        unit: placing.unit,
        warnings,
        notes,
    })
}

/// The frames whose image is there and whose pose is usable, in the order of their images' paths.
fn list(
    folder: &Path,
    file: &Path,
    transforms: &Transforms,
    warnings: &mut Vec<String>,
) -> Result<Vec<Listed>, SceneError> {
    let total = transforms.frames.len();
    let (mut listed, mut missing, mut unreadable, mut bad) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for entry in &transforms.frames {
        refuse_outside(file, entry)?;
        let Some(name) = image_name(folder, &entry.file_path) else {
            missing.push(format!("{:?}", entry.file_path));
            continue;
        };
        let path = folder.join(&name);
        let size = match transforms.size(entry).map_or_else(|| size_of(&path), Ok) {
            Ok(size) => size,
            Err(reason) => {
                unreadable.push(format!("{name:?} ({reason})"));
                continue;
            }
        };
        let (lens, pinhole) = transforms.lens(entry, size).map_err(|problem| {
            let message = format!("the camera of {name:?} cannot be used: {problem}");
            SceneError::file(file, message)
        })?;
        match entry.camera_to_world() {
            Ok(camera_to_world) => listed.push(Listed {
                path,
                depth: entry.depth_file_path.as_ref().map(|depth| folder.join(depth)),
                camera_to_world,
                lens,
                pinhole,
                name,
            }),
            Err(problem) => bad.push(format!("{name:?} ({problem})")),
        }
    }
    if let Some(first) = missing.first().filter(|_| missing.len() == total) {
        return Err(SceneError::file(
            file,
            format!(
                "none of its {total} images is there, first {first}; put the images where the file says, below its \
                 own folder"
            ),
        ));
    }
    let present = total - missing.len();
    too_many(file, &bad, present, "poses are unusable", "write the file anew")?;
    too_many(
        file,
        &unreadable,
        present,
        "images cannot be read",
        "copy the capture again",
    )?;
    warn(
        warnings,
        "frames in transforms.json were left out because their image is missing",
        &missing,
    );
    warn(warnings, "images cannot be read and were left out", &unreadable);
    warn(
        warnings,
        "frames were left out because their pose in transforms.json is unusable",
        &bad,
    );
    if listed.is_empty() {
        return Err(SceneError::file(
            file,
            format!(
                "has no usable frame: {}; copy the capture again",
                warnings.join("; ")
            ),
        ));
    }
    listed.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(listed)
}

/// Refuses a file or folder in which more than half of `total` frames have one of these problems.
fn too_many(
    path: &Path,
    problems: &[String],
    total: usize,
    what: &str,
    remedy: &str,
) -> Result<(), SceneError> {
    match problems.first().filter(|_| 2 * problems.len() > total) {
        None => Ok(()),
        Some(first) => Err(SceneError::file(
            path,
            format!(
                "{} of its {total} {what}, first {first}; {remedy}",
                problems.len()
            ),
        )),
    }
}

/// Refuses paths that leave the folder of the scene.
fn refuse_outside(file: &Path, entry: &Entry) -> Result<(), SceneError> {
    let paths = [Some(&entry.file_path), entry.depth_file_path.as_ref()];
    match paths.into_iter().flatten().find(|path| !is_inside(path)) {
        None => Ok(()),
        Some(path) => Err(SceneError::file(
            file,
            format!(
                "names {path:?}, which is not a path inside the folder of the scene; move the images into it and \
                 give their paths from there"
            ),
        )),
    }
}

/// The path of a colour image below the folder, with the extension that its file has.
fn image_name(folder: &Path, path: &str) -> Option<String> {
    // `./images/a` and `images/a` are one image, and sorted alike.
    let parts = Path::new(path)
        .components()
        .filter(|part| matches!(part, Component::Normal(_)));
    let path: PathBuf = parts.collect();
    let path = path.display();
    EXTENSIONS
        .iter()
        .map(|extension| format!("{path}{extension}"))
        .find(|name| folder.join(name).is_file())
}

/// Width and height of an image on disk, in pixels.
fn size_of(path: &Path) -> Result<[f64; 2], String> {
    let size = reader(path)?.into_dimensions();
    let (width, height) = size.map_err(|error| error.to_string())?;
    Ok([f64::from(width), f64::from(height)])
}

/// Decodes the images and the depth; images that cannot be used are left out, up to half of them, and depth
/// that cannot be used likewise.
fn decode(
    folder: &Path,
    file: &Path,
    listed: &[Listed],
    placing: &Placing,
    progress: &(dyn Fn(usize, usize) + Sync),
    warnings: &mut Vec<String>,
) -> Result<Vec<Frame>, SceneError> {
    let names: Vec<&str> = listed.iter().map(|frame| frame.name.as_str()).collect();
    let stems = frame_names(file, &names)?;
    let (done, total) = (AtomicUsize::new(0), listed.len());
    let decoded: Vec<_> = listed
        .par_iter()
        .zip(stems)
        .map(|(listed, stem)| {
            let frame = decode_frame(listed, stem, placing);
            progress(1 + done.fetch_add(1, Ordering::Relaxed), total);
            frame
        })
        .collect();
    let (mut frames, mut unusable, mut bad_depth) = (Vec::new(), Vec::new(), Vec::new());
    for (listed, decoded) in listed.iter().zip(decoded) {
        match decoded {
            Ok((frame, depth_problem)) => {
                frames.push(frame);
                bad_depth.extend(depth_problem);
            }
            Err(problem) => unusable.push(format!(
                "{:?} ({})",
                listed.name,
                describe(&problem, &listed.lens)
            )),
        }
    }
    too_many(
        folder,
        &unusable,
        total,
        "images cannot be used",
        "use the images that the poses in transforms.json were found with, or copy the capture again",
    )?;
    too_many(
        folder,
        &bad_depth,
        total,
        "depth images are missing or cannot be used",
        "copy the capture again, or open it without depth",
    )?;
    warn(warnings, "images cannot be used and were left out", &unusable);
    warn(
        warnings,
        "frames are used without depth because it is missing or cannot be used",
        &bad_depth,
    );
    Ok(frames)
}

/// Why an image cannot be used, in words.
fn describe(problem: &ImageProblem, lens: &Lens) -> String {
    match problem {
        ImageProblem::Missing => "no such file".to_owned(),
        ImageProblem::Unreadable(reason) => reason.clone(),
        ImageProblem::Size(width, height) => {
            let Camera {
                width: w, height: h, ..
            } = lens.image;
            format!("{width}x{height} instead of {w}x{h}")
        }
    }
}

/// A frame, and why it has no depth though there should be some.
fn decode_frame(
    listed: &Listed,
    stem: String,
    placing: &Placing,
) -> Result<(Frame, Option<String>), ImageProblem> {
    let pose = &listed.camera_to_world;
    let mut frame = Frame {
        stem,
        path: listed.path.clone(),
        camera: listed.pinhole,
        camera_to_world: Affine3A::from_mat3_translation(
            orthonormalised(pose.matrix3).as_mat3(),
            ((pose.translation - placing.origin) / placing.unit).as_vec3(),
        ),
        color: decode_color(&listed.path, &listed.lens, &listed.pinhole)?,
        depth: None,
        points: Vec::new(),
        lens: (!listed.lens.distortion.is_none()).then_some(listed.lens),
    };
    let Some((path, step)) = listed.depth.as_ref().zip(placing.depth) else {
        return Ok((frame, None));
    };
    match decode_depth(path, &frame, step) {
        Ok(depth) => {
            frame.depth = Some(depth);
            Ok((frame, None))
        }
        Err(reason) => Ok((frame, Some(format!("{} ({reason})", file_name(path))))),
    }
}

/// Depth as ray lengths from a 16-bit image of z-depth in steps of this many metres, or why it cannot be
/// used. An image of another size shows the same as the colour image: each pixel has the step that lies over
/// its centre, as a mean across a border would be a surface that is not there.
fn decode_depth(path: &Path, frame: &Frame, step: f64) -> Result<DepthMap, String> {
    let DynamicImage::ImageLuma16(image) = decode_image(path)? else {
        return Err("not a 16-bit greyscale PNG".to_owned());
    };
    let [width, height] = [frame.image().width, frame.image().height].map(u64::from);
    let (own_width, own_height) = (u64::from(image.width()), u64::from(image.height()));
    // Up to a pixel of rounding.
    if (own_width * height).abs_diff(own_height * width) > width.max(height) {
        return Err(format!(
            "{own_width}x{own_height} pixels, which is another shape than that of its {width}x{height} colour image"
        ));
    }
    let camera = &frame.camera;
    let below = |v: u32, own: u64, size: u64| ((2 * u64::from(v) + 1) * own / (2 * size)) as u32;
    let pixels = (0..camera.height).flat_map(|row| (0..camera.width).map(move |column| [column, row]));
    let metres = pixels.map(|pixel| {
        frame.to_image(pixel).map_or(0.0, |[x, y]| {
            let steps = image.get_pixel(below(x, own_width, width), below(y, own_height, height));
            (f64::from(steps.0[0]) * step) as f32
        })
    });
    Ok(DepthMap::from_z_depths(camera, metres.collect()))
}
