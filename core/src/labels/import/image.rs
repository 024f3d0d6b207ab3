//! Label images as PNGs: ids, indices of a palette, or colours.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::{BORDER, Meaning};
use crate::labels::{ClassId, VOID};

/// The most bytes that decoding an image may take.
const MOST_BYTES: usize = 1 << 30;

/// What the pixels of a label image say.
#[derive(Debug, PartialEq, Eq)]
enum Pixels {
    /// Class ids.
    Ids(Vec<ClassId>),
    /// Indices of a palette, which are class ids.
    Indices(Vec<ClassId>),
    /// Colours of classes, 16 bits a channel; `None` where the image is transparent.
    Colors(Vec<Option<[u16; 3]>>),
}

/// A decoded label image.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct LabelImage {
    /// Width and height.
    pub size: [u32; 2],
    /// Row-major.
    pixels: Pixels,
}

impl LabelImage {
    /// Decodes a PNG of 1 to 16 bits a channel.
    ///
    /// # Errors
    /// A part of a sentence that says what is wrong.
    pub fn decode(png: &[u8]) -> Result<Self, String> {
        let mut decoder = Decoder::new_with_limits(Cursor::new(png), Limits { bytes: MOST_BYTES });
        // Indices stay indices, and ids of few bits are not scaled up to gray values.
        decoder.set_transformations(Transformations::IDENTITY);
        let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
        let bytes = reader.output_buffer_size().filter(|&bytes| bytes <= MOST_BYTES);
        let mut buffer = vec![0; bytes.ok_or("it is too large")?];
        let info = reader
            .next_frame(&mut buffer)
            .map_err(|error| error.to_string())?;
        let channels = info.color_type.samples();
        let row = info.width as usize * channels;
        let rows = buffer.chunks_exact(info.line_size).take(info.height as usize);
        let samples: Vec<u16> = rows
            .flat_map(|line| unpacked(line, info.bit_depth).take(row))
            .collect();
        let wide = |sample: u16| {
            if info.bit_depth == BitDepth::Sixteen {
                sample
            } else {
                257 * sample
            }
        };
        let pixels = match info.color_type {
            ColorType::Grayscale => Pixels::Ids(samples),
            ColorType::Indexed => Pixels::Indices(samples),
            ColorType::GrayscaleAlpha => {
                let id = |pixel: &[u16]| Ok(if opaque(wide(pixel[1]))? { pixel[0] } else { VOID });
                Pixels::Ids(samples.chunks_exact(2).map(id).collect::<Result<_, String>>()?)
            }
            ColorType::Rgb | ColorType::Rgba => {
                let color = |pixel: &[u16]| {
                    let seen = pixel.get(3).map_or(Ok(true), |&alpha| opaque(wide(alpha)))?;
                    Ok(seen.then(|| [pixel[0], pixel[1], pixel[2]].map(wide)))
                };
                Pixels::Colors(
                    samples
                        .chunks_exact(channels)
                        .map(color)
                        .collect::<Result<_, String>>()?,
                )
            }
        };
        Ok(Self {
            size: [info.width, info.height],
            pixels,
        })
    }

    /// The class of every pixel, row-major.
    ///
    /// # Errors
    /// A colour that is not that of one class: a part of a sentence that names it.
    pub fn classes(&self, meaning: &Meaning) -> Result<Vec<ClassId>, String> {
        match &self.pixels {
            Pixels::Ids(ids) => Ok(ids.clone()),
            Pixels::Indices(indices) => {
                let border = !meaning.ids.contains(&BORDER);
                let class = |&index: &ClassId| if border && index == BORDER { VOID } else { index };
                Ok(indices.iter().map(class).collect())
            }
            Pixels::Colors(colors) => {
                let class = |(index, color): (usize, &Option<[u16; 3]>)| {
                    let Some(color) = color else {
                        return Ok(VOID);
                    };
                    let [x, y] = [index % self.size[0] as usize, index / self.size[0] as usize];
                    let place = || format!("has the colour {} at column {x}, row {y}", described(*color));
                    match meaning.colors.get(color) {
                        Some(Some(class)) => Ok(*class),
                        Some(None) => Err(format!(
                            "{}, which several classes have; give each a colour of its own",
                            place()
                        )),
                        None => Err(format!(
                            "{}, which is no class's; list the classes with their colours in a classes.json beside \
                             the images",
                            place()
                        )),
                    }
                };
                colors.iter().enumerate().map(class).collect()
            }
        }
    }
}

/// The samples of a row; where they have less than 8 bits, those that fill up its last byte too.
fn unpacked(line: &[u8], depth: BitDepth) -> Box<dyn Iterator<Item = u16> + '_> {
    match depth {
        BitDepth::Sixteen => Box::new(
            line.chunks_exact(2)
                .map(|pair| u16::from_be_bytes([pair[0], pair[1]])),
        ),
        BitDepth::Eight => Box::new(line.iter().map(|&sample| u16::from(sample))),
        BitDepth::One | BitDepth::Two | BitDepth::Four => {
            let bits = depth as u8;
            let of_byte = move |&byte: &u8| {
                let shifts = (0..8 / bits).map(move |place| 8 - bits * (place + 1));
                shifts.map(move |shift| u16::from((byte >> shift) & ((1 << bits) - 1)))
            };
            Box::new(line.iter().flat_map(of_byte))
        }
    }
}

/// Whether a pixel with this alpha, of 16 bits, is there at all.
fn opaque(alpha: u16) -> Result<bool, String> {
    match alpha {
        0 => Ok(false),
        u16::MAX => Ok(true),
        _ => Err("some of its pixels are half transparent, so that their class is not sure".to_owned()),
    }
}

/// A colour in words, in 8 bits a channel where it has no more.
fn described(color: [u16; 3]) -> String {
    let is_narrow = color.iter().all(|channel| channel.is_multiple_of(257));
    let [red, green, blue] = if is_narrow {
        color.map(|channel| channel / 257)
    } else {
        color
    };
    let depth = if is_narrow { "" } else { " of 16 bits" };
    format!("({red}, {green}, {blue}){depth}")
}
