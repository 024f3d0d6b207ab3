//! What the rows of a damaged project say, each checked on its own.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use super::super::FrameRecord;
use super::super::consistency::{foreign_id, is_id, is_sane};
use super::pages::{Pages, StoredRow, Value};
use super::replay::strokes_of;
use crate::labels::{Class, Edit, ImportId, Stroke, StrokeId, Trust};

/// More frames than any capture has: a number above it is damage, and makes no list of that length.
const MOST_FRAMES: usize = 1 << 16;

/// The row of the table `project`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ProjectRow {
    pub(super) is_demo: bool,
    pub(super) relative_path: Option<String>,
    pub(super) absolute_path: Option<String>,
    pub(super) depth: bool,
    pub(super) cursor: usize,
    pub(super) view: Option<String>,
    pub(super) imported: Option<ImportId>,
}

/// The PNGs of an imported label image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct StoredImage {
    pub(super) labels: Vec<u8>,
    /// Of probabilities: how probable the classes in `labels` are.
    pub(super) shares: Option<Vec<u8>>,
}

/// The readable rows. Maps and model are left where they are: they can be made again.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) project: Option<ProjectRow>,
    pub(super) frames: BTreeMap<usize, FrameRecord>,
    /// In the order on screen.
    pub(super) classes: BTreeMap<usize, Class>,
    pub(super) strokes: BTreeMap<StrokeId, Stroke>,
    pub(super) edits: BTreeMap<usize, Edit>,
    pub(super) trusts: BTreeMap<ImportId, Trust>,
    pub(super) images: BTreeMap<(ImportId, usize), StoredImage>,
    /// Rows, or pages of rows, that are there and say nothing.
    pub(super) unreadable: usize,
    /// Rows that were deleted may be among those found.
    pub(super) deleted_rows_possible: bool,
}

impl Found {
    /// Reads what is readable in the file at `path`.
    pub(super) fn read(path: &Path) -> io::Result<Self> {
        let found = Pages::candidates(path)?.into_iter().map(|mut pages| {
            let mut found = Self::default();
            let mut unreadable = 0;
            let scan = pages.rows(is_ours, |row| {
                unreadable += usize::from(found.take(row).is_none());
            });
            found.unreadable = scan.unreadable + unreadable;
            found.deleted_rows_possible = scan.deleted_rows_possible;
            found
        });
        Ok(found.max_by_key(Self::rows).unwrap_or_default())
    }

    /// Number of rows read.
    fn rows(&self) -> usize {
        self.frames.len() + self.classes.len() + self.strokes.len() + self.edits.len() + self.images.len()
    }

    /// Takes a row of one of our tables in; `None` where it cannot be right.
    fn take(&mut self, row: StoredRow) -> Option<()> {
        let number = usize::try_from(row.rowid)
            .ok()
            .filter(|&number| is_id(number as u64))?;
        match row.values.as_slice() {
            [
                _,
                Value::Text(stem),
                Value::Integer(width),
                Value::Integer(height),
                Value::Integer(bytes),
            ] => {
                let frame = FrameRecord {
                    stem: stem.clone(),
                    width: u32::try_from(*width).ok()?,
                    height: u32::try_from(*height).ok()?,
                    bytes: u64::try_from(*bytes).ok()?,
                };
                below_most(number)?;
                self.frames.entry(number).or_insert(frame);
            }
            [
                _,
                Value::Integer(id),
                Value::Text(name),
                Value::Integer(red),
                Value::Integer(green),
                Value::Integer(blue),
            ] => {
                let class = Class {
                    id: u16::try_from(*id).ok().filter(|&id| id > 0)?,
                    name: name.clone(),
                    color: [
                        u8::try_from(*red).ok()?,
                        u8::try_from(*green).ok()?,
                        u8::try_from(*blue).ok()?,
                    ],
                };
                self.classes.entry(number).or_insert(class);
            }
            [
                _,
                Value::Integer(frame),
                Value::Integer(class),
                Value::Integer(radius),
                Value::Text(lines),
            ] => {
                let stroke = Stroke {
                    frame: below_most(usize::try_from(*frame).ok()?)?,
                    class: u16::try_from(*class).ok()?,
                    radius: u32::try_from(*radius).ok()?,
                    lines: serde_json::from_str(lines).ok()?,
                };
                is_sane(&stroke).then_some(())?;
                self.strokes.entry(StrokeId(number as u64)).or_insert(stroke);
            }
            [_, Value::Text(text)] => self.take_text(number, text)?,
            [_, Value::Real(trust)] => {
                self.trusts
                    .insert(ImportId(number as u64), Trust::new(*trust as f32)?);
            }
            // SQLite keeps a number without a fraction as an integer.
            [_, Value::Integer(trust)] => {
                self.trusts
                    .insert(ImportId(number as u64), Trust::new(*trust as f32)?);
            }
            [
                Value::Integer(import),
                Value::Integer(frame),
                Value::Blob(labels),
                shares @ ..,
            ] => {
                let id = ImportId(u64::try_from(*import).ok().filter(|&id| is_id(id))?);
                let frame = below_most(usize::try_from(*frame).ok()?)?;
                let shares = match shares {
                    [Value::Blob(shares)] => Some(shares.clone()),
                    _ => None,
                };
                let labels = labels.clone();
                self.images
                    .entry((id, frame))
                    .or_insert(StoredImage { labels, shares });
            }
            values => self.project = Some(project(values)?),
        }
        Some(())
    }

    /// The tables `import`, of files of version 2, and `edit` both have a number and a text.
    fn take_text(&mut self, number: usize, text: &str) -> Option<()> {
        let trust = match text {
            "trusted" => Some(Trust::RIGHT),
            "votes" => Some(Trust::VOTES),
            _ => None,
        };
        if let Some(trust) = trust {
            self.trusts.insert(ImportId(number as u64), trust);
            return Some(());
        }
        let edit: Edit = serde_json::from_str(text).ok()?;
        foreign_id(&edit).is_none().then_some(())?;
        strokes_of(&edit)
            .all(|stroke| is_sane(stroke) && stroke.frame < MOST_FRAMES)
            .then_some(())?;
        self.edits.entry(number).or_insert(edit);
        Some(())
    }
}

fn below_most(frame: usize) -> Option<usize> {
    (frame < MOST_FRAMES).then_some(frame)
}

/// Whether columns of these kinds are those of one of our tables; maps and model aside.
fn is_ours(kinds: &str) -> bool {
    let imports = ["nr", "ni", "iib", "iibn", "iibb"];
    matches!(kinds, "ntiii" | "nitiii" | "niiit" | "nt") || imports.contains(&kinds) || is_project(kinds)
}

/// Whether they are those of the table `project`, in any of its versions: scene, two paths, depth, cursor, view, the
/// program's version, and the imported images.
fn is_project(kinds: &str) -> bool {
    let fits = |column: (char, &str)| column.1.contains(column.0);
    let columns = ["n", "t", "nt", "nt", "i", "i", "nt", "t", "in"];
    (8..=9).contains(&kinds.len()) && kinds.chars().zip(columns).all(fits)
}

fn project(values: &[Value]) -> Option<ProjectRow> {
    let text = |index: usize| match values.get(index) {
        Some(Value::Text(text)) => Some(text.clone()),
        _ => None,
    };
    let integer = |index: usize| match values.get(index) {
        Some(Value::Integer(value)) => u64::try_from(*value).ok(),
        _ => None,
    };
    Some(ProjectRow {
        is_demo: match text(1)?.as_str() {
            "demo" => true,
            "folder" => false,
            _ => return None,
        },
        relative_path: text(2),
        absolute_path: text(3),
        depth: integer(4)? != 0,
        cursor: usize::try_from(integer(5)?).ok()?,
        view: text(6),
        imported: integer(8).map(ImportId),
    })
}
