//! Files of a capture: their names, and what to say of those that cannot be used.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use image::{DynamicImage, ImageReader};

use super::{Camera, ColorImage, Lens, OpenOptions, SceneError};

/// One warning for all files with the same problem: how many, and the first of them.
pub(super) fn warn(warnings: &mut Vec<String>, what: &str, examples: &[String]) {
    const SHOWN: usize = 3;
    if !examples.is_empty() {
        let shown = examples[..examples.len().min(SHOWN)].join(", ");
        let more = if examples.len() > SHOWN { ", ..." } else { "" };
        warnings.push(format!("{what} ({} in all): {shown}{more}", examples.len()));
    }
}

/// The image, or why there is none.
pub(super) fn decode_image(path: &Path) -> Result<DynamicImage, String> {
    reader(path)?.decode().map_err(|error| error.to_string())
}

/// A reader of an image whose format is told by its first bytes, or why there is none.
pub(super) fn reader(path: &Path) -> Result<ImageReader<std::io::BufReader<std::fs::File>>, String> {
    ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|error| error.to_string())
}

/// File name without its extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// File name.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Why a colour image cannot be used.
pub(super) enum ImageProblem {
    /// There is no such file.
    Missing,
    /// It cannot be decoded, for this reason.
    Unreadable(String),
    /// It has this width and height, and not those of its lens.
    Size(u32, u32),
}

/// The colour image at a path, taken with `lens`, as `pinhole` would have taken it.
pub(super) fn decode_color(path: &Path, lens: &Lens, pinhole: &Camera) -> Result<ColorImage, ImageProblem> {
    if !path.is_file() {
        return Err(ImageProblem::Missing);
    }
    let image = decode_image(path).map_err(ImageProblem::Unreadable)?.into_rgb8();
    let (width, height) = image.dimensions();
    if (width, height) != (lens.image.width, lens.image.height) {
        return Err(ImageProblem::Size(width, height));
    }
    let color = ColorImage::new(width, height, image.into_raw());
    let color = if lens.distortion.is_none() {
        color
    } else {
        color.and_then(|color| lens.resample(pinhole, &color))
    };
    color.ok_or(ImageProblem::Size(width, height))
}

/// Which image files a capture may consist of: those inside its folder, or any where the person allows it.
pub(super) struct Reach {
    /// The capture's folder, without links; `None` where files may lie anywhere.
    folder: Option<PathBuf>,
}

impl Reach {
    /// That of the capture in a folder.
    pub fn of(folder: &Path, options: OpenOptions) -> Self {
        // A folder that cannot be resolved cannot be read either, which its reader says.
        let resolved = || folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        Self {
            folder: (!options.outside_files).then(resolved),
        }
    }

    /// Refuses a path, as a file of the capture names it, that leaves the folder that it starts from, with the
    /// reason and what to do; what no file can be called is refused in any case.
    pub fn check_name(&self, name: &str) -> Result<(), String> {
        let mut parts = Path::new(name).components();
        let stays = || {
            let mut parts = Path::new(name).components();
            parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        };
        let is_file_name = parts.any(|part| matches!(part, Component::Normal(_))) && !name.contains('\0');
        if !is_file_name {
            Err(format!(
                "names {name:?}, which is not the path of a file; give that of the image"
            ))
        } else if self.folder.is_some() && !stays() {
            Err(format!(
                "names {name:?}, which is not a path inside the folder of the scene; move the file into it and give \
                 its path from there, or allow such files with --outside-files"
            ))
        } else {
            Ok(())
        }
    }

    /// Refuses a file that links lead out of the capture's folder; one that is missing is its reader's to judge.
    pub fn check_file(&self, path: &Path) -> Result<(), SceneError> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        match path.canonicalize() {
            Ok(target) if !target.starts_with(folder) => Err(SceneError::file(
                path,
                format!(
                    "is reached by a link and lies outside the folder of the scene, at {}; copy it into the folder, or \
                     allow such files with --outside-files",
                    target.display()
                ),
            )),
            _ => Ok(()),
        }
    }
}

/// The name of each frame: the stem of its image, or its whole path with `_` between the folders where
/// images in different folders have like stems.
///
/// # Errors
/// `file`, which gives the images these names, has two that would become one.
pub(super) fn frame_names(file: &Path, images: &[&str]) -> Result<Vec<String>, SceneError> {
    let short = |image: &str| stem(Path::new(image));
    let long = |image: &str| {
        let path = Path::new(image).with_extension("");
        let parts = path
            .components()
            .filter(|part| matches!(part, Component::Normal(_)));
        let parts: Vec<_> = parts.map(|part| part.as_os_str().to_string_lossy()).collect();
        parts.join("_")
    };
    let mut first: HashMap<String, &str> = HashMap::new();
    let unique = images
        .iter()
        .all(|image| first.insert(short(image), image).is_none());
    if unique {
        return Ok(images.iter().map(|image| short(image)).collect());
    }
    first.clear();
    for image in images {
        match first.insert(long(image), image) {
            None => {}
            Some(other) if other == *image => {
                return Err(SceneError::file(
                    file,
                    format!("names the image {image:?} twice; remove one"),
                ));
            }
            Some(other) => {
                return Err(SceneError::file(
                    file,
                    format!(
                        "names the images {other:?} and {image:?}, whose labels would get one name; rename one"
                    ),
                ));
            }
        }
    }
    Ok(images.iter().map(|image| long(image)).collect())
}
