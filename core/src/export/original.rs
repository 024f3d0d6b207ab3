//! The image of a frame as it lies on disk, which data sets have beside the labels.

use super::Refusal;
use super::layout::OutputFile;
use crate::labels::png;
use crate::scene::{Frame, PlainImage, SceneError, original_colors, plain_image};

/// A copy of the image on disk for a folder of a data set, byte for byte but for an orientation in its metadata, which
/// readers would follow or not; a PNG where the frame was turned by that, and of frames that no file shows. Its name is
/// the frame's stem with the extension of the bytes.
///
/// # Errors
/// An image that can no longer be read.
pub(super) fn original(frame: &Frame, folder: &str) -> Result<OutputFile, Refusal> {
    let (extension, bytes) = if frame.path.as_os_str().is_empty() {
        let color = frame.color();
        let png = png::encode_rgb(color.width(), color.height(), color.bytes())?;
        (".png".to_owned(), png)
    } else {
        match (plain_image(frame)?, frame.path.extension()) {
            (PlainImage::Png(bytes), _) => (".png".to_owned(), bytes),
            (PlainImage::AsStored(bytes), None) => (String::new(), bytes),
            (PlainImage::AsStored(bytes), Some(own)) => (format!(".{}", own.to_string_lossy()), bytes),
        }
    };
    let path = format!("{folder}/{}{extension}", frame.stem);
    Ok(OutputFile::copy(path, bytes))
}

/// The colours of the image, distortion included, row-major `[height, width, 3]`.
///
/// # Errors
/// An image that can no longer be read.
pub(super) fn rgb(frame: &Frame) -> Result<Vec<u8>, SceneError> {
    if frame.lens.is_none() {
        return Ok(frame.pixels()?.color.bytes().to_vec());
    }
    original_colors(frame)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use crate::export::testing;
    use crate::scene::Camera;
    use crate::scene::testing::{bend, sideways_jpeg};

    #[test]
    fn an_image_on_disk_is_copied_byte_for_byte_unless_it_is_turned_and_a_missing_one_is_named() {
        let root = tempfile::tempdir().unwrap();
        let mut frame = testing::scene().frames.remove(0);
        let rendered = original(&frame, "images").unwrap();
        assert_eq!(rendered.path, Path::new("images/rgb_0.png"));
        let decoded = image::load_from_memory(&rendered.bytes).unwrap().into_rgb8();
        assert_eq!(decoded.into_raw(), frame.color().bytes());
        frame.path = root.path().join("left").with_extension("JPG");
        let as_the_camera_left_it = sideways_jpeg(1);
        fs::write(&frame.path, &as_the_camera_left_it).unwrap();
        let error = original(&frame, "images").map(|_| ()).unwrap_err().to_string();
        let told = "it has 32 x 16 pixels instead of 24 x 18";
        assert!(error.contains(told), "{error}");
        frame.camera = Camera::with_horizontal_fov(32, 16, 90.0);
        let copied = original(&frame, "images").unwrap();
        assert_eq!(copied.path, Path::new("images/rgb_0.JPG"));
        assert_eq!(copied.bytes, as_the_camera_left_it);
        // One that is turned for its frame is a PNG.
        frame.camera = Camera::with_horizontal_fov(16, 32, 90.0);
        fs::write(&frame.path, sideways_jpeg(6)).unwrap();
        let turned = original(&frame, "images").unwrap();
        assert_eq!(turned.path, Path::new("images/rgb_0.png"));
        let decoded = image::load_from_memory(&turned.bytes).unwrap();
        assert_eq!((decoded.width(), decoded.height()), (16, 32));
        fs::remove_file(&frame.path).unwrap();
        let error = original(&frame, "images").map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("left.JPG: can no longer"), "{error}");
    }

    #[test]
    fn a_distorted_image_has_the_colours_of_its_file() {
        let root = tempfile::tempdir().unwrap();
        let mut frame = testing::scene().frames.remove(0);
        let pixels: Vec<u8> = (0..5 * 4 * 3).collect();
        frame.path = root.path().join("left.png");
        fs::write(&frame.path, png::encode_rgb(5, 4, &pixels).unwrap()).unwrap();
        frame.camera = Camera::with_horizontal_fov(5, 4, 90.0);
        bend(&mut frame, 0.1);
        assert_eq!(*rgb(&frame).unwrap(), pixels);
        fs::write(&frame.path, png::encode_rgb(4, 4, &pixels[..48]).unwrap()).unwrap();
        let error = rgb(&frame).unwrap_err().to_string();
        assert!(error.contains("left.png"), "{error}");
        assert!(error.contains("4x4 instead of 5x4"), "{error}");
    }
}
