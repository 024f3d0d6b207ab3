//! What can be read of a damaged project file.
//!
//! The file is only read, never written. A stroke is looked for twice: in its own row, and in the edits that made
//! it; see [`Found`] for the rows and [`replay`] for the edits.

mod found;
mod pages;
mod replay;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use self::found::Found;
use self::replay::Replay;
use super::imports::decoded;
use super::{Contents, FrameRecord, SceneRecord, location};
use crate::labels::{Class, History, ImportId, ImportedLabels, ImportedMap, LabelSet, Stroke, Trust, VOID};
use crate::scene::SceneSource;

/// What was read of a damaged file.
#[derive(Debug)]
pub(super) struct Salvaged {
    /// The labels and as much of their history as can be undone; no maps, no model.
    pub(super) contents: Contents,
    /// How much that is, and what is missing: the middle of a sentence.
    pub(super) account: String,
}

/// Frames beyond the last one listed that strokes may be on: the list may have lost its end.
const MOST_UNLISTED: usize = 1000;

/// Reads what is readable in `file`, which stands for the project at `path`. `None` when nothing is, or when the file
/// cannot be told from one of another program.
pub(super) fn salvage(file: &Path, path: &Path, surely_ours: bool) -> Option<Salvaged> {
    let mut found = Found::read(file).ok()?;
    let says_something = !found.strokes.is_empty() || !found.edits.is_empty();
    let is_there = says_something || surely_ours && (!found.frames.is_empty() || found.project.is_some());
    if !is_there {
        return None;
    }
    let mut account = Account::default();
    drop_far_frames(&mut found);
    account.unreadable = found.unreadable;
    account.deleted_rows_possible = found.deleted_rows_possible;

    let cursor = found.project.as_ref().map(|project| project.cursor);
    account.place_lost = found.project.is_none();
    let replay = Replay::of(&found.edits, cursor, &found.strokes);
    let strokes = strokes(&found, &replay, &mut account);
    let classes = classes(&found, &replay, &strokes, &mut account);
    let scene = scene(&found, &strokes, &replay, path, &mut account);
    let (images, in_force) = imports(&found, &scene, &mut account);
    account.classes = classes.len();
    account.edits = replay.kept.len();
    account.edits_lost = replay.lost;

    let labels = LabelSet {
        classes,
        strokes,
        imported: None,
    };
    let history = History::restored(labels, replay.kept, replay.cursor).with_imports(images, in_force);
    let mut contents = Contents::new(scene, history);
    contents.view = found.project.and_then(|project| project.view);
    Some(Salvaged {
        contents,
        account: account.text(),
    })
}

/// Drops what is on frames that the capture cannot have.
fn drop_far_frames(found: &mut Found) {
    let Some((&last, _)) = found.frames.last_key_value() else {
        return;
    };
    let limit = last + 1 + MOST_UNLISTED;
    let before = found.strokes.len() + found.edits.len() + found.images.len();
    found.strokes.retain(|_, stroke| stroke.frame < limit);
    found
        .edits
        .retain(|_, edit| replay::strokes_of(edit).all(|stroke| stroke.frame < limit));
    found.images.retain(|&(_, frame), _| frame < limit);
    found.unreadable += before - found.strokes.len() - found.edits.len() - found.images.len();
}

type Strokes = BTreeMap<crate::labels::StrokeId, Arc<Stroke>>;

/// The strokes of the rows, and those that only the edits tell of.
fn strokes(found: &Found, replay: &Replay, account: &mut Account) -> Strokes {
    let mut strokes: Strokes = found
        .strokes
        .iter()
        .map(|(&id, stroke)| (id, Arc::new(stroke.clone())))
        .collect();
    for (&id, state) in &replay.strokes {
        match state {
            // The rows may be those of strokes that were erased: then the edits are to be believed.
            None if found.deleted_rows_possible => drop(strokes.remove(&id)),
            None => {}
            Some(stroke) => {
                let known = strokes.contains_key(&id);
                account.restored += usize::from(!known);
                if !known || found.deleted_rows_possible {
                    strokes.insert(id, Arc::new(stroke.clone()));
                }
            }
        }
    }
    account.strokes = strokes.len();
    strokes
}

/// The classes of the rows, those that the edits tell of, and a nameless one for every other that a stroke has.
fn classes(found: &Found, replay: &Replay, strokes: &Strokes, account: &mut Account) -> Vec<Class> {
    let mut classes: Vec<Class> = Vec::new();
    let mut ids = BTreeSet::from([VOID]);
    let told = replay.classes.iter().flatten();
    let listed = if found.deleted_rows_possible && replay.classes.is_some() {
        Vec::new()
    } else {
        found.classes.values().collect()
    };
    for class in listed.into_iter().chain(told) {
        if ids.insert(class.id) {
            classes.push(class.clone());
        }
    }
    for stroke in strokes.values() {
        if ids.insert(stroke.class) {
            classes.push(Class::new(stroke.class, format!("class {}", stroke.class)));
            account.nameless += 1;
        }
    }
    classes
}

/// The scene; a frame whose name is lost has none, and is found by its number where the scene is opened.
fn scene(
    found: &Found,
    strokes: &Strokes,
    replay: &Replay,
    path: &Path,
    account: &mut Account,
) -> SceneRecord {
    let listed = found.frames.keys().copied();
    let of_strokes = strokes.values().map(|stroke| stroke.frame);
    let of_edits = replay.kept.iter().flat_map(replay::strokes_of);
    let of_edits = of_edits.map(|stroke| stroke.frame);
    let of_images = found.images.keys().map(|&(_, frame)| frame);
    let all = listed.chain(of_strokes).chain(of_edits).chain(of_images);
    let count = all.max().map_or(0, |last| last + 1);
    let nameless = FrameRecord {
        stem: String::new(),
        width: 0,
        height: 0,
        bytes: 0,
    };
    let frames: Vec<FrameRecord> = (0..count)
        .map(|number| found.frames.get(&number).unwrap_or(&nameless).clone())
        .collect();
    account.frames_lost = count - found.frames.len();
    let source = match &found.project {
        Some(project) if project.is_demo => SceneSource::Demo,
        project => {
            let (relative, absolute) = project.as_ref().map_or((None, None), |project| {
                (project.relative_path.as_deref(), project.absolute_path.as_deref())
            });
            SceneSource::Folder(location::resolve(path, relative, absolute))
        }
    };
    SceneRecord {
        source,
        depth: found.project.as_ref().is_none_or(|project| project.depth),
        frames,
    }
}

type Imports = (BTreeMap<ImportId, Arc<ImportedLabels>>, Option<ImportId>);

/// The imported label images that can be decoded.
fn imports(found: &Found, scene: &SceneRecord, account: &mut Account) -> Imports {
    let mut maps: BTreeMap<ImportId, Vec<ImportedMap>> = BTreeMap::new();
    for (&(id, frame), image) in &found.images {
        let map = scene.frames.get(frame).and_then(|record| {
            let size = [record.width, record.height];
            decoded(frame, size, &image.labels, image.shares.as_deref()).ok()
        });
        match map {
            Some(map) => {
                maps.entry(id).or_default().push(map);
                account.images += 1;
            }
            None => account.images_lost += 1,
        }
    }
    let images: BTreeMap<ImportId, Arc<ImportedLabels>> = maps
        .into_iter()
        .map(|(id, maps)| {
            // Without its row, believing it less is the safer way.
            let trust = found.trusts.get(&id).copied().unwrap_or(Trust::VOTES);
            (id, Arc::new(ImportedLabels { maps, trust }))
        })
        .collect();
    let in_force = found.project.as_ref().and_then(|project| project.imported);
    let there = in_force.filter(|id| images.contains_key(id));
    (images, there)
}

/// How much was read.
#[derive(Default)]
struct Account {
    strokes: usize,
    /// Of them: those that only the edits tell of.
    restored: usize,
    classes: usize,
    /// Of them: those whose names are lost.
    nameless: usize,
    edits: usize,
    edits_lost: usize,
    frames_lost: usize,
    images: usize,
    images_lost: usize,
    unreadable: usize,
    place_lost: bool,
    deleted_rows_possible: bool,
}

impl Account {
    fn text(&self) -> String {
        let mut read = format!(
            "{}, {} and {} were read",
            counted(self.strokes, "stroke", "strokes"),
            counted(self.classes, "class", "classes"),
            counted(self.edits, "edit", "edits")
        );
        if self.images > 0 {
            let images = counted(self.images, "imported image", "imported images");
            read = format!("{images}, {read}");
        }
        if self.restored > 0 {
            read.push_str(&format!(
                ", {} of the strokes from the edit history",
                self.restored
            ));
        }
        let lost = [
            (
                self.edits_lost,
                "edit that could be undone",
                "edits that could be undone",
            ),
            (self.images_lost, "imported image", "imported images"),
            (self.nameless, "name of a class", "names of classes"),
            (self.frames_lost, "name of a frame", "names of frames"),
            (self.unreadable, "other row or page", "other rows or pages"),
        ];
        let lost: Vec<String> = lost
            .into_iter()
            .filter(|&(count, ..)| count > 0)
            .map(|(count, one, several)| counted(count, one, several))
            .chain(self.place_lost.then(|| "the place of the scene".to_owned()))
            .chain(["maps and model, which are made anew".to_owned()])
            .collect();
        let stale = if self.deleted_rows_possible {
            "; strokes that were deleted may be back"
        } else {
            ""
        };
        format!("{read}; lost: {}{stale}", lost.join(", "))
    }
}

/// "1 stroke", "2 strokes".
fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}
