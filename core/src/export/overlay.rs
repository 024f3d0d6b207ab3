//! The class colours over the images: to look at, to show, to check.

use image::ImageEncoder;
use image::codecs::jpeg::JpegEncoder;

use super::Refusal;
use super::layout::{Labelled, Layout, OutputFile};
use super::original;
use super::pngs::class_colors;
use crate::labels::VOID;

/// Quality of the JPEGs, of 100.
const QUALITY: u8 = 90;

/// `overlay/<stem>.jpg`: the image with the colours of the classes half over it; void shows the image as it is.
pub(super) struct Overlay;

impl Layout for Overlay {
    type Entry = ();
    const FOLDERS: &'static [&'static str] = &["overlay"];

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, ()), Refusal> {
        let [width, height] = frame.size;
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, QUALITY).write_image(
            &blended(frame)?,
            width,
            height,
            image::ExtendedColorType::Rgb8,
        )?;
        let path = format!("overlay/{}.jpg", frame.stem());
        Ok((vec![OutputFile::new(path, jpeg)], ()))
    }
}

/// The image with the colours over it, row-major `[height, width, 3]`.
fn blended(frame: &Labelled<'_>) -> Result<Vec<u8>, Refusal> {
    let mut rgb = original::rgb(frame.frame)?;
    let colors = class_colors(frame);
    for ((pixel, color), &label) in rgb
        .chunks_exact_mut(3)
        .zip(colors.chunks_exact(3))
        .zip(&frame.labels)
    {
        if label != VOID {
            for (value, &color) in pixel.iter_mut().zip(color) {
                *value = value.midpoint(color);
            }
        }
    }
    Ok(rgb)
}
