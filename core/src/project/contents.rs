//! What a project file holds, and fitting it to the scene as it is today.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;

use super::ProjectError;
use crate::labels::{Edit, History, ImportedMap, LabelSet, Stroke};
use crate::scene::{Frame, OpenOptions, Scene, SceneSource, in_one_line};
use crate::semantics::KnownPart;
use crate::session::{FrameMap, ModelState};

/// One frame as it was when the project was last matched to its scene: what a change is noticed by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameRecord {
    /// File stem of the colour image: the frame's name.
    pub stem: String,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Length of the colour image's file in bytes; 0 for the demo scene.
    pub bytes: u64,
}

impl FrameRecord {
    fn of(frame: &Frame) -> Self {
        Self {
            stem: frame.stem.clone(),
            width: frame.camera.width,
            height: frame.camera.height,
            bytes: fs::metadata(&frame.path).map_or(0, |metadata| metadata.len()),
        }
    }
}

/// The scene that a project labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneRecord {
    /// Where it is. A folder that has moved may not be there: see [`SceneRecord::is_there`].
    pub source: SceneSource,
    /// Whether its measured depth is used.
    pub depth: bool,
    /// Its frames in the order of the capture, then frames that were labelled and have since vanished.
    pub frames: Vec<FrameRecord>,
}

impl SceneRecord {
    /// The record of an opened scene.
    pub fn of(scene: &Scene, options: OpenOptions) -> Self {
        Self {
            source: scene.source.clone(),
            depth: options.depth,
            frames: scene.frames.iter().map(FrameRecord::of).collect(),
        }
    }

    /// Whether the scene's folder exists; where it does not, ask the person for its new place.
    pub fn is_there(&self) -> bool {
        match &self.source {
            SceneSource::Demo => true,
            SceneSource::Folder(folder) => folder.is_dir(),
        }
    }

    /// The names of the frames, vanished ones last.
    pub fn stems(&self) -> Vec<String> {
        self.frames.iter().map(|frame| frame.stem.clone()).collect()
    }
}

/// Everything that a project file holds.
#[derive(Clone, Debug)]
pub struct Contents {
    /// The scene that is labelled.
    pub scene: SceneRecord,
    /// Labels and edits. Frame indices are those of [`SceneRecord::frames`].
    pub history: History,
    /// View settings of the window, a JSON text.
    pub view: Option<String>,
    /// The last model state.
    pub model: Option<Arc<ModelState>>,
    /// The last maps, at most one a frame. Count the labels' generations from
    /// [`Contents::next_generation`], so that new maps replace them.
    pub maps: Vec<Arc<FrameMap>>,
    /// What is worth knowing about the file, a sentence each.
    pub warnings: Vec<String>,
    /// How this differs from what is in the file.
    pub(super) pending: Pending,
}

/// What [`Journal::start`](super::Journal::start) has to write first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Pending {
    /// Nothing.
    Nothing,
    /// The scene's place.
    Scene,
    /// Everything: the frames have changed, and with them the numbers of all others.
    All,
}

impl Contents {
    /// A project with labels and nothing learnt yet.
    pub fn new(scene: SceneRecord, history: History) -> Self {
        Self {
            scene,
            history,
            view: None,
            model: None,
            maps: Vec::new(),
            warnings: Vec::new(),
            pending: Pending::Nothing,
        }
    }

    /// The objects that no stroke names, as the window found them last: what it keeps of them in the view.
    pub fn parts(&self) -> Vec<KnownPart> {
        #[derive(Deserialize)]
        struct View {
            parts: Vec<KnownPart>,
        }
        let view = self.view.as_deref().map(serde_json::from_str::<View>);
        view.and_then(Result::ok).map_or_else(Vec::new, |view| view.parts)
    }

    /// A generation above those of all saved maps.
    pub fn next_generation(&self) -> u64 {
        let newest = self.maps.iter().map(|map| map.generation).max();
        newest.map_or(0, |generation| generation.saturating_add(1))
    }

    /// Refuses another scene, which may be [listed](crate::session::Event::Listed) alone.
    ///
    /// # Errors
    /// [`ProjectError::OtherScene`] when not one frame of the project is in the scene.
    pub fn check(&self, scene: &Scene) -> Result<(), ProjectError> {
        let frames = &self.scene.frames;
        let is_there = |frame: &FrameRecord| scene.frame_index(&frame.stem).is_some();
        if frames.is_empty() || frames.iter().any(is_there) {
            return Ok(());
        }
        let folder = PathBuf::from(scene.source.to_string());
        Err(ProjectError::OtherScene(folder, frames.len()))
    }

    /// Fits the contents to the scene as it was opened: frames are recognised by their stems, so that
    /// frames may have been added, removed or reordered.
    ///
    /// Frame indices become those of `scene`. Strokes on frames that have vanished stay in the project,
    /// with indices of `scene.frames.len()` and above, and have no effect; a warning counts them. Imported
    /// images do the same, and are dropped with a warning where their frame has another size. Where frames
    /// differ, the model is dropped (it would describe another scene), and so are the maps of frames that are
    /// gone or have another size. The file is brought in line by [`Journal::start`](super::Journal::start).
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn matched(mut self, scene: &Scene, options: OpenOptions) -> Result<Self, ProjectError> {
        self.check(scene)?;
        let mut record = SceneRecord::of(scene, options);
        let place: HashMap<&str, usize> = (0..scene.frames.len())
            .map(|index| (scene.frames[index].stem.as_str(), index))
            .collect();
        let mut new_index = Vec::with_capacity(self.scene.frames.len());
        for frame in &self.scene.frames {
            new_index.push(place.get(frame.stem.as_str()).copied().unwrap_or_else(|| {
                record.frames.push(frame.clone());
                record.frames.len() - 1
            }));
        }
        self.warn_of_changes(scene, &record);
        if record.frames != self.scene.frames {
            let (history, dropped) = renumbered(&self.history, &new_index, &record);
            self.history = history;
            if dropped > 0 {
                self.warnings.push(format!(
                    "{}: imported label images of frames that have another size now were left out: {dropped}; import \
                     them again",
                    scene.source
                ));
            }
            self.maps.retain_mut(|map| {
                let Some(&index) = new_index.get(map.frame) else {
                    return false;
                };
                Arc::make_mut(map).frame = index;
                scene
                    .frames
                    .get(index)
                    .is_some_and(|frame| [frame.camera.width, frame.camera.height] == [map.width, map.height])
            });
            self.model = None;
            self.pending = Pending::All;
        } else if record != self.scene {
            self.pending = self.pending.max(Pending::Scene);
        }
        self.scene = record;
        Ok(self)
    }

    fn warn_of_changes(&mut self, scene: &Scene, record: &SceneRecord) {
        let before: HashMap<&str, &FrameRecord> = self
            .scene
            .frames
            .iter()
            .map(|frame| (frame.stem.as_str(), frame))
            .collect();
        let (present, vanished) = record.frames.split_at(scene.frames.len());
        let vanished: BTreeSet<&str> = vanished.iter().map(|frame| frame.stem.as_str()).collect();
        let lost = self.history.labels().strokes.values().filter(|stroke| {
            let frame = self.scene.frames.get(stroke.frame);
            frame.is_some_and(|frame| vanished.contains(frame.stem.as_str()))
        });
        let lost = lost.count();
        if lost > 0 {
            self.warnings.push(format!(
                "{}: frames of the project that are gone: {} ({}); strokes on them, kept but without effect: {lost}",
                scene.source,
                vanished.len(),
                some_names(vanished.iter().copied()),
            ));
        }
        let changed: Vec<&str> = present
            .iter()
            .filter(|frame| {
                before
                    .get(frame.stem.as_str())
                    .is_some_and(|before| before != frame)
            })
            .map(|frame| frame.stem.as_str())
            .collect();
        if !changed.is_empty() {
            self.warnings.push(format!(
                "{}: images that have changed since they were labelled: {} ({}); check the labels there",
                scene.source,
                changed.len(),
                some_names(changed.iter().copied()),
            ));
        }
        let added = present
            .iter()
            .filter(|frame| !before.contains_key(frame.stem.as_str()))
            .count();
        if added > 0 && !before.is_empty() {
            self.warnings
                .push(format!("{}: new frames: {added}", scene.source));
        }
    }
}

/// The first three names, on one line whatever is in them.
pub(super) fn some_names<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = if names.len() > 3 { ", ..." } else { "" };
    format!(
        "{}{more}",
        names.take(3).map(in_one_line).collect::<Vec<_>>().join(", ")
    )
}

/// The history with `new_index[frame]` for every frame of `record`, and the number of imported images that were left out
/// because their frame has another size now.
fn renumbered(history: &History, new_index: &[usize], record: &SceneRecord) -> (History, usize) {
    let place = |frame: usize| new_index.get(frame).copied().unwrap_or(frame);
    let stroke = |stroke: &Stroke| Stroke {
        frame: place(stroke.frame),
        ..stroke.clone()
    };
    let labels = history.labels();
    let labels = LabelSet {
        classes: labels.classes.clone(),
        objects: labels.objects.clone(),
        strokes: labels
            .strokes
            .iter()
            .map(|(&id, old)| (id, Arc::new(stroke(old))))
            .collect(),
        imported: None,
        checked: labels.checked.iter().map(|&frame| place(frame)).collect(),
    };
    let (edits, cursor) = history.edits();
    let edit = |edit: &Edit| {
        let mut edit = edit.clone();
        for change in &mut edit.strokes {
            change.before = change.before.as_ref().map(stroke);
            change.after = change.after.as_ref().map(stroke);
        }
        if let Some(change) = &mut edit.checked {
            change.frame = place(change.frame);
        }
        edit
    };
    let (imports, in_force) = history.imports();
    let fits = |map: &ImportedMap| {
        let frame = record.frames.get(map.frame);
        frame.is_some_and(|frame| map.pixels() == frame.width as usize * frame.height as usize)
    };
    let mut dropped = 0;
    let imports = imports.iter().map(|(&id, images)| {
        let mut images = images.as_ref().clone();
        for map in &mut images.maps {
            map.frame = place(map.frame);
        }
        let before = images.maps.len();
        images.maps.retain(fits);
        dropped += before - images.maps.len();
        (id, Arc::new(images))
    });
    let imports = imports.collect();
    let history = History::restored(labels, edits.iter().map(edit).collect(), cursor);
    (history.with_imports(imports, in_force), dropped)
}
