//! NumPy's files: an array in a `.npy`, or in a `.npz`, which is a ZIP of them. The format is NEP 1, versions 1 to 3.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use serde::Deserialize;

use super::unreadable;
use crate::scene::in_one_line;

/// The longest header that is read, in bytes; NumPy's own limit is 10,000.
const LONGEST_HEADER: usize = 1 << 16;
/// The most bytes that an array may have.
const MOST_BYTES: usize = 1 << 30;
/// The most axes that an array may have, which is NumPy's own limit (NPY_MAXDIMS).
const MOST_AXES: usize = 64;
/// The most characters of a file that a message repeats.
const REPEATED: usize = 120;

/// Why a file is none of NumPy's: part of a sentence.
const NO_ARRAY: &str = "is no NumPy array; write it with numpy.save or numpy.savez";

/// Number of values along each axis, written as NumPy does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Shape(pub Vec<usize>);

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        write!(f, "({})", numbers.join(", "))
    }
}

/// What the header of an array says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// Bytes of a value: 2 of a float16, 4 of a float32, 8 of a float64.
    width: usize,
    /// Whether the first index runs fastest.
    fortran_order: bool,
    pub shape: Shape,
}

impl Header {
    /// From one value to the next along each axis.
    pub fn strides(&self) -> Vec<usize> {
        let Shape(shape) = &self.shape;
        let mut strides = vec![1; shape.len()];
        let mut next = 1;
        let mut axes: Vec<usize> = (0..shape.len()).collect();
        if !self.fortran_order {
            axes.reverse();
        }
        for axis in axes {
            strides[axis] = next;
            next *= shape[axis];
        }
        strides
    }

    /// Number of bytes of all values, of which there is at least one.
    fn bytes(&self) -> Result<usize, String> {
        let Shape(shape) = &self.shape;
        let array = format!("has an array of the shape {}", self.shape);
        if shape.contains(&0) {
            return Err(format!("{array}, which has no values"));
        }
        let product = shape
            .iter()
            .try_fold(self.width, |product, &n| product.checked_mul(n));
        product.filter(|&bytes| bytes <= MOST_BYTES).ok_or_else(|| {
            format!(
                "{array}, which is more than a gigabyte; save it as float16, or at a part of the frame's size"
            )
        })
    }
}

/// The values of an array, in the order of the file.
pub(super) struct Values {
    /// Bytes of a value.
    width: usize,
    /// Of each value the least significant first.
    bytes: Vec<u8>,
}

impl Values {
    /// The value at a place.
    pub fn at(&self, index: usize) -> f32 {
        let own = &self.bytes[index * self.width..(index + 1) * self.width];
        match self.width {
            2 => half::f16::from_le_bytes(own.try_into().unwrap_or_default()).to_f32(),
            4 => f32::from_le_bytes(own.try_into().unwrap_or_default()),
            _ => f64::from_le_bytes(own.try_into().unwrap_or_default()) as f32,
        }
    }
}

/// Reads the array of a file; `accept` has a look at its header before any value is read.
///
/// # Errors
/// What `accept` says, or why the file is no array that can be read: part of a sentence.
pub(super) fn read<T>(
    path: &Path,
    accept: impl FnOnce(&Header) -> Result<T, String>,
) -> Result<(T, Values), String> {
    let file = BufReader::new(File::open(path).map_err(unreadable)?);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
        return read_array(file, accept);
    }
    let no_zip = |error| format!("is no NPZ file: {}", in_one_line(error));
    let mut archive = zip::ZipArchive::new(file).map_err(no_zip)?;
    match archive.len() {
        1 => read_array(archive.by_index(0).map_err(no_zip)?, accept),
        count => Err(format!(
            "holds {count} arrays; save one, the probabilities of its frame"
        )),
    }
}

fn read_array<T>(
    mut file: impl Read,
    accept: impl FnOnce(&Header) -> Result<T, String>,
) -> Result<(T, Values), String> {
    let header = read_header(&mut file)?;
    let length = header.bytes()?;
    let accepted = accept(&header)?;
    // No more is set aside than there is: the header of a damaged file may say anything.
    let mut bytes = Vec::new();
    let mut within = file.take(length as u64 + 1);
    let read = within.read_to_end(&mut bytes);
    read.map_err(|error| format!("cannot be read ({error}); write it anew"))?;
    if bytes.len() != length {
        let than = if bytes.len() < length { "less" } else { "more" };
        return Err(format!(
            "has {than} data than its shape {} says; write it anew",
            header.shape
        ));
    }
    let width = header.width;
    Ok((accepted, Values { width, bytes }))
}

fn read_header(file: &mut impl Read) -> Result<Header, String> {
    let mut start = [0; 8];
    file.read_exact(&mut start).map_err(|_| NO_ARRAY)?;
    let long = match start {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, 0] => false,
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, 0] => true,
        _ => return Err(NO_ARRAY.to_owned()),
    };
    let mut length = [0; 4];
    let size = if long { 4 } else { 2 };
    file.read_exact(&mut length[..size]).map_err(|_| NO_ARRAY)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST_HEADER {
        return Err(NO_ARRAY.to_owned());
    }
    let mut text = vec![0; length];
    file.read_exact(&mut text).map_err(|_| NO_ARRAY)?;
    parse_header(&String::from_utf8(text).map_err(|_| NO_ARRAY)?)
}

/// A header's dictionary.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Dictionary {
    /// The type's name, or a list of the fields of a record.
    descr: serde_json::Value,
    fortran_order: bool,
    shape: Vec<usize>,
}

/// Reads a header, a Python dictionary: `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4, 5), }`. With the
/// brackets, quotes and words of JSON, and without the last commas, it is an object of JSON.
fn parse_header(text: &str) -> Result<Header, String> {
    let mut json: String = text.split_whitespace().collect();
    for (python, own) in [
        ("'", "\""),
        ("(", "["),
        (")", "]"),
        (",]", "]"),
        (",}", "}"),
        ("True", "true"),
        ("False", "false"),
    ] {
        json = json.replace(python, own);
    }
    let dictionary = serde_json::from_str(&json).ok();
    let Some(Dictionary {
        descr,
        fortran_order,
        shape,
    }) = dictionary.filter(|known: &Dictionary| known.shape.len() <= MOST_AXES)
    else {
        return Err(format!("has a header that is not NumPy's: {}", repeated(text)));
    };
    let width = match descr.as_str() {
        Some("<f2") => 2,
        Some("<f4") => 4,
        Some("<f8") => 8,
        Some(other) => {
            return Err(format!(
                "holds numbers of the kind {}; save probabilities as float16 or float32, and class ids as a PNG",
                repeated(other)
            ));
        }
        None => {
            return Err("holds records instead of numbers; save float16 or float32 probabilities".to_owned());
        }
    };
    Ok(Header {
        width,
        fortran_order,
        shape: Shape(shape),
    })
}

/// A text of the file for a message: on one line, and its beginning where it is long.
fn repeated(text: &str) -> String {
    in_one_line(text).chars().take(REPEATED).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of version 1 with this header.
    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn values(bytes: &[u8]) -> Result<Vec<f32>, String> {
        let (header, values) = read_array(bytes, |header| Ok(header.clone()))?;
        Ok((0..header.shape.0.iter().product())
            .map(|index| values.at(index))
            .collect())
    }

    /// A header for numbers of a kind in a shape.
    fn header(kind: &str, shape: &str) -> String {
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n")
    }

    #[test]
    fn headers_that_lie_or_are_unknown_are_refused_without_setting_memory_aside() {
        let refused = |header: &str, part: &str| {
            let error = values(&npy(header, &[0; 64])).unwrap_err();
            assert!(error.contains(part), "{error}");
            assert!(!error.contains(['\n', '\0']) && error.len() < 400, "{error:?}");
        };
        refused("{'descr':\n'<f4'\0}", "not NumPy's");
        refused(&format!("{{{}}}", "x".repeat(60_000)), "not NumPy's");
        refused(&format!("{{'descr': {}", "[".repeat(60_000)), "not NumPy's");
        refused(&header("<f4", "(1000000, 1000000, 1000000, 1000000)"), "gigabyte");
        refused(&header("<f4", "(200, 1000, 1000)"), "less data");
        refused(&header("<f4", "(3, 5)"), "more data");
        refused(&header("<i8", "(2, 2)"), "<i8");
        refused(&header(">f4", "(2, 2)"), ">f4");
        refused(&header("two\nlines", "(2, 2)"), "twolines");
        refused(&header("<f4", "(-2, 2)"), "not NumPy's");
        refused(
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2,)}",
            "records",
        );
        refused("{'descr': '<f4', 'shape': (2,)}", "not NumPy's");
        refused("os.system('x')", "not NumPy's");
        refused(
            &header("<f4", "(0, 9223372036854775807, 9223372036854775807)"),
            "no values",
        );
        refused(&header("<f4", &format!("({})", "1, ".repeat(65))), "not NumPy's");
        for bytes in [&b"PK"[..], b"\x93NUMPY\x02\x00\xff\xff\xff\xff"] {
            assert!(values(bytes).unwrap_err().contains("no NumPy array"));
        }
    }
}
