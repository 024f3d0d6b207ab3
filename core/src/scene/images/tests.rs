//! What holds for images as they are found.

use std::path::PathBuf;

use image::{ColorType, ExtendedColorType};
use tempfile::TempDir;

use super::*;
use crate::scene::files::dimensions;
use crate::scene::testing::{orientation_metadata, sideways_jpeg, wall, write_file};

/// Three pixels of a palette: opaque, of alpha 0, half transparent.
const PALETTE: &[u8] = include_bytes!("fixtures/palette-alpha.png");

/// Saves an image of two rows.
fn save(files: &TempDir, name: &str, bytes: &[u8], kind: ColorType) -> PathBuf {
    let path = files.path().join(name);
    let width = bytes.len() / usize::from(kind.bytes_per_pixel()) / 2;
    image::save_buffer(&path, bytes, width as u32, 2, ExtendedColorType::from(kind)).unwrap();
    path
}

fn read(path: &Path, mask: Option<&Path>, width: u32, height: u32) -> Result<(ColorImage, Turn), String> {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let mut file = ImageFile::plain(path.to_path_buf(), camera);
    file.mask = mask.map(Path::to_path_buf);
    file.decode().map_err(|error| error.to_string())
}

#[test]
fn sixteen_bits_and_gray_become_eight_bits_of_three_channels() {
    let files = tempfile::tempdir().unwrap();
    let deep: [u16; 12] = [0, 257, 65535, 32896, 128, 129, 1, 2, 3, 60000, 40000, 20000];
    let path = save(&files, "deep.png", bytemuck::cast_slice(&deep), ColorType::Rgb16);
    let (color, _) = read(&path, None, 2, 2).unwrap();
    let expected = deep.map(|value| (f32::from(value) / 257.0).round() as u8);
    assert_eq!(color.bytes(), expected);

    let gray: [u16; 4] = [0, 257 * 7, 257 * 200, 65535];
    let path = save(&files, "gray16.png", bytemuck::cast_slice(&gray), ColorType::L16);
    let (deep, _) = read(&path, None, 2, 2).unwrap();
    let path = save(&files, "gray.png", &[0, 7, 200, 255], ColorType::L8);
    let (shallow, _) = read(&path, None, 2, 2).unwrap();
    assert_eq!(deep, shallow);
    assert_eq!(shallow.pixel(2), [200; 3]);
    assert_eq!(shallow.hidden_pixels().count(), 0);
}

#[test]
fn alpha_of_zero_hides_a_pixel_and_any_other_does_not() {
    let files = tempfile::tempdir().unwrap();
    let (color, _) = read(&write_file(&files, "palette.png", PALETTE), None, 3, 1).unwrap();
    assert_eq!(color.bytes(), [10, 20, 30, 0, 0, 0, 7, 8, 9]);
    assert_eq!(color.hidden_pixels().collect::<Vec<_>>(), [1]);

    let read = |bytes: &[u8], kind| read(&save(&files, "alpha.png", bytes, kind), None, 2, 2);
    let (color, _) = read(&[50, 0, 60, 1, 70, 255, 80, 0], ColorType::La8).unwrap();
    assert_eq!(color.hidden_pixels().collect::<Vec<_>>(), [0, 3]);
    assert_eq!(color.pixel(1), [60; 3]);
    let faint: [u16; 8] = [60000, 1, 60000, 0, 60000, 127, 60000, 65535];
    let (color, _) = read(bytemuck::cast_slice(&faint), ColorType::La16).unwrap();
    assert_eq!(color.hidden_pixels().collect::<Vec<_>>(), [1]);
    let (opaque, _) = read(&[9, 9, 9, 255].repeat(4), ColorType::Rgba8).unwrap();
    assert_eq!(opaque.hidden_pixels().count(), 0);
    let reason = read(&[9, 9, 9, 0].repeat(4), ColorType::Rgba8).unwrap_err();
    assert!(reason.contains("nothing of it"), "{reason}");
}

#[test]
fn masks_hide_where_they_are_black_and_add_to_alpha() {
    let files = tempfile::tempdir().unwrap();
    let pixels = [50, 0, 60, 255, 70, 255, 80, 255];
    let path = save(&files, "alpha.png", &pixels, ColorType::La8);
    let faint: [u16; 4] = [65535, 1, 0, 65535];
    let mask = save(&files, "mask.png", bytemuck::cast_slice(&faint), ColorType::L16);
    let (color, _) = read(&path, Some(&mask), 2, 2).unwrap();
    assert_eq!(color.hidden_pixels().collect::<Vec<_>>(), [0, 2]);
    let other = save(&files, "other.png", &[255; 6], ColorType::L8);
    let spoilt = write_file(&files, "spoilt.png", b"spoilt");
    let black = save(&files, "black.png", &[0; 4], ColorType::L8);
    for (mask, part) in [
        (other, "other.png has 3x2 pixels and not 2x2"),
        (spoilt, "spoilt.png cannot be read"),
        (black, "nothing of it"),
    ] {
        let reason = read(&path, Some(&mask), 2, 2).unwrap_err();
        assert!(reason.contains(part), "{reason}");
    }
}

#[test]
fn an_orientation_is_ignored_unless_the_given_size_is_that_of_the_turned_image() {
    let files = tempfile::tempdir().unwrap();
    for orientation in [0, 1] {
        let path = write_file(&files, "upright.jpg", sideways_jpeg(orientation));
        assert_eq!(read(&path, None, 32, 16).unwrap().1, Turn::None);
    }
    for orientation in 2..=8 {
        let path = write_file(&files, "turned.jpg", sideways_jpeg(orientation));
        let (color, turn) = read(&path, None, 32, 16).unwrap();
        assert_eq!(turn, Turn::Ignored);
        assert!(color.pixel(0)[0] < 60 && color.pixel(31)[0] > 180);
        let turned = read(&path, None, 16, 32);
        if orientation < 5 {
            assert!(turned.unwrap_err().contains("32x16 instead of 16x32"));
            continue;
        }
        let (color, turn) = turned.unwrap();
        assert_eq!(turn, Turn::Applied);
        // Transposed (5) and turned clockwise (6) the left side is at the top, otherwise at the bottom.
        let (top, bottom) = (color.pixel(0)[0], color.pixel(16 * 32 - 1)[0]);
        assert_eq!(top < bottom, orientation < 7, "{orientation}: {top} {bottom}");
        let mut frame = wall(1, 16, 32).frames.remove(0);
        frame.path = path;
        assert_eq!(original_colors(&frame).unwrap(), color.bytes());
    }
}

#[test]
fn a_size_in_a_header_does_not_count_where_the_file_is_too_short_for_it() {
    let files = tempfile::tempdir().unwrap();
    let mut jpeg = sideways_jpeg(1);
    let path = write_file(&files, "whole.jpg", &jpeg);
    assert_eq!(dimensions(&path).unwrap(), (32, 16));
    // The start of a frame: marker, length, bits a channel, height and width.
    let start = jpeg.windows(2).position(|pair| pair == [0xFF, 0xC0]).unwrap();
    jpeg[start + 5..start + 9].copy_from_slice(&[0x20, 0, 0x20, 0]);
    let size = dimensions(&write_file(&files, "huge.jpg", &jpeg));
    assert!(
        matches!(size, Err(ImageError::Truncated(_, 8192, 8192))),
        "{size:?}"
    );
}

#[test]
fn a_mask_of_one_bit_may_be_a_thousand_times_as_large_as_its_file() {
    let files = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4096, 4096);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[255; 4096 / 8 * 4096]).unwrap();
    writer.finish().unwrap();
    assert!(bytes.len() < 4096 * 4096 / 2048, "{}", bytes.len());
    assert_eq!(
        dimensions(&write_file(&files, "mask.png", &bytes)).unwrap(),
        (4096, 4096)
    );
}

/// What readers that turn images find in the bytes, and what those that do not find.
fn shown(bytes: &[u8]) -> [DynamicImage; 2] {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut decoder = reader.unwrap().into_decoder().unwrap();
    let orientation = decoder.orientation().unwrap();
    let stored = DynamicImage::from_decoder(decoder).unwrap();
    let mut turned = stored.clone();
    turned.apply_orientation(orientation);
    [turned, stored]
}

#[test]
fn a_plain_image_shows_the_pixels_of_the_frame_to_readers_that_turn_images_and_to_others() {
    let files = tempfile::tempdir().unwrap();
    for orientation in 1..=8 {
        let jpeg = sideways_jpeg(orientation);
        let path = write_file(&files, "turned.jpg", &jpeg);
        for (width, height) in [(32, 16), (16, 32)] {
            if (width, height) == (16, 32) && orientation < 5 {
                continue;
            }
            let mut frame = wall(1, width, height).frames.remove(0);
            frame.path = path.clone();
            let (bytes, is_png) = match plain_image(&frame).unwrap() {
                PlainImage::AsStored(bytes) => (bytes, false),
                PlainImage::Png(bytes) => (bytes, true),
            };
            let own = original_colors(&frame).unwrap();
            for image in shown(&bytes) {
                assert_eq!((image.width(), image.height()), (width, height), "{orientation}");
                assert_eq!(image.into_rgb8().into_raw(), own, "{orientation}");
            }
            assert_eq!(is_png, width < height, "{orientation}");
            if !is_png {
                let changed = bytes.iter().zip(&jpeg).filter(|(plain, own)| plain != own);
                let expected = usize::from(orientation != 1);
                assert_eq!((bytes.len(), changed.count()), (jpeg.len(), expected));
            }
        }
    }
}

#[test]
fn a_png_that_asks_to_be_turned_is_written_anew_with_all_its_bits() {
    let files = tempfile::tempdir().unwrap();
    let path = files.path().join("deep.png");
    let deep: Vec<u16> = (0..4 * 2 * 3).map(|value| 2570 * value).collect();
    let mut encoder = image::codecs::png::PngEncoder::new(std::fs::File::create(&path).unwrap());
    image::ImageEncoder::set_exif_metadata(&mut encoder, orientation_metadata(6)).unwrap();
    let bytes = bytemuck::cast_slice(&deep);
    image::ImageEncoder::write_image(encoder, bytes, 4, 2, ExtendedColorType::Rgb16).unwrap();
    let mut frame = wall(1, 4, 2).frames.remove(0);
    frame.path = path.clone();
    let PlainImage::Png(png) = plain_image(&frame).unwrap() else {
        panic!("the metadata of a PNG have a checksum");
    };
    for image in shown(&png) {
        assert_eq!(image, image::open(&path).unwrap());
        assert_eq!(image.as_rgb16().unwrap().as_raw(), &deep);
    }
}

#[test]
fn warnings_count_the_images_that_were_turned_and_those_that_were_not() {
    let turns = [Turn::Ignored, Turn::None, Turn::Ignored, Turn::Applied];
    let named = ["a", "b", "c", "d"].map(str::to_owned).into_iter().zip(turns);
    let turns: Vec<(String, Turn)> = named.collect();
    let mut warnings = Vec::new();
    warn_of_turns(&mut warnings, &turns[1..2]);
    assert!(warnings.is_empty());
    warn_of_turns(&mut warnings, &turns);
    let [ignored, applied] = warnings.as_slice() else {
        panic!("{warnings:?}")
    };
    assert!(ignored.contains("stored pixels (2 in all): a, c"), "{ignored}");
    assert!(applied.contains("(1 in all): d"), "{applied}");
}
