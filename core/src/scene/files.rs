//! Files of a capture: their names, and what to say of those that cannot be used.

use std::path::{Component, Path};

use image::{DynamicImage, ImageReader};

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

/// Whether a name that a file of the capture gives stays inside the folder that it is relative to.
pub(super) fn is_inside(name: &str) -> bool {
    let parts = || Path::new(name).components();
    parts().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && parts().any(|part| matches!(part, Component::Normal(_)))
        && !name.contains('\0')
}
