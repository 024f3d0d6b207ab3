//! NumPy's files: an array in a `.npy`, or in a `.npz`, which is a ZIP of them. The format is NEP 1, versions 1 to 3.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::scene::in_one_line;

/// The longest header that is read, in bytes; NumPy's own limit is 10,000.
const LONGEST_HEADER: usize = 1 << 16;
/// The most bytes that an array may have.
const MOST_BYTES: usize = 1 << 30;
/// The most axes that an array may have, which is NumPy's own limit (NPY_MAXDIMS).
const MOST_AXES: usize = 64;
/// The most characters of a file that a message repeats.
const REPEATED: usize = 120;

/// What an array's numbers are, all with the least significant byte first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    F16,
    F32,
    F64,
}

impl Kind {
    fn bytes(self) -> usize {
        match self {
            Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// What the header of an array says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    kind: Kind,
    /// Whether the first index runs fastest.
    fortran_order: bool,
    /// Number of values along each axis.
    pub shape: Vec<usize>,
}

impl Header {
    /// From one value to the next along each axis.
    pub fn strides(&self) -> Vec<usize> {
        let mut strides = vec![1; self.shape.len()];
        let mut next = 1;
        let mut axes: Vec<usize> = (0..self.shape.len()).collect();
        if !self.fortran_order {
            axes.reverse();
        }
        for axis in axes {
            strides[axis] = next;
            next *= self.shape[axis];
        }
        strides
    }

    /// Number of bytes of all values, of which there is at least one.
    fn bytes(&self) -> Result<usize, String> {
        if self.shape.contains(&0) {
            return Err(format!(
                "has an array of the shape {}, which has no values",
                shape_text(&self.shape)
            ));
        }
        let product = self
            .shape
            .iter()
            .try_fold(self.kind.bytes(), |product, &n| product.checked_mul(n));
        product.filter(|&bytes| bytes <= MOST_BYTES).ok_or_else(|| {
            format!(
                "has an array of the shape {}, which is more than a gigabyte; save it as float16, or at a part of \
                 the frame's size",
                shape_text(&self.shape)
            )
        })
    }
}

/// The values of an array, in the order of the file.
pub(super) struct Values {
    kind: Kind,
    bytes: Vec<u8>,
}

impl Values {
    /// The value at a place.
    pub fn at(&self, index: usize) -> f32 {
        let of = |count: usize| &self.bytes[index * count..(index + 1) * count];
        match self.kind {
            Kind::F16 => half::f16::from_le_bytes(of(2).try_into().unwrap_or_default()).to_f32(),
            Kind::F32 => f32::from_le_bytes(of(4).try_into().unwrap_or_default()),
            Kind::F64 => f64::from_le_bytes(of(8).try_into().unwrap_or_default()) as f32,
        }
    }
}

/// Reads the array of a file; `accept` has a look at its header before any value is read.
///
/// # Errors
/// What `accept` says, or a part of a sentence that says what is wrong.
pub(super) fn read<T>(
    path: &Path,
    accept: impl FnOnce(&Header) -> Result<T, String>,
) -> Result<(T, Values), String> {
    let file = BufReader::new(File::open(path).map_err(unreadable)?);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
        return read_array(file, accept);
    }
    let broken = |error: zip::result::ZipError| format!("is no NPZ file: {}", in_one_line(error));
    let mut archive = zip::ZipArchive::new(file).map_err(broken)?;
    if archive.len() != 1 {
        return Err(format!(
            "holds {} arrays; save one, the probabilities of its frame",
            archive.len()
        ));
    }
    read_array(archive.by_index(0).map_err(broken)?, accept)
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
    within.read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() != length {
        let than = if bytes.len() < length { "less" } else { "more" };
        return Err(format!(
            "has {than} data than its shape {} says; write it anew",
            shape_text(&header.shape)
        ));
    }
    let kind = header.kind;
    Ok((accepted, Values { kind, bytes }))
}

fn read_header(file: &mut impl Read) -> Result<Header, String> {
    let no_array = || "is no NumPy array; write it with numpy.save or numpy.savez".to_owned();
    let mut start = [0; 8];
    file.read_exact(&mut start).map_err(|_| no_array())?;
    let long = match start {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, 0] => false,
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, 0] => true,
        _ => return Err(no_array()),
    };
    let mut length = [0; 4];
    let size = if long { 4 } else { 2 };
    file.read_exact(&mut length[..size]).map_err(|_| no_array())?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST_HEADER {
        return Err(no_array());
    }
    let mut text = vec![0; length];
    file.read_exact(&mut text).map_err(|_| no_array())?;
    let text = String::from_utf8(text).map_err(|_| no_array())?;
    parse_header(&text)
}

/// Reads a header, a Python dictionary: `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4, 5), }`.
fn parse_header(text: &str) -> Result<Header, String> {
    let unknown = || format!("has a header that is not NumPy's: {}", repeated(text));
    let within = text
        .trim()
        .strip_prefix('{')
        .and_then(|rest| rest.strip_suffix('}'));
    let mut rest = within.ok_or_else(unknown)?.trim();
    let (mut descr, mut fortran_order, mut shape) = (None, None, None);
    while !rest.is_empty() {
        let (key, after) = entry(rest).ok_or_else(unknown)?;
        let value_end = match key {
            "descr" => {
                let (text, end) = quoted(after).ok_or_else(|| {
                    "holds records instead of numbers; save float16 or float32 probabilities".to_owned()
                })?;
                descr = Some(text);
                end
            }
            "fortran_order" => {
                let values = [("True", true), ("False", false)];
                let value = values
                    .iter()
                    .find_map(|(word, value)| Some((*value, after.strip_prefix(word)?)));
                let (value, end) = value.ok_or_else(unknown)?;
                fortran_order = Some(value);
                end
            }
            "shape" => {
                let (inside, end) = after
                    .strip_prefix('(')
                    .and_then(|s| s.split_once(')'))
                    .ok_or_else(unknown)?;
                let numbers = inside
                    .split(',')
                    .map(str::trim)
                    .filter(|number| !number.is_empty());
                let numbers: Result<Vec<usize>, _> = numbers.map(str::parse).collect();
                let numbers = numbers.ok().filter(|numbers| numbers.len() <= MOST_AXES);
                shape = Some(numbers.ok_or_else(unknown)?);
                end
            }
            _ => return Err(unknown()),
        };
        rest = value_end.trim_start();
        rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
    }
    let (Some(descr), Some(fortran_order), Some(shape)) = (descr, fortran_order, shape) else {
        return Err(unknown());
    };
    let kind = match descr {
        "<f2" => Kind::F16,
        "<f4" => Kind::F32,
        "<f8" => Kind::F64,
        other => {
            return Err(format!(
                "holds numbers of the kind {}; save probabilities as float16 or float32, and class ids as a PNG",
                repeated(other)
            ));
        }
    };
    Ok(Header {
        kind,
        fortran_order,
        shape,
    })
}

/// A key of a dictionary, and the text from its value on.
fn entry(text: &str) -> Option<(&str, &str)> {
    let (key, rest) = quoted(text)?;
    Some((key, rest.trim_start().strip_prefix(':')?.trim_start()))
}

/// A string in quotes at the start of a text, and the text behind it.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|quote| matches!(quote, '\'' | '"'))?;
    text[1..].split_once(quote)
}

/// A text of the file for a message: on one line, and its beginning where it is long.
fn repeated(text: &str) -> String {
    in_one_line(text).chars().take(REPEATED).collect()
}

/// A shape as NumPy writes it.
pub(super) fn shape_text(shape: &[usize]) -> String {
    let numbers: Vec<String> = shape.iter().map(ToString::to_string).collect();
    format!("({})", numbers.join(", "))
}

fn unreadable(error: std::io::Error) -> String {
    format!("cannot be read: {error}")
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
        Ok((0..header.shape.iter().product())
            .map(|index| values.at(index))
            .collect())
    }

    #[test]
    fn numbers_of_every_kind_come_back() {
        let header = |kind: &str| format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (3,), }}\n");
        let expected = [0.5, 0.25, 1.0];
        let narrow: Vec<u8> = [0x3800_u16, 0x3400, 0x3c00]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let single: Vec<u8> = [0.5_f32, 0.25, 1.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let double: Vec<u8> = [0.5_f64, 0.25, 1.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        for (kind, data) in [("<f2", narrow), ("<f4", single), ("<f8", double)] {
            assert_eq!(values(&npy(&header(kind), &data)).unwrap(), expected, "{kind}");
            assert!(
                values(&npy(&header(kind), &data[1..]))
                    .unwrap_err()
                    .contains("less data")
            );
            let longer = [data.as_slice(), &[0]].concat();
            assert!(
                values(&npy(&header(kind), &longer))
                    .unwrap_err()
                    .contains("more data")
            );
        }
    }

    #[test]
    fn strides_follow_the_order_of_the_axes() {
        let header = |order: &str| {
            parse_header(&format!(
                "{{'descr': '<f4', 'fortran_order': {order}, 'shape': (2, 3, 4)}}"
            ))
            .unwrap()
        };
        assert_eq!(header("False").strides(), [12, 4, 1]);
        assert_eq!(header("True").strides(), [1, 2, 6]);
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
        let shaped = |kind: &str, shape: &str| {
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}")
        };
        refused(&shaped("<f4", "(1000000, 1000000, 1000000, 1000000)"), "gigabyte");
        refused(&shaped("<f4", "(200, 1000, 1000)"), "less data");
        refused(&shaped("<i8", "(2, 2)"), "<i8");
        refused(&shaped(">f4", "(2, 2)"), ">f4");
        refused(&shaped("two\nlines", "(2, 2)"), "two lines");
        refused(&shaped("<f4", "(-2, 2)"), "not NumPy's");
        refused(
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2,)}",
            "records",
        );
        refused("{'descr': '<f4', 'shape': (2,)}", "not NumPy's");
        refused("os.system('x')", "not NumPy's");
        refused(
            &shaped("<f4", "(0, 9223372036854775807, 9223372036854775807)"),
            "no values",
        );
        refused(&shaped("<f4", &format!("({})", "1, ".repeat(65))), "not NumPy's");
        assert!(values(b"PK").unwrap_err().contains("no NumPy array"));
        assert!(
            values(b"\x93NUMPY\x02\x00\xff\xff\xff\xff")
                .unwrap_err()
                .contains("no NumPy array")
        );
    }
}
