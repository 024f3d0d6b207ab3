//! Files of a capture: their names, and what to say of those that cannot be used.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Display;
use std::io::{BufRead, Seek};
use std::path::{Component, Path, PathBuf};

use image::{DynamicImage, ImageDecoder, ImageReader};

use super::SceneError;
use super::error::{ImageError, refusal, refuse};
use super::label_images::frame_number;
use super::lens::LARGEST_SIDE;

/// One warning for all files with the same problem: how many, and the first of them.
pub(super) fn warn(warnings: &mut Vec<String>, what: &str, examples: &[String]) {
    const SHOWN: usize = 3;
    if !examples.is_empty() {
        let shown = examples[..examples.len().min(SHOWN)].join(", ");
        let more = if examples.len() > SHOWN { ", ..." } else { "" };
        warnings.push(format!("{what} ({} in all): {shown}{more}", examples.len()));
    }
}

/// Refuses a file or folder in which more than half of `total` frames have one of these problems: a sentence made from
/// their number and the first of them, which says what to do. Of fewer it [warns](warn).
pub(super) fn leave_out(
    warnings: &mut Vec<String>,
    path: &Path,
    (problems, total): (&[String], usize),
    warning: &str,
    reason: impl FnOnce(usize, &str) -> String,
) -> Result<(), SceneError> {
    match problems.first().filter(|_| 2 * problems.len() > total) {
        Some(first) => Err(SceneError::file(path, reason(problems.len(), first))),
        None => {
            warn(warnings, warning, problems);
            Ok(())
        }
    }
}

/// Most bytes of pixels of an image, decoded.
const MOST_BYTES: u64 = 512 << 20;
/// Most pixels for each byte of a file: in a PNG, deflate makes one of at most 1032, and each of those may be 8 pixels of a
/// mask; in a JPEG, a bit is the least that says anything of the 64 pixels of a block.
const MOST_COMPRESSED: u64 = 1032 * 8;
/// Most pixels of an image, whatever it has of each: those of a colour image of the most bytes.
pub(super) const MOST_PIXELS: u64 = MOST_BYTES / 3;

/// Decodes the image at a path.
pub(super) fn decode_image(path: &Path) -> Result<DynamicImage, ImageError> {
    Ok(DynamicImage::from_decoder(decoder(path)?)?)
}

/// Decodes an image from a file of `length` bytes.
pub(crate) fn decode<'a>(
    reader: ImageReader<impl BufRead + Seek + 'a>,
    length: u64,
) -> Result<DynamicImage, ImageError> {
    Ok(DynamicImage::from_decoder(bounded_decoder(reader, length)?)?)
}

/// A decoder of the image at a path and of its metadata.
pub(super) fn decoder(path: &Path) -> Result<impl ImageDecoder, ImageError> {
    let length = std::fs::metadata(path)?.len();
    bounded_decoder(reader(path)?, length)
}

/// A decoder of the image in a file of `length` bytes, after a check of the size in its header ([`check_size`]).
fn bounded_decoder<'a>(
    reader: ImageReader<impl BufRead + Seek + 'a>,
    length: u64,
) -> Result<impl ImageDecoder + 'a, ImageError> {
    let decoder = reader.into_decoder()?;
    check_size(decoder.dimensions(), decoder.total_bytes(), length)?;
    Ok(decoder)
}

/// Refuses the size in the header of an image where it is too large, or where a file of `length` bytes cannot hold so
/// many. `bytes` is the size of the decoded pixels.
pub(crate) fn check_size((width, height): (u32, u32), bytes: u64, length: u64) -> Result<(), ImageError> {
    let pixels = u64::from(width) * u64::from(height);
    if bytes > MOST_BYTES || pixels > MOST_PIXELS || u64::from(width.max(height)) > LARGEST_SIDE {
        Err(ImageError::TooLarge(width, height))
    } else if pixels > length.saturating_mul(MOST_COMPRESSED) {
        Err(ImageError::Truncated(length, width, height))
    } else {
        Ok(())
    }
}

/// Width and height of an image in pixels, from its header, where an image may have them ([`check_size`]).
pub(super) fn dimensions(path: &Path) -> Result<(u32, u32), ImageError> {
    Ok(decoder(path)?.dimensions())
}

/// The error of a file that could be read when the capture was opened, and cannot be read again.
pub(super) fn unreadable(path: &Path, reason: impl Display) -> SceneError {
    let reason =
        format!("can no longer be read ({reason}); put the capture back as it was, or open it again");
    SceneError::file(path, reason)
}

/// A reader of an image whose format is found by its first bytes.
fn reader(path: &Path) -> std::io::Result<ImageReader<std::io::BufReader<std::fs::File>>> {
    ImageReader::open(path)?.with_guessed_format()
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

/// The paths of what is in a folder.
pub(super) fn paths_in(folder: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let listed = std::fs::read_dir(folder).and_then(|entries| {
        let paths = entries.map(|entry| entry.map(|entry| entry.path()));
        paths.collect::<Result<Vec<PathBuf>, _>>()
    });
    listed.map_err(|error| cannot_read(folder, error))
}

/// The error of a file or a folder that cannot be read.
pub(super) fn cannot_read(path: &Path, error: std::io::Error) -> SceneError {
    refusal!(
        path,
        "cannot be read ({error}); check that it is there and that you may read it"
    )
}

/// Files of a folder with one of these extensions, by the number at the end of their stem; the names of those without
/// one are added to `unnumbered`.
///
/// # Errors
/// A folder that cannot be read, or two files of one number.
pub(super) fn numbered_files(
    folder: &Path,
    extensions: &[&str],
    unnumbered: &mut Vec<String>,
) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let mut files = BTreeMap::new();
    for path in paths_in(folder)? {
        let wanted = path
            .extension()
            .is_some_and(|own| extensions.iter().any(|e| own.eq_ignore_ascii_case(e)));
        let name = file_name(&path);
        if !wanted || name.starts_with('.') {
            continue;
        }
        let Some(number) = frame_number(&stem(&path)) else {
            unnumbered.push(name);
            continue;
        };
        if let Some(other) = files.insert(number, path) {
            refuse!(other, "has the same number as {name}; keep one of the two");
        }
    }
    unnumbered.sort();
    Ok(files)
}

/// Refuses a path that `file` of the capture names `at` some line ("line 3 ", or nothing): one that no file can have, and,
/// unless files may lie anywhere, one that leaves the folder that it starts from. Links that lie in the folder were put
/// there by whoever keeps it, and may lead anywhere.
pub(super) fn check_name(outside_files: bool, file: &Path, at: &str, name: &str) -> Result<(), SceneError> {
    let mut parts = Path::new(name).components();
    let is_normal = |part: Component| matches!(part, Component::Normal(_));
    if !parts.clone().any(is_normal) || name.contains('\0') {
        refuse!(
            file,
            "{at}names {name:?}, which is not the path of a file; give that of the image"
        );
    }
    let stays = parts.all(|part| is_normal(part) || part == Component::CurDir);
    if !outside_files && !stays {
        refuse!(
            file,
            "{at}names {name:?}, which is not a path inside the folder of the scene; move the file into it and \
             give its path from there, or allow such files with --outside-files"
        );
    }
    Ok(())
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
                refuse!(file, "names the image {image:?} twice; remove one");
            }
            Some(other) => {
                refuse!(
                    file,
                    "names the images {other:?} and {image:?}, whose labels would get one name; rename one"
                );
            }
        }
    }
    Ok(images.iter().map(|image| long(image)).collect())
}
