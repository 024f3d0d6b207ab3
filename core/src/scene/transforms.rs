//! Captures with a `transforms.json`, as nerfstudio and instant-ngp write and read them.
//!
//! - `transforms.json`: for each frame its image, its pose and, its own or shared, its camera
//! - the colour images, and the depth images where there are any, by the paths in that file
//!
//! Poses in the file are camera-to-world with OpenGL's camera axes (x right, y up, z back); the centre of
//! the top left pixel is at (0.5, 0.5), as here.

mod file;

use std::path::{Component, Path, PathBuf};

use super::camera::{median_position, unit_of_cameras};
use super::depth::DepthImages;
use super::error::{refusal, refuse};
use super::files::{check_name, dimensions, frame_names, leave_out, warn};
use super::formats::Format;
use super::images::ImageFile;
use super::reading::{Listed, Placing, Progress, Unusable, keep_usable, read_frames};
use super::{OpenOptions, Scene, SceneError, SceneSource};
pub(super) use file::{Transforms, pose_of_open_gl};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "transforms.json",
    expected: "colour images with their poses in transforms.json",
    poses: "transforms.json",
    recognise,
    read,
};

/// What is tried at the end of an image's path that has no file.
const EXTENSIONS: [&str; 4] = ["", ".png", ".jpg", ".jpeg"];

/// Whether a folder looks like this format, complete or not.
pub(super) fn recognise(folder: &Path) -> bool {
    folder.join("transforms.json").is_file()
}

/// Reads a folder in this format.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let file = folder.join("transforms.json");
    let transforms = Transforms::read(&file)?;
    let (mut warnings, mut notes) = (Vec::new(), Vec::new());
    let mut listed = list(folder, &file, options.outside_files, &transforms, &mut warnings)?;
    let centres = || listed.iter().map(|frame| frame.camera_to_world.translation);
    // Measured depth is in metres, and so are poses that agree with it; whether it is read does not matter.
    let metric = listed.iter().any(|frame| frame.depth.is_some());
    let placing = Placing {
        origin: median_position(centres()),
        unit: if metric {
            1.0
        } else {
            unit_of_cameras(centres(), 0.0)
        },
    };
    if !metric {
        notes.push(format!(
            "a metre here is {:.4} units of transforms.json, whose scale is taken for arbitrary as there is no depth: \
             the cameras now span 2 m",
            placing.unit
        ));
    }
    if let Some(points) = &transforms.ply_file_path {
        notes.push(format!("the points in {points:?} were not read"));
    }
    if !options.depth {
        listed.iter_mut().for_each(|frame| frame.depth = None);
    }
    let depth = DepthImages {
        steps_per_metre: (1.0 / transforms.depth_unit()) as f32,
        ..DepthImages::MILLIMETRES
    };
    let read = read_frames(&listed, placing, options, progress, &depth, |_, _| ())?;
    let unusable = Unusable {
        images: folder,
        depths: folder,
        of: "of its",
        remedy: "use the images that the poses in transforms.json were found with, or copy the capture again",
        depth: "missing or cannot be used",
    };
    let read = keep_usable(&listed, read, &unusable, &mut warnings)?;
    let frames = read.into_iter().map(|(frame, ())| frame).collect();
    let source = SceneSource::Folder(folder.to_path_buf());
    Ok(Scene {
        origin: placing.origin,
        unit: placing.unit,
        warnings,
        notes,
        ..Scene::new(source, FORMAT.name, frames)
    })
}

/// The frames whose image is there and whose pose is usable, in the order of their images' paths.
fn list(
    folder: &Path,
    file: &Path,
    outside_files: bool,
    transforms: &Transforms,
    warnings: &mut Vec<String>,
) -> Result<Vec<Listed>, SceneError> {
    let total = transforms.frames.len();
    let (mut listed, mut missing, mut unreadable, mut bad) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for entry in &transforms.frames {
        let (depth, mask) = (entry.depth_file_path.as_ref(), entry.mask_path.as_ref());
        for name in [Some(&entry.file_path), depth, mask].into_iter().flatten() {
            check_name(outside_files, file, "", name)?;
        }
        let Some(name) = image_name(folder, &entry.file_path) else {
            missing.push(format!("{:?}", entry.file_path));
            continue;
        };
        let path = folder.join(&name);
        let (depth, mask) = (
            depth.map(|depth| folder.join(depth)),
            mask.map(|mask| folder.join(mask)),
        );
        let size = match transforms.size(entry).map_or_else(
            || dimensions(&path).map(|(width, height)| [width, height].map(f64::from)),
            Ok,
        ) {
            Ok(size) => size,
            Err(reason) => {
                unreadable.push(format!("{name:?} ({reason})"));
                continue;
            }
        };
        let (lens, pinhole) = transforms
            .lens(entry, size)
            .map_err(|problem| refusal!(file, "the camera of {name:?} cannot be used: {problem}"))?;
        match pose_of_open_gl(&entry.transform_matrix) {
            Ok(camera_to_world) => {
                let image = ImageFile {
                    path,
                    mask,
                    lens,
                    pinhole,
                };
                listed.push((name, image, depth, camera_to_world));
            }
            Err(problem) => bad.push(format!("{name:?} ({problem})")),
        }
    }
    if let Some(first) = missing.first().filter(|_| missing.len() == total) {
        refuse!(
            file,
            "none of its {total} images is there, first {first}; put the images where the file says, below its \
                 own folder"
        );
    }
    let present = total - missing.len();
    warn(
        warnings,
        "frames in transforms.json were left out because their image is missing",
        &missing,
    );
    let what = "images cannot be read";
    let left_out = format!("{what} and were left out");
    leave_out(
        warnings,
        file,
        (&unreadable, present),
        &left_out,
        |count, first| format!("{count} of its {present} {what}, first {first}; copy the capture again"),
    )?;
    let what = "frames were left out because their pose in transforms.json is unusable";
    leave_out(warnings, file, (&bad, present), what, |count, first| {
        format!("{count} of its {present} poses are unusable, first {first}; write the file anew")
    })?;
    if listed.is_empty() {
        refuse!(
            file,
            "has no usable frame: {}; copy the capture again",
            warnings.join("; ")
        );
    }
    listed.sort_by(|a, b| a.0.cmp(&b.0));
    let names: Vec<&str> = listed.iter().map(|(name, ..)| name.as_str()).collect();
    let stems = frame_names(file, &names)?.into_iter();
    let listed = stems
        .zip(listed)
        .map(|(stem, (name, image, depth, camera_to_world))| Listed {
            stem,
            name: format!("{name:?}"),
            image,
            depth,
            camera_to_world,
        });
    Ok(listed.collect())
}

/// The path of a colour image below the folder, with the extension that its file has.
fn image_name(folder: &Path, path: &str) -> Option<String> {
    // `./images/a` and `images/a` are one image, and sorted alike.
    let parts = Path::new(path)
        .components()
        .filter(|part| !matches!(part, Component::CurDir));
    let path: PathBuf = parts.collect();
    let path = path.display();
    EXTENSIONS
        .iter()
        .map(|extension| format!("{path}{extension}"))
        .find(|name| folder.join(name).is_file())
}

#[cfg(test)]
mod tests;
