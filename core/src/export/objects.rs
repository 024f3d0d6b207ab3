//! The objects of an export: which pixels and nodes are which, and what lists them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::layout::{About, Labelled, LabelledScene, OutputFile, json_file};
use super::{ExportError, Ids, Refusal};
use crate::labels::{ClassId, ObjectId, VOID};
use crate::scene::Scene;
use crate::semantics::{Surface, SurfaceObjects};
use crate::session::FrameMap;

/// Where the objects go, and what lists them.
pub(super) const OBJECTS: &str = "objects";
pub(super) const OBJECT_LIST: &str = "objects.json";

/// An object as it is exported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ExportedObject {
    pub(super) id: u16,
    /// The exported class.
    pub(super) class: ClassId,
    pub(super) thing: bool,
    pub(super) name: String,
}

/// The objects of an export.
pub(super) struct Objects {
    /// The things on each surface that a map follows from: while the geometry is learnt there may be two.
    on_surfaces: Vec<(Arc<Surface>, SurfaceObjects)>,
    /// Those of exported classes: the things, and then a number for each class that is stuff.
    pub(super) listed: Vec<ExportedObject>,
    /// The numbers of the latter, by exported class.
    stuff: FxHashMap<ClassId, u16>,
}

impl Objects {
    /// Those of a scene; `None` where no class is a thing or the maps follow from no surface.
    pub(super) fn of(labelled: LabelledScene<'_>, ids: &Ids<'_>) -> Option<Self> {
        labelled.classes.iter().find(|class| class.thing)?;
        let (surface, posterior) = labelled.maps.first()?.surface()?;
        let told = (labelled.classes, labelled.objects);
        let known = !labelled.parts.is_empty();
        let before = known.then(|| SurfaceObjects::recalled(surface, labelled.parts));
        let first = SurfaceObjects::new(surface, posterior, told, before.as_ref());
        let things = first.objects.iter().map(|object| ExportedObject {
            id: object.id.number(),
            class: ids.of(object.class),
            thing: true,
            name: object.name.clone(),
        });
        let mut listed: Vec<ExportedObject> = things.collect();
        let used: BTreeSet<u16> = listed.iter().map(|object| object.id).collect();
        let next = used.last().map_or(1, |last| last.saturating_add(1));
        let free = (next..=u16::MAX).chain(1..next).filter(|id| !used.contains(id));
        let stuff = ids.classes().iter().filter(|class| !class.thing);
        listed.extend(free.zip(stuff).map(|(id, class)| ExportedObject {
            id,
            class: class.id,
            thing: false,
            name: class.name.clone(),
        }));
        listed.retain(|object| object.class != VOID);
        let mut on_surfaces = vec![(Arc::clone(surface), first)];
        for (other, posterior) in labelled.maps.iter().filter_map(|map| map.surface()) {
            if !on_surfaces.iter().any(|(known, _)| Arc::ptr_eq(known, other)) {
                let moved = on_surfaces[0].1.on(surface, (other, posterior));
                on_surfaces.push((Arc::clone(other), moved));
            }
        }
        let stuff = listed.iter().filter(|object| !object.thing);
        Some(Self {
            on_surfaces,
            stuff: stuff.map(|object| (object.class, object.id)).collect(),
            listed,
        })
    }

    /// The things on the surface that a map follows from.
    pub(super) fn on_surface_of(&self, map: &FrameMap) -> Option<&SurfaceObjects> {
        let (surface, _) = map.surface()?;
        let mut known = self.on_surfaces.iter();
        known
            .find(|(own, _)| Arc::ptr_eq(own, surface))
            .map(|(_, objects)| objects)
    }

    /// The number of the object of a node of the first map's surface, of a node with this exported class; 0 where it has none.
    pub(super) fn of_node(&self, node: u32, label: ClassId) -> u16 {
        let thing = self.on_surfaces[0].1.of_node(node).map_or(0, ObjectId::number);
        self.all_of(label).unwrap_or(thing)
    }

    /// The number of the object that all of an exported class is; `None` for one with things.
    fn all_of(&self, label: ClassId) -> Option<u16> {
        match label {
            VOID => Some(0),
            label => self.stuff.get(&label).copied(),
        }
    }

    /// The number of every pixel's object, of pixels with these exported classes, by those that the map knows.
    pub(super) fn of_pixels(&self, labels: &[ClassId], things: &[u16]) -> Vec<u16> {
        let mut objects = Vec::with_capacity(labels.len());
        for same in labels.chunk_by(|a, b| a == b) {
            let (start, end) = (objects.len(), objects.len() + same.len());
            match self.all_of(same[0]) {
                Some(object) => objects.resize(end, object),
                None => objects.extend_from_slice(&things[start..end]),
            }
        }
        objects
    }
}

/// Pixels of each object in a frame.
pub(super) struct ObjectPixels(BTreeMap<u16, u64>);

impl ObjectPixels {
    pub(super) fn of(frame: &Labelled<'_>) -> Self {
        let mut pixels = BTreeMap::new();
        let objects = frame.objects.as_deref().unwrap_or_default();
        for same in objects.chunk_by(|a, b| a == b) {
            *pixels.entry(same[0]).or_default() += same.len() as u64;
        }
        Self(pixels)
    }
}

/// `objects.json`: the objects that any frame shows; `None` where nothing is known of objects.
pub(super) fn objects_file(about: About<'_>, frames: &[ObjectPixels]) -> Result<Option<OutputFile>, Refusal> {
    let Some(objects) = about.objects else {
        return Ok(None);
    };
    let record = |object: &ExportedObject| {
        let class = about.classes.iter().find(|class| class.id == object.class);
        ObjectRecord {
            id: object.id,
            class_id: object.class,
            class_name: class.map_or_else(String::new, |class| class.name.clone()),
            thing: object.thing,
            name: object.name.clone(),
            pixels: frames.iter().filter_map(|frame| frame.0.get(&object.id)).sum(),
        }
    };
    let shown = objects.iter().map(record).filter(|record| record.pixels > 0);
    Ok(Some(json_file(OBJECT_LIST, &shown.collect::<Vec<_>>())?))
}

/// A line of `objects.json`.
#[derive(Serialize)]
struct ObjectRecord {
    id: u16,
    class_id: ClassId,
    class_name: String,
    thing: bool,
    name: String,
    /// In all frames.
    pixels: u64,
}

/// Empties the list of an earlier export's objects: its numbers may mean others in what is written now.
pub(super) fn forget_objects(folder: &Path, inner: &[&str]) -> Result<(), ExportError> {
    let list = OutputFile::new(OBJECT_LIST, b"[]\n".to_vec());
    if !inner.is_empty() && folder.join(&list.path).is_file() {
        list.write(folder)?;
    }
    Ok(())
}

/// Removes what an earlier export said of objects: whoever reads it beside the new labels believes it before them.
pub(super) fn remove_objects(folder: &Path, inner: &[&str], scene: &Scene) -> Result<(), ExportError> {
    let list = folder.join(OBJECT_LIST);
    let places = inner.iter().map(|name| folder.join(name));
    // One without the other is not ours.
    for place in places.filter(|place| place.is_dir() && list.is_file()) {
        for frame in &scene.frames {
            super::remove(&place.join(format!("{}.png", frame.stem)))?;
        }
        super::remove(&list)?;
    }
    Ok(())
}
