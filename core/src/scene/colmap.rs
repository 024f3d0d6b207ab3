//! Captures with a COLMAP model: structure from motion.
//!
//! - `images/`: the colour images, by the names that the model gives them
//! - `sparse/0/`, `sparse/1/`, ..., `sparse/`, and the same below `colmap/`: `cameras`, `images` and `points3D`, all
//!   `.bin` or all `.txt`; of several models that with most images is read
//! - `masks/`, where there are any: `images/a/b.jpg` has `masks/a/b.jpg.png` or `masks/a/b.png`, black where it shows
//!   no part of the scene
//!
//! Poses in the model are world-to-camera; camera axes are OpenCV's and the centre of the top left pixel is
//! at (0.5, 0.5), as here.

mod binary;
mod frames;
mod model;
mod text;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DQuat};

use super::camera::{FARTHEST, median_position, rigid, unit_of_cameras};
use super::error::{NO_QUATERNION, refuse};
use super::files::{check_name, file_name, frame_names, leave_out, paths_in};
use super::formats::Format;
use super::images::ImageFile;
use super::pixel_errors::{PixelErrors, median};
use super::reading::{Listed, Placing, Progress};
use super::{OpenOptions, Scene, SceneError, SceneSource};
use model::{Model, ModelImage, Observation, Readers};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "COLMAP",
    expected: "colour images in images/ with cameras.bin, images.bin and points3D.bin (or .txt) in sparse/0",
    poses: "images.bin (or .txt)",
    recognise,
    read,
};

/// Where models may lie below the capture's folder, in numbered folders or by themselves.
const PLACES: [&str; 2] = ["sparse", "colmap/sparse"];
/// Median distance of the model's points from the cameras that see them, in metres, after scaling.
const MEDIAN_DEPTH: f64 = 2.5;
/// Fewest images that must have seen a point, and its largest mean error in pixels, for it to count.
const FEWEST_VIEWS: u64 = 3;
const MOST_ERROR: f64 = 2.0;

/// Whether a folder looks like this format, complete or not.
pub(super) fn recognise(folder: &Path) -> bool {
    !find_models(folder).is_empty()
}

/// The folders of models, by their numbers, and the extension of their files; binary files win.
fn find_models(folder: &Path) -> Vec<(PathBuf, &'static str)> {
    let places = PLACES.iter().flat_map(|place| {
        let place = folder.join(place);
        let paths = paths_in(&place).unwrap_or_default().into_iter();
        let mut numbered: Vec<(u32, PathBuf)> = paths
            .filter_map(|path| Some((file_name(&path).parse().ok()?, path)))
            .collect();
        numbered.sort();
        numbered.into_iter().map(|(_, path)| path).chain([place])
    });
    let with_extension = places.filter_map(|place| {
        let holds = |extension: &&str| {
            let has = |name: &str| place.join(name).with_extension(extension).is_file();
            has("cameras") || has("images")
        };
        let extension = ["bin", "txt"].into_iter().find(holds)?;
        Some((place, extension))
    });
    with_extension.collect()
}

/// The model with most images, the first of several, and what to say of the others.
fn largest(folder: &Path, models: Vec<(PathBuf, &'static str)>) -> Option<((PathBuf, &'static str), String)> {
    // A model by itself is not read twice; one that cannot be read is not the largest.
    let count = |(place, extension): &(PathBuf, &'static str)| -> usize {
        let file = place.join("images").with_extension(extension);
        let mut model = Model::default();
        let bytes = std::fs::read(&file).unwrap_or_default();
        let read = readers(*extension == "bin")[1](&file, &bytes, &mut model);
        read.map_or(0, |()| model.images.len())
    };
    let mut counted: Vec<_> = match models.len() {
        1 => models.into_iter().map(|model| (0, model)).collect(),
        _ => models.into_iter().map(|model| (count(&model), model)).collect(),
    };
    counted.sort_by_key(|(images, _)| std::cmp::Reverse(*images));
    let mut counted = counted.into_iter();
    let (_, found) = counted.next()?;
    let others: Vec<String> = counted
        .map(|(images, (place, _))| format!("{} with {images} images", below(folder, &place)))
        .collect();
    let others = match others.is_empty() {
        true => String::new(),
        false => format!("; the largest model, beside {}", others.join(", ")),
    };
    Some((found, others))
}

/// A path as seen from the capture's folder.
fn below(folder: &Path, path: &Path) -> String {
    path.strip_prefix(folder).unwrap_or(path).display().to_string()
}

/// The images of a model that are still on disk, in the model's own coordinates, and for each where it shows which point.
type Images = (Vec<Listed>, Vec<Vec<Observation>>);

/// Reads a folder in this format.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let Some(((place, extension), others)) = largest(folder, find_models(folder)) else {
        refuse!(
            folder.join("sparse/0"),
            "holds no model; put cameras.bin, images.bin and points3D.bin there"
        );
    };
    let mut warnings = Vec::new();
    let mut model = Model::read(&place, extension, readers(extension == "bin"))?;
    if model.points.is_empty() {
        warnings.push(format!(
            "the model in {} has no points, so that depth must be learnt from the images alone",
            place.display()
        ));
    }
    let mut notes = vec![describe(folder, &place, extension, &model) + &others];
    let images_file = place.join("images").with_extension(extension);
    let images = list(folder, &images_file, options, &mut model, &mut warnings)?;
    let unit = choose_unit(&images, &model);
    let origin = median_position(images.0.iter().map(|frame| frame.camera_to_world.translation));
    let placing = Placing { origin, unit };
    let (frames, errors) = frames::decode(
        &folder.join("images"),
        &images,
        &model,
        (placing, options),
        progress,
        &mut warnings,
    )?;
    let point_errors = PixelErrors::of(errors);
    if options.depth && point_errors.is_some() {
        notes.push(format!(
            "sparse points on {} pixels of {} frames",
            frames.iter().map(|frame| frame.points.len()).sum::<usize>(),
            frames.iter().filter(|frame| !frame.points.is_empty()).count(),
        ));
    }
    if let Some(errors) = point_errors.filter(PixelErrors::is_suspicious) {
        warnings.push(format!(
            "the model's points miss the places where its images show them by {:.1} pixels (median of {}); check that \
             the files in {} are of one model, and its cameras those of the images",
            errors.median_px,
            errors.count,
            place.display()
        ));
    }
    notes.push(format!(
        "a metre here is {unit:.4} units of the model, whose scale is arbitrary: {}",
        if model.points.is_empty() {
            "the cameras now span 2 m"
        } else {
            "the median depth of its points is now 2.5 m"
        }
    ));
    let source = SceneSource::Folder(folder.to_path_buf());
    Ok(Scene {
        origin,
        unit,
        point_errors,
        warnings,
        notes,
        ..Scene::new(source, FORMAT.name, frames)
    })
}

fn readers(is_binary: bool) -> Readers {
    if is_binary { binary::READERS } else { text::READERS }
}

/// What the model holds, in a sentence.
fn describe(folder: &Path, place: &Path, extension: &str, model: &Model) -> String {
    let mut kinds: Vec<&str> = model.cameras.values().map(|camera| camera.model).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let kind = if extension == "bin" { "binary" } else { "text" };
    format!(
        "{kind} model in {}: {} images, {} cameras ({}), {} points",
        below(folder, place),
        model.images.len(),
        model.cameras.len(),
        kinds.join(", "),
        model.points.len()
    )
}

/// The images of the model in the order of their names, with pose and lens; those with an unusable pose are
/// left out.
fn list(
    folder: &Path,
    file: &Path,
    options: OpenOptions,
    model: &mut Model,
    warnings: &mut Vec<String>,
) -> Result<Images, SceneError> {
    let mut images = std::mem::take(&mut model.images);
    if images.is_empty() {
        refuse!(file, "holds no images; register the images of the capture first");
    }
    images.sort_by(|a, b| a.name.cmp(&b.name));
    for image in &images {
        check_name(options.outside_files, file, "", &image.name)?;
    }
    let names: Vec<&str> = images.iter().map(|image| image.name.as_str()).collect();
    let stems = frame_names(file, &names)?;
    let total = images.len();
    let (mut listed, mut observations, mut bad) = (Vec::new(), Vec::new(), Vec::new());
    for (image, stem) in images.into_iter().zip(stems) {
        let Some(camera) = model.cameras.get(&image.camera) else {
            refuse!(
                file,
                "gives {:?} camera {}, which the model's cameras do not hold; copy the model again",
                image.name,
                image.camera
            );
        };
        let mask = find_mask(folder, &image.name);
        match camera_to_world(&image) {
            Ok(camera_to_world) => {
                listed.push(Listed {
                    stem,
                    name: format!("{:?}", image.name),
                    image: ImageFile {
                        path: folder.join("images").join(&image.name),
                        mask,
                        lens: camera.lens,
                        pinhole: camera.pinhole,
                    },
                    depth: None,
                    camera_to_world,
                });
                observations.push(image.observations);
            }
            Err(problem) => bad.push(format!("{:?} ({problem})", image.name)),
        }
    }
    let what = "frames were left out because their pose is unusable";
    leave_out(warnings, file, (&bad, total), what, |count, first| {
        format!("{count} of {total} poses are unusable, first that of {first}; copy the model again")
    })?;
    Ok((listed, observations))
}

/// The mask of an image, under the two names that COLMAP's feature extraction looks for.
fn find_mask(folder: &Path, image: &str) -> Option<PathBuf> {
    let masks = folder.join("masks");
    let places = [
        masks.join(format!("{image}.png")),
        masks.join(Path::new(image).with_extension("png")),
    ];
    places.into_iter().find(|path| path.is_file())
}

/// The pose of an image, or what is wrong with it.
fn camera_to_world(image: &ModelImage) -> Result<DAffine3, &'static str> {
    let [w, x, y, z] = image.rotation;
    let rotation = DQuat::from_xyzw(x, y, z, w);
    if !rotation.is_finite() || rotation.length() < 1e-6 {
        return Err(NO_QUATERNION);
    }
    let world_to_camera = DMat3::from_quat(rotation.normalize());
    let rotation = world_to_camera.transpose();
    rigid(DAffine3::from_mat3_translation(
        rotation,
        -(rotation * image.translation),
    ))
}

/// The length of a metre, in the model's unit.
fn choose_unit((listed, observations): &Images, model: &Model) -> f64 {
    let depths = listed.iter().zip(observations).flat_map(|(frame, seen)| {
        let centre = frame.camera_to_world.translation;
        let points = seen.iter().filter_map(|seen| model.trusted(seen.point));
        points.map(move |point| point.distance(centre))
    });
    let depths = depths.filter(|depth| depth.is_finite() && *depth > 0.0);
    let median = median(depths).map(|median| median / MEDIAN_DEPTH);
    // In a unit that is tiny beside the cameras' distances, they would be out of reach.
    let centres = || listed.iter().map(|frame| frame.camera_to_world.translation);
    let farthest = centres().fold(0.0, |farthest, centre| centre.abs().max_element().max(farthest));
    median
        .filter(|unit| unit.is_finite() && *unit > 0.0 && 2.0 * farthest / unit <= FARTHEST)
        .unwrap_or_else(|| unit_of_cameras(centres(), 0.0))
}

#[cfg(test)]
mod tests;
