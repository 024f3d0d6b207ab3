//! Label, entropy and colour maps as PNG bytes, and back.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader};
use png::{BitDepth, ColorType, EncodingError};

use super::ClassId;
use crate::scene::{self, ImageError};

/// A PNG, unless the pixels do not fill an image of this size.
type Encoded = Result<Vec<u8>, EncodingError>;

/// Class ids as gray values, 8 bit unless an id exceeds 255. `labels` is row-major `[height, width]`.
pub(crate) fn encode_labels(width: u32, height: u32, labels: &[ClassId]) -> Encoded {
    if labels.iter().any(|&label| label > u8::MAX.into()) {
        return encode_steps(width, height, labels);
    }
    let bytes: Vec<u8> = labels.iter().map(|&label| label as u8).collect();
    let kind = (ColorType::Grayscale, BitDepth::Eight);
    encode([width, height], &bytes, kind, &[])
}

/// 16-bit gray values, row-major `[height, width]`.
pub(crate) fn encode_steps(width: u32, height: u32, values: &[u16]) -> Encoded {
    let bytes: Vec<[u8; 2]> = values.iter().map(|value| value.to_be_bytes()).collect();
    let kind = (ColorType::Grayscale, BitDepth::Sixteen);
    encode([width, height], bytes.as_flattened(), kind, &[])
}

/// 8-bit colours, row-major `[height, width, 3]`.
pub(crate) fn encode_rgb(width: u32, height: u32, rgb: &[u8]) -> Encoded {
    encode([width, height], rgb, (ColorType::Rgb, BitDepth::Eight), &[])
}

/// 8-bit indices into a palette of at most 256 sRGB colours. `indices` is row-major `[height, width]`; each must
/// have a colour.
pub(crate) fn encode_indexed(width: u32, height: u32, indices: &[u8], palette: &[[u8; 3]]) -> Encoded {
    let kind = (ColorType::Indexed, BitDepth::Eight);
    encode([width, height], indices, kind, palette)
}

/// Equal rows are what label maps are made of: the difference to the row above is mostly zeros, which
/// the fast compressor packs best.
fn encode(
    [width, height]: [u32; 2],
    bytes: &[u8],
    (color, depth): (ColorType, BitDepth),
    palette: &[[u8; 3]],
) -> Encoded {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if !palette.is_empty() {
        encoder.set_palette(palette.as_flattened());
    }
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Up);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(png)
}

/// The gray values of a PNG of 8 or 16 bits: width, height, values row-major `[height, width]`.
///
/// # Errors
/// Bytes that are not a PNG, or an image with more than one channel, which holds colours and no ids.
pub fn decode_gray(png: &[u8]) -> Result<(u32, u32, Vec<u16>), ImageError> {
    let reader = ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    let image = scene::decode_image(reader, png.len() as u64)?;
    let (width, height) = (image.width(), image.height());
    match image {
        DynamicImage::ImageLuma8(gray) => {
            let values = gray.into_raw().into_iter().map(u16::from).collect();
            Ok((width, height, values))
        }
        DynamicImage::ImageLuma16(gray) => Ok((width, height, gray.into_raw())),
        other => Err(ImageError::NotGray(describe(other.color()))),
    }
}

/// [`decode_gray`] of an image that must have this size; one that says otherwise is refused before memory is taken for it.
///
/// # Errors
/// Those of [`decode_gray`], and an image of another size.
pub(crate) fn decode_gray_sized(png: &[u8], width: u32, height: u32) -> Result<Vec<u16>, ImageError> {
    let wanted = [width, height];
    match told_size(png) {
        Some(found) if found != wanted => Err(ImageError::NotOfFrame(found, wanted)),
        _ => decode_gray(png).map(|(_, _, values)| values),
    }
}

/// Width and height as the header of a PNG tells them.
pub(crate) fn told_size(png: &[u8]) -> Option<[u32; 2]> {
    // The signature, then the header chunk's length, name, width and height.
    let told = |at: usize| {
        let bytes = png.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_be_bytes(bytes))
    };
    Some([told(16)?, told(20)?])
}

fn describe(color: image::ColorType) -> &'static str {
    match (color.has_color(), color.has_alpha()) {
        (true, false) => "colour",
        (true, true) => "transparent colour",
        _ => "transparent",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_refused_as_labels_and_wrong_sizes_are_errors() {
        let png = encode_rgb(1, 1, &[1, 2, 3]).unwrap();
        assert!(matches!(decode_gray(&png), Err(ImageError::NotGray("colour"))));
        assert!(encode_labels(3, 3, &[0; 8]).is_err());
        assert!(decode_gray(b"hello").is_err());
        let small = encode_labels(3, 2, &[7; 6]).unwrap();
        assert_eq!(decode_gray_sized(&small, 3, 2).unwrap(), [7; 6]);
        let reason = decode_gray_sized(&small, 2, 3).unwrap_err().to_string();
        assert!(reason.contains("3x2"), "{reason}");
        assert!(decode_gray_sized(&small[..20], 3, 2).is_err());
    }
}
