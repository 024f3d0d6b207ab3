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

    fn folders(&self) -> &'static [&'static str] {
        &["overlay"]
    }

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

#[cfg(test)]
mod tests {
    use crate::export::Format;
    use crate::export::testing::{self, HEIGHT, WIDTH};
    use crate::labels::VOID;

    #[test]
    fn labelled_pixels_are_half_their_colour_and_void_is_the_image() {
        let files = testing::exported(Format::Overlay);
        assert_eq!(files.len(), 2);
        let jpeg = image::load_from_memory(&files["overlay/rgb_1.jpg"])
            .unwrap()
            .into_rgb8();
        assert_eq!(jpeg.dimensions(), (WIDTH, HEIGHT));
        let scene = testing::scene();
        let mut off = 0.0;
        for (index, (pixel, label)) in jpeg.pixels().zip(testing::labels(3)).enumerate() {
            let image = scene.frames[1].color().pixel(index);
            let color = testing::classes().into_iter().find(|class| class.id == label);
            assert_eq!(color.is_none(), label == VOID);
            let expected = match color {
                Some(class) => [0, 1, 2].map(|c| image[c].midpoint(class.color[c])),
                None => image,
            };
            for (value, expected) in pixel.0.into_iter().zip(expected) {
                off += f64::from(value.abs_diff(expected));
            }
        }
        // What compressing such small patches costs; the colours alone are 60 off on average, the image 40.
        let mean = off / f64::from(3 * WIDTH * HEIGHT);
        assert!(mean < 15.0, "{mean}");
    }
}
