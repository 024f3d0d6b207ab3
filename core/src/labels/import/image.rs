//! Label images as PNGs: ids, indices of a palette, or colours.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::{BORDER, Meaning};
use crate::labels::{ClassId, VOID};
use crate::scene::{check_size, in_one_line};

/// The most bytes that the parts of a file that are not its pixels may take.
const MOST_BYTES: usize = 64 << 20;

/// A decoded label image.
#[derive(Debug)]
pub(super) struct LabelImage {
    /// Width and height.
    pub size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    /// Bytes of a row.
    row: usize,
    /// Row-major, as the file has them.
    bytes: Vec<u8>,
    /// What the file says of transparency, where pixels do not: the opacity of the first colours of a palette, or else the
    /// samples of a pixel that is not there (chunk `tRNS`).
    transparency: Option<Vec<u8>>,
}

impl LabelImage {
    /// Decodes a PNG of 1 to 16 bits a channel.
    ///
    /// # Errors
    /// Why it is no label image: part of a sentence, as of the others.
    pub fn decode(png: &[u8]) -> Result<Self, String> {
        let mut decoder = Decoder::new_with_limits(Cursor::new(png), Limits { bytes: MOST_BYTES });
        // Indices stay indices, and ids of few bits are not scaled up to gray values.
        decoder.set_transformations(Transformations::IDENTITY);
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        let no_png = |error| format!("is no label image: {}", in_one_line(error));
        let mut reader = decoder.read_info().map_err(no_png)?;
        let (width, height) = reader.info().size();
        let length = reader.output_buffer_size().unwrap_or(usize::MAX);
        check_size((width, height), length as u64, png.len() as u64)
            .map_err(|error| format!("is no label image: {error}"))?;
        let mut bytes = vec![0; length];
        let info = reader.next_frame(&mut bytes).map_err(no_png)?;
        Ok(Self {
            size: [width, height],
            color: info.color_type,
            depth: info.bit_depth,
            row: info.line_size,
            bytes,
            transparency: reader.info().trns.as_deref().map(<[u8]>::to_vec),
        })
    }

    /// The class of every pixel, row-major.
    ///
    /// # Errors
    /// A pixel that is half transparent, or has a colour that is not that of one class.
    pub fn classes(&self, meaning: &Meaning) -> Result<Vec<ClassId>, String> {
        self.values(|pixel| self.class(pixel, meaning))
    }

    /// The number of every pixel, row-major, 0 where it is transparent.
    ///
    /// # Errors
    /// An image of colours, or a pixel that is half transparent.
    pub fn numbers(&self) -> Result<Vec<u16>, String> {
        self.values(|pixel| match *pixel {
            [number] => Ok(number),
            [number, alpha] => Ok(if is_opaque(self.wide(alpha))? { number } else { 0 }),
            _ => Err((
                "has colours".to_owned(),
                "where it must have the numbers of objects; save it as a gray image of 8 or 16 bits",
            )),
        })
    }

    /// Whether a pixel is there at all as far as the file says so in one place.
    fn is_there(&self, pixel: &[u16]) -> bool {
        let Some(transparency) = &self.transparency else {
            return true;
        };
        if self.color == ColorType::Indexed {
            // Half transparent ones are so for looks: there are no soft edges between indices.
            let is_clear = |&index: &u16| transparency.get(usize::from(index)) == Some(&0);
            return !pixel.first().is_some_and(is_clear);
        }
        // One byte or two for each.
        let samples = transparency.chunks_exact((transparency.len() / pixel.len().max(1)).max(1));
        let wider = |sample: u16, &byte: &u8| sample << 8 | u16::from(byte);
        let samples = samples.map(|bytes| bytes.iter().fold(0, wider));
        !samples.eq(pixel.iter().copied())
    }

    /// What is read of every pixel by the samples of its channels, row-major, 0 where it is not there.
    fn values(&self, value: impl Fn(&[u16]) -> Result<u16, PixelProblem>) -> Result<Vec<u16>, String> {
        let [width, height] = self.size.map(|side| side as usize);
        let channels = self.color.samples();
        let mut values = Vec::with_capacity(width * height);
        let mut samples: Vec<u16> = Vec::with_capacity(width * channels);
        for (row, line) in self.bytes.chunks_exact(self.row).take(height).enumerate() {
            samples.clear();
            unpack(line, self.depth, &mut samples);
            for (column, pixel) in samples.chunks_exact(channels).take(width).enumerate() {
                let at_its_place =
                    |(problem, remedy)| format!("{problem} at column {column}, row {row}, {remedy}");
                let is_there = self.is_there(pixel);
                values.push(if is_there {
                    value(pixel).map_err(at_its_place)?
                } else {
                    0
                });
            }
        }
        Ok(values)
    }

    /// The class of a pixel by the samples of its channels.
    fn class(&self, pixel: &[u16], meaning: &Meaning) -> Result<ClassId, PixelProblem> {
        match *pixel {
            [BORDER] if self.color == ColorType::Indexed && !meaning.ids.contains(&BORDER) => Ok(VOID),
            // An id, or the index of a palette, which is one.
            [id] => Ok(id),
            [id, alpha] => Ok(if is_opaque(self.wide(alpha))? { id } else { VOID }),
            [red, green, blue, ref alpha @ ..] => {
                let is_there = alpha
                    .first()
                    .map_or(Ok(true), |&alpha| is_opaque(self.wide(alpha)))?;
                let color = [red, green, blue].map(|sample| self.wide(sample));
                match meaning.colors.get(&color) {
                    _ if !is_there => Ok(VOID),
                    Some(Some(class)) => Ok(*class),
                    Some(None) => Err((
                        described(color),
                        "which several classes have; give each a colour of its own",
                    )),
                    None => Err((
                        described(color),
                        "which is no class's; list the classes with their colours in a classes.json beside the images",
                    )),
                }
            }
            [] => Ok(VOID),
        }
    }

    /// A sample of 8 bits or more in 16.
    fn wide(&self, sample: u16) -> u16 {
        match self.depth {
            BitDepth::Sixteen => sample,
            _ => 257 * sample,
        }
    }
}

/// Why a pixel cannot be read, and what to do: parts of a sentence.
type PixelProblem = (String, &'static str);

/// Adds the samples of a row, and where they have less than 8 bits those that fill up its last byte.
fn unpack(line: &[u8], depth: BitDepth, samples: &mut Vec<u16>) {
    match depth {
        BitDepth::Sixteen => {
            let pairs = line.chunks_exact(2);
            samples.extend(pairs.map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
        }
        BitDepth::Eight => samples.extend(line.iter().map(|&sample| u16::from(sample))),
        BitDepth::One | BitDepth::Two | BitDepth::Four => {
            let bits = depth as u8;
            for &byte in line {
                let shifts = (0..8 / bits).map(|place| 8 - bits * (place + 1));
                samples.extend(shifts.map(|shift| u16::from((byte >> shift) & ((1 << bits) - 1))));
            }
        }
    }
}

/// Whether a pixel with this alpha, of 16 bits, is there at all.
fn is_opaque(alpha: u16) -> Result<bool, PixelProblem> {
    match alpha {
        0 => Ok(false),
        u16::MAX => Ok(true),
        _ => Err((
            "is half transparent".to_owned(),
            "so that its class is not sure; save it without soft edges",
        )),
    }
}

/// A colour of 16 bits a channel in words, in 8 bits a channel where it has no more.
fn described(color: [u16; 3]) -> String {
    let is_narrow = color.iter().all(|channel| channel.is_multiple_of(257));
    let [red, green, blue] = if is_narrow {
        color.map(|channel| channel / 257)
    } else {
        color
    };
    let depth = if is_narrow { "" } else { " of 16 bits" };
    format!("has the colour ({red}, {green}, {blue}){depth}")
}
