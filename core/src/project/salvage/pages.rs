//! The rows of a damaged database, read page by page without SQLite, which gives up at the first fault.
//!
//! The file format: <https://www.sqlite.org/fileformat2.html>, sections 1.3 (header), 1.5 (freelist), 1.6
//! (b-tree pages and overflow) and 2.1 (records). Nothing is believed that the file says about lengths:
//! every row lies inside the file, and fills its own record exactly.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Page size that SQLite gives a new file.
const USUAL_PAGE_SIZE: usize = 4096;

/// Length of the database header, which stands before the b-tree of page 1.
const HEADER: usize = 100;

/// How often over a damaged file's records may be read where rows point into one another.
const OVERLAP: u64 = 4;

/// First byte of the pages that are no leaves of a table: overflow and freelist, both kinds of index pages, and the
/// inner pages of a table. Any other byte is read as a leaf, since the byte itself may be what is damaged.
const NO_LEAVES: [u8; 4] = [0, 2, 10, 5];

/// One value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Integer(i64),
    Real(f64),
    Text(String),
    Blob(Vec<u8>),
}

/// One row of some table; [`Kinds`] tell which.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StoredRow {
    pub(super) rowid: i64,
    pub(super) values: Vec<Value>,
}

/// What the columns of a row hold, a letter each: `n`ull, `i`nteger, `r`eal, `t`ext, `b`lob; `?` is anything else.
pub(super) type Kinds = String;

/// The pages of a database file.
pub(super) struct Pages {
    file: File,
    length: u64,
    size: usize,
    /// Bytes of records that may still be read. Records do not overlap, so that all together are no longer than the
    /// file, unless it is damaged.
    budget: u64,
}

/// What came of reading all pages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Scan {
    /// Rows and pages of rows that are there and cannot be read.
    pub(super) unreadable: usize,
    /// The list of free pages is unusable: rows that were deleted may be among those found.
    pub(super) deleted_rows_possible: bool,
}

impl Pages {
    /// Opens the file at `path`, with one [`Pages`] for each page size that it may have.
    pub(super) fn candidates(path: &Path) -> io::Result<Vec<Self>> {
        let mut header = [0; HEADER];
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        // What is missing of a header that was cut off stays zero.
        let _ = file.read_exact(&mut header);
        let told = match big_endian(&header, 16, 2) {
            Some(1) => 65536,
            Some(size) => size as usize,
            None => 0,
        };
        let mut sizes = vec![USUAL_PAGE_SIZE];
        if told != USUAL_PAGE_SIZE && told.is_power_of_two() && (512..=65536).contains(&told) {
            sizes.push(told);
        }
        sizes
            .into_iter()
            .map(|size| {
                let file = File::open(path)?;
                Ok(Self {
                    file,
                    length,
                    size,
                    budget: length.saturating_mul(OVERLAP),
                })
            })
            .collect()
    }

    /// Reads every row whose kinds of columns are `wanted`, page after page.
    pub(super) fn rows(&mut self, wanted: impl Fn(&str) -> bool, mut take: impl FnMut(StoredRow)) -> Scan {
        let free = self.free_pages();
        let mut scan = Scan {
            unreadable: 0,
            deleted_rows_possible: free.is_none(),
        };
        let free = free.unwrap_or_default();
        let pages = u32::try_from(self.length.div_ceil(self.size as u64)).unwrap_or(u32::MAX);
        for number in (1..=pages).filter(|number| !free.contains(number)) {
            let Some(page) = self.page(number) else {
                scan.unreadable += 1;
                continue;
            };
            let start = if number == 1 { HEADER } else { 0 };
            if page.get(start).is_none_or(|kind| NO_LEAVES.contains(kind)) {
                continue;
            }
            for cell in cells(&page, start) {
                let Some((cell, kinds)) = cell.and_then(|cell| {
                    let kinds = cell.kinds()?;
                    Some((cell, kinds))
                }) else {
                    scan.unreadable += 1;
                    continue;
                };
                if wanted(&kinds) {
                    match self.payload(&cell).and_then(|payload| values(&payload)) {
                        Some(values) => take(StoredRow {
                            rowid: cell.rowid,
                            values,
                        }),
                        None => scan.unreadable += 1,
                    }
                }
            }
        }
        scan
    }

    /// A page, from 1; what lies behind the end of the file is zero. `None` where the disk cannot be read.
    fn page(&mut self, number: u32) -> Option<Vec<u8>> {
        let start = u64::from(number.checked_sub(1)?) * self.size as u64;
        let there = self.length.checked_sub(start)?.min(self.size as u64) as usize;
        let mut page = vec![0; self.size];
        self.file.seek(SeekFrom::Start(start)).ok()?;
        self.file.read_exact(page.get_mut(..there)?).ok()?;
        Some(page)
    }

    /// The pages that hold nothing; `None` unless they are as many as the header says.
    fn free_pages(&mut self) -> Option<HashSet<u32>> {
        let header = self.page(1)?;
        let expected = big_endian(&header, 36, 4)? as usize;
        let mut free = HashSet::new();
        let mut trunk = big_endian(&header, 32, 4)?;
        while trunk != 0 {
            let page = self.page(trunk)?;
            let leaves = big_endian(&page, 4, 4)? as usize;
            if leaves > self.size / 4 - 2 || !free.insert(trunk) {
                return None;
            }
            for leaf in 0..leaves {
                free.insert(big_endian(&page, 8 + 4 * leaf, 4)?);
            }
            trunk = big_endian(&page, 0, 4)?;
        }
        // A header of zeros knows of no free pages either, and is no header.
        let is_header = header.starts_with(b"SQLite format 3\0");
        (is_header && free.len() == expected).then_some(free)
    }

    /// The whole record of a cell, gathered from its overflow pages.
    fn payload(&mut self, cell: &Cell<'_>) -> Option<Vec<u8>> {
        let length = usize::try_from(cell.length).ok()?;
        if cell.length > self.length {
            return None;
        }
        self.budget = self.budget.checked_sub(cell.length)?;
        let mut payload = cell.local.to_vec();
        let mut next = cell.overflow;
        while payload.len() < length {
            // Each turn adds bytes, so that a chain that goes round ends as well.
            let page = self.page(next)?;
            let rest = (length - payload.len()).min(self.size - 4);
            payload.extend_from_slice(page.get(4..4 + rest)?);
            next = big_endian(&page, 0, 4)?;
        }
        Some(payload)
    }
}

/// One row where it lies.
struct Cell<'a> {
    rowid: i64,
    /// Length of the record in bytes.
    length: u64,
    /// The part of the record that is in this page.
    local: &'a [u8],
    /// The page with the next part.
    overflow: u32,
}

impl Cell<'_> {
    /// What the columns hold; `None` for what is no record. Our records have headers far shorter than a page.
    fn kinds(&self) -> Option<Kinds> {
        let (types, header) = serial_types(self.local)?;
        let mut lengths = types.iter().map(|&kind| length_of(kind));
        let length = lengths.try_fold(header as u64, u64::checked_add)?;
        if length != self.length {
            return None;
        }
        let kind = |&kind: &u64| match kind {
            0 => 'n',
            1..=6 | 8 | 9 => 'i',
            7 => 'r',
            12.. if kind % 2 == 0 => 'b',
            12.. => 't',
            _ => '?',
        };
        Some(types.iter().map(kind).collect())
    }
}

/// The cells of a leaf whose header starts at `start`; `None` for one that is damaged.
fn cells(page: &[u8], start: usize) -> Vec<Option<Cell<'_>>> {
    let Some(told) = big_endian(page, start + 3, 2) else {
        return Vec::new();
    };
    let pointers = start + 8;
    // A cell takes four bytes and a pointer at least.
    let most = (page.len() - pointers) / 6;
    if told as usize > most {
        return vec![None];
    }
    (0..told as usize)
        .map(|index| cell(page, big_endian(page, pointers + 2 * index, 2)? as usize))
        .collect()
}

fn cell(page: &[u8], at: usize) -> Option<Cell<'_>> {
    let (length, at) = varint(page, at)?;
    let (rowid, at) = varint(page, at)?;
    let usable = page.len() as u64;
    let most = usable - 35;
    let local = if length <= most {
        length
    } else {
        let least = (usable - 12) * 32 / 255 - 23;
        let filled = least + (length - least) % (usable - 4);
        if filled <= most { filled } else { least }
    };
    let end = at.checked_add(local as usize)?;
    let overflow = if length <= most {
        0
    } else {
        big_endian(page, end, 4)?
    };
    Some(Cell {
        rowid: rowid as i64,
        length,
        local: page.get(at..end)?,
        overflow,
    })
}

/// The types of a record's columns, and the length of its header.
fn serial_types(record: &[u8]) -> Option<(Vec<u64>, usize)> {
    let (header, mut at) = varint(record, 0)?;
    let header = usize::try_from(header).ok().filter(|&end| end <= record.len())?;
    let mut types = Vec::new();
    while at < header {
        let (kind, next) = varint(record, at)?;
        types.push(kind);
        at = next;
    }
    (at == header).then_some((types, header))
}

/// Length in bytes of a value of a type.
fn length_of(kind: u64) -> u64 {
    match kind {
        1..=4 => kind,
        5 => 6,
        6 | 7 => 8,
        12.. => (kind - 12) / 2,
        _ => 0,
    }
}

fn values(record: &[u8]) -> Option<Vec<Value>> {
    let (types, mut at) = serial_types(record)?;
    let mut values = Vec::with_capacity(types.len());
    for kind in types {
        let end = at.checked_add(usize::try_from(length_of(kind)).ok()?)?;
        let bytes = record.get(at..end)?;
        values.push(match kind {
            0 => Value::Null,
            1..=6 => Value::Integer(signed(bytes)),
            7 => Value::Real(f64::from_bits(signed(bytes) as u64)),
            8 | 9 => Value::Integer(kind as i64 - 8),
            12.. if kind % 2 == 0 => Value::Blob(bytes.to_vec()),
            12.. => Value::Text(String::from_utf8(bytes.to_vec()).ok()?),
            _ => return None,
        });
        at = end;
    }
    Some(values)
}

/// A big-endian integer of one to eight bytes, the first with the sign.
fn signed(bytes: &[u8]) -> i64 {
    let negative = bytes.first().is_some_and(|&byte| byte >= 0x80);
    bytes.iter().fold(if negative { -1 } else { 0 }, |value, &byte| {
        (value << 8) | i64::from(byte)
    })
}

/// A variable-length integer, and where it ends.
fn varint(bytes: &[u8], mut at: usize) -> Option<(u64, usize)> {
    let mut value = 0_u64;
    for place in 0..9 {
        let byte = *bytes.get(at)?;
        at += 1;
        if place == 8 {
            return Some(((value << 8) | u64::from(byte), at));
        }
        value = (value << 7) | u64::from(byte & 0x7f);
        if byte < 0x80 {
            break;
        }
    }
    Some((value, at))
}

/// An unsigned big-endian integer of up to four bytes.
fn big_endian(bytes: &[u8], at: usize, length: usize) -> Option<u32> {
    let bytes = bytes.get(at..at.checked_add(length)?)?;
    Some(
        bytes
            .iter()
            .fold(0, |value, &byte| (value << 8) | u32::from(byte)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of one page of 1024 bytes, with these bytes as the record of its row 1, to which so many pointers lead.
    fn page(record: &[u8], pointers: u16) -> tempfile::NamedTempFile {
        let mut page = vec![0; 1024];
        page[..18].copy_from_slice(b"SQLite format 3\0\x04\0");
        let at = page.len() - record.len() - 2;
        page[at] = record.len() as u8;
        page[at + 1] = 1;
        page[at + 2..].copy_from_slice(record);
        page[HEADER] = 13;
        page[HEADER + 3..HEADER + 5].copy_from_slice(&pointers.to_be_bytes());
        for index in 0..usize::from(pointers) {
            let pointer = HEADER + 8 + 2 * index;
            page[pointer..pointer + 2].copy_from_slice(&(at as u16).to_be_bytes());
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), page).unwrap();
        file
    }

    /// The rows of a file, and how many there were that cannot be read.
    fn rows(file: &tempfile::NamedTempFile) -> (Vec<StoredRow>, usize) {
        let mut rows = Vec::new();
        let mut pages = Pages::candidates(file.path()).unwrap().pop().unwrap();
        let scan = pages.rows(|_| true, |row| rows.push(row));
        (rows, scan.unreadable)
    }

    #[test]
    fn lengths_that_add_up_beyond_64_bits_are_no_record() {
        let text = StoredRow {
            rowid: 1,
            values: vec![Value::Null, Value::Text("wall".to_owned())],
        };
        assert_eq!(rows(&page(b"\x03\0\x15wall", 1)), (vec![text], 0));
        let mut record = vec![19];
        record.extend([0xff; 18]);
        assert_eq!(rows(&page(&record, 1)), (Vec::new(), 1));
    }

    #[test]
    fn rows_that_point_into_one_another_are_read_only_so_often() {
        let mut record = vec![4, 0, 0x81, 0x59];
        record.extend([b'x'; 102]);
        let (read, unreadable) = rows(&page(&record, 150));
        let most = OVERLAP as usize * 1024 / record.len();
        assert_eq!((read.len(), unreadable), (most, 150 - most));
    }
}
