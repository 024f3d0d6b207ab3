//! Colour images as they are found: of 8 or 16 bits a channel, gray, with a palette, with alpha, with a mask beside
//! them, turned by their metadata.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat};

use super::error::{ImageError, in_one_line};
use super::files::{decode_image, decoder, unreadable, warn};
use super::frame::to_image;
use super::{Camera, ColorImage, Distortion, Frame, Lens, SceneError};

/// What became of the orientation that an image's EXIF metadata ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// None is asked for.
    None,
    /// The pixels are used as they are stored.
    Ignored,
    /// The image was turned.
    Applied,
}

/// A colour image on disk, and how it becomes that of a frame.
#[derive(Clone)]
pub(super) struct ImageFile {
    pub path: PathBuf,
    /// Its mask, where it has one.
    pub mask: Option<PathBuf>,
    /// What it was taken with.
    pub lens: Lens,
    /// The camera of the frame: the lens's own where that bends nothing.
    pub pinhole: Camera,
}

impl ImageFile {
    /// An image of a pinhole camera, without a mask.
    pub fn plain(path: PathBuf, camera: Camera) -> Self {
        let lens = Lens {
            image: camera,
            distortion: Distortion::default(),
        };
        Self {
            path,
            mask: None,
            lens,
            pinhole: camera,
        }
    }

    /// The lens, if it bends anything.
    pub fn bent(&self) -> Option<Lens> {
        Some(self.lens).filter(|lens| !lens.distortion.is_none())
    }

    /// The colour image, taken with the lens, as the camera of the frame would have taken it; without the pixels whose
    /// alpha is 0, and without those that the mask, an image of the same size, has black.
    ///
    /// Pixels are taken as they are stored, whatever orientation the metadata ask for: that is how COLMAP and nerfstudio
    /// read the images that they find poses and intrinsics for. Only where the image has the lens's width and height when
    /// it is turned, and not as it is stored, it is turned.
    pub fn decode(&self) -> Result<(ColorImage, Turn), ImageError> {
        let size = (self.lens.image.width, self.lens.image.height);
        let (image, turn) = decode_turned(&self.path, size)?;
        let hidden = hidden_pixels(&image, self.mask.as_deref())?;
        let color = ColorImage::new(size.0, size.1, image.into_rgb8().into_raw());
        let color = color.and_then(|color| place(color, hidden.as_deref(), &self.lens, &self.pinhole));
        let color = color.ok_or(ImageError::Size(size, size));
        Ok((color?, turn))
    }
}

/// The colours of a frame's image on disk, turned as the frame's are, distortion included: row-major
/// `[height, width, 3]`.
///
/// # Errors
/// A file that can no longer be read, or has another size.
pub(crate) fn original_colors(frame: &Frame) -> Result<Vec<u8>, SceneError> {
    turned(frame).map(|(image, _)| image.into_rgb8().into_raw())
}

/// A frame's image on disk, turned as the frame's is, and what became of its orientation.
fn turned(frame: &Frame) -> Result<(DynamicImage, Turn), SceneError> {
    let camera = frame.image();
    decode_turned(&frame.path, (camera.width, camera.height)).map_err(|error| unreadable(&frame.path, error))
}

/// A frame's image on disk as every reader shows it with the pixels of the frame, whether that reader turns images by
/// their metadata or not.
pub(crate) enum PlainImage {
    /// The bytes of the file, or all of them but the orientation in its metadata.
    AsStored(Vec<u8>),
    /// A PNG in place of the file: its pixels are stored otherwise than the frame has them, or its metadata cannot be
    /// changed without spoiling it.
    Png(Vec<u8>),
}

/// The image of a frame on disk, distortion included, without an orientation in its metadata: the pixels lie as those of
/// the frame's labels.
///
/// # Errors
/// A file that can no longer be read, or has another size.
pub(crate) fn plain_image(frame: &Frame) -> Result<PlainImage, SceneError> {
    let path = &frame.path;
    let bytes = std::fs::read(path).map_err(|error| unreadable(path, error))?;
    let mut decoder = decoder(path).map_err(|error| unreadable(path, error))?;
    if decoder.orientation().unwrap_or(Orientation::NoTransforms) == Orientation::NoTransforms {
        let ((width, height), camera) = (decoder.dimensions(), frame.image());
        if (width, height) != (camera.width, camera.height) {
            let expected = format!("{} x {}", camera.width, camera.height);
            let reason = format!("it has {width} x {height} pixels instead of {expected}");
            return Err(unreadable(path, reason));
        }
        return Ok(PlainImage::AsStored(bytes));
    }
    let exif = decoder.exif_metadata().ok().flatten();
    let (image, turn) = turned(frame)?;
    if turn == Turn::Ignored
        && let Some(plain) = exif.and_then(|exif| without_orientation(&bytes, exif))
    {
        return Ok(PlainImage::AsStored(plain));
    }
    let mut png = Cursor::new(Vec::new());
    image
        .write_to(&mut png, ImageFormat::Png)
        .map_err(|error| unreadable(path, in_one_line(error)))?;
    Ok(PlainImage::Png(png.into_inner()))
}

/// The bytes of a JPEG with the orientation in these EXIF metadata of it set to none, and every other byte as it is;
/// `None` of another format, where checksums or compression are over the metadata.
fn without_orientation(bytes: &[u8], exif: Vec<u8>) -> Option<Vec<u8>> {
    const START_OF_JPEG: [u8; 2] = [0xFF, 0xD8];
    if !bytes.starts_with(&START_OF_JPEG) || exif.is_empty() {
        return None;
    }
    let at = bytes.windows(exif.len()).position(|window| window == exif)?;
    let mut plain = exif;
    Orientation::remove_from_exif_chunk(&mut plain)?;
    Some([&bytes[..at], &plain, &bytes[at + plain.len()..]].concat())
}

/// The image at a path, of this width and height once it is turned, where it is.
fn decode_turned(path: &Path, size: (u32, u32)) -> Result<(DynamicImage, Turn), ImageError> {
    if !path.is_file() {
        return Err(ImageError::Missing);
    }
    let mut decoder = decoder(path)?;
    // Metadata that cannot be read ask for nothing.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut image = DynamicImage::from_decoder(decoder)?;
    let (width, height) = (image.width(), image.height());
    let turn = if orientation == Orientation::NoTransforms {
        Turn::None
    } else if (width, height) != size {
        image.apply_orientation(orientation);
        Turn::Applied
    } else {
        Turn::Ignored
    };
    if (image.width(), image.height()) != size {
        return Err(ImageError::Size((width, height), size));
    }
    Ok((image, turn))
}

/// For every pixel, whether alpha or mask say that it shows no part of the scene; `None` where none is hidden.
///
/// # Errors
/// [`ImageError::Mask`]: a mask that cannot be read or has another size, and an image without a pixel that counts.
fn hidden_pixels(image: &DynamicImage, mask: Option<&Path>) -> Result<Option<Vec<bool>>, ImageError> {
    let mut hidden = vec![false; image.width() as usize * image.height() as usize];
    // In 16 bits, so that the smallest value above 0 stays one.
    if image.color().has_alpha() {
        for (hidden, pixel) in hidden.iter_mut().zip(image.to_rgba16().pixels()) {
            *hidden = pixel.0[3] == 0;
        }
    }
    if let Some(path) = mask {
        let unusable = |reason: String| ImageError::Mask(format!("its mask {} {reason}", path.display()));
        let mask = decode_image(path).map_err(|error| unusable(format!("cannot be read: {error}")))?;
        let (size, own) = ((image.width(), image.height()), (mask.width(), mask.height()));
        if own != size {
            return Err(unusable(format!(
                "has {}x{} pixels and not {}x{}",
                own.0, own.1, size.0, size.1
            )));
        }
        for (hidden, pixel) in hidden.iter_mut().zip(mask.into_rgb16().pixels()) {
            *hidden |= pixel.0 == [0; 3];
        }
    }
    if hidden.iter().all(|&hidden| hidden) {
        return Err(ImageError::Mask(
            "its alpha or its mask leaves nothing of it".to_owned(),
        ));
    }
    Ok(hidden.contains(&true).then_some(hidden))
}

/// The image of `lens` as `pinhole` would have taken it, without its hidden pixels.
fn place(color: ColorImage, hidden: Option<&[bool]>, lens: &Lens, pinhole: &Camera) -> Option<ColorImage> {
    if lens.distortion.is_none() {
        return Some(match hidden {
            Some(hidden) => color.hiding(|index| hidden[index]),
            None => color,
        });
    }
    let straight = lens.straighten(pinhole, &color)?;
    let Some(hidden) = hidden else {
        return Some(straight);
    };
    Some(straight.hiding(|index| {
        let pixel = [index as u32 % pinhole.width, index as u32 / pinhole.width];
        let shown = to_image(pinhole, Some(lens), pixel);
        shown.is_some_and(|[x, y]| hidden[(y * lens.image.width + x) as usize])
    }))
}

/// Warns of the images, by name, whose metadata ask to be turned: once of those that were, once of the others.
pub(super) fn warn_of_turns(warnings: &mut Vec<String>, turns: &[(String, Turn)]) {
    for (turn, what) in [
        (
            Turn::Ignored,
            "images are used as they are stored, although their EXIF orientation asks to turn them, because poses and \
             intrinsics are those of the stored pixels",
        ),
        (
            Turn::Applied,
            "images were turned by their EXIF orientation, because their width and height are given as turned; \
             their labels are turned like them",
        ),
    ] {
        let of_kind = turns.iter().filter(|(_, own)| *own == turn);
        let names: Vec<String> = of_kind.map(|(name, _)| name.clone()).collect();
        warn(warnings, what, &names);
    }
}

/// Says how much of the frames is hidden, if anything.
pub(super) fn note_hidden(frames: &[Frame], notes: &mut Vec<String>) {
    let hidden: Vec<usize> = frames.iter().map(|frame| frame.pixels.hidden).collect();
    let masked = hidden.iter().filter(|&&count| count > 0).count();
    if masked > 0 {
        let pixels: usize = frames.iter().map(|frame| frame.camera.pixels()).sum();
        notes.push(format!(
            "alpha or masks hide pixels in {masked} of {} frames, {:.1}% of all; they are black, have no label and are \
             not trained on",
            frames.len(),
            100.0 * hidden.iter().sum::<usize>() as f64 / pixels.max(1) as f64
        ));
    }
}

#[cfg(test)]
mod tests;
