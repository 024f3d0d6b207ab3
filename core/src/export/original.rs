//! The image of a frame as it lies on disk, which data sets have beside the labels.

use std::fs;
use std::io;
use std::path::Path;

use super::layout::OutputFile;
use crate::labels::png;
use crate::scene::{Frame, original_colors};

/// The image's name in a data set: the frame's stem with the extension of the file, `png` for frames that no file shows.
pub(super) fn name(frame: &Frame) -> String {
    let extension = if frame.path.as_os_str().is_empty() {
        Some("png".into())
    } else {
        frame
            .path
            .extension()
            .map(|extension| extension.to_string_lossy().into_owned())
    };
    match extension {
        Some(extension) => format!("{}.{extension}", frame.stem),
        None => frame.stem.clone(),
    }
}

/// A copy of the image, byte for byte, in a folder of the data set; a PNG of frames that no file shows.
///
/// # Errors
/// Part of a sentence that names the file.
pub(super) fn copy(frame: &Frame, folder: &str) -> Result<OutputFile, String> {
    let bytes = if frame.path.as_os_str().is_empty() {
        let color = frame.color();
        png::encode_rgb(color.width(), color.height(), color.bytes()).map_err(|error| error.to_string())?
    } else {
        fs::read(&frame.path).map_err(|error| unreadable(&frame.path, error))?
    };
    Ok(OutputFile::new(format!("{folder}/{}", name(frame)), bytes))
}

/// The colours of the image, distortion included, row-major `[height, width, 3]`.
///
/// # Errors
/// Part of a sentence that names the file.
pub(super) fn rgb(frame: &Frame) -> Result<Vec<u8>, String> {
    if frame.lens.is_none() {
        let pixels = frame.pixels().map_err(|error| error.to_string())?;
        return Ok(pixels.color.bytes().to_vec());
    }
    original_colors(frame).map_err(|error| error.to_string())
}

fn unreadable(path: &Path, error: io::Error) -> String {
    format!("{} cannot be read: {error}; put it back", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing;
    use crate::scene::{Camera, Distortion, Lens};

    #[test]
    fn an_image_on_disk_is_copied_byte_for_byte_and_a_missing_one_is_named() {
        let root = tempfile::tempdir().unwrap();
        let mut frame = testing::scene().frames.remove(0);
        let rendered = copy(&frame, "images").unwrap();
        assert_eq!(rendered.name(), "images/rgb_0.png");
        let decoded = image::load_from_memory(rendered.bytes()).unwrap().into_rgb8();
        assert_eq!(decoded.into_raw(), frame.color().bytes());
        frame.path = root.path().join("left").with_extension("JPG");
        fs::write(&frame.path, b"as the camera left it").unwrap();
        let copied = copy(&frame, "images").unwrap();
        assert_eq!(
            (copied.name().as_str(), copied.bytes()),
            ("images/rgb_0.JPG", &b"as the camera left it"[..])
        );
        fs::remove_file(&frame.path).unwrap();
        let error = copy(&frame, "images").map(|_| ()).unwrap_err();
        assert!(error.contains("left.JPG"), "{error}");
    }

    #[test]
    fn a_distorted_image_has_the_colours_of_its_file() {
        let root = tempfile::tempdir().unwrap();
        let mut frame = testing::scene().frames.remove(0);
        let pixels: Vec<u8> = (0..5 * 4 * 3).collect();
        frame.path = root.path().join("left.png");
        fs::write(&frame.path, png::encode_rgb(5, 4, &pixels).unwrap()).unwrap();
        let distortion = Distortion {
            k1: 0.1,
            ..Distortion::default()
        };
        let image = Camera::with_horizontal_fov(5, 4, 90.0);
        frame.lens = Some(Lens { image, distortion });
        assert_eq!(*rgb(&frame).unwrap(), pixels);
        fs::write(&frame.path, png::encode_rgb(4, 4, &pixels[..48]).unwrap()).unwrap();
        let error = rgb(&frame).unwrap_err();
        assert!(
            error.contains("left.png") && error.contains("4x4 instead of 5x4"),
            "{error}"
        );
    }
}
