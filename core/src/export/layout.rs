//! How a data set is laid out on disk, and the writing that all layouts share.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::objects::{ExportedObject, OBJECT_LIST, Objects, forget_objects, remove_objects};
use super::pngs::CLASSES;
use super::{ExportError, Ids, Options, REPORT, Refusal, atomic};
use crate::labels::{Class, ClassId, LabelSet, Object, VOID};
use crate::project::same_file;
use crate::scene::{Frame, ImagePixels, Scene, SceneSource};
use crate::semantics::KnownPart;
use crate::session::{CERTAIN, FrameMap};

/// A scene with a map of every frame.
#[derive(Clone, Copy, Debug)]
pub struct LabelledScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its classes.
    pub classes: &'a [Class],
    /// The objects that its labels tell apart.
    pub objects: &'a [Object],
    /// The other objects that were found on its surface before, whose numbers stay.
    pub parts: &'a [KnownPart],
    /// One map for each frame, in any order.
    pub maps: &'a [Arc<FrameMap>],
}

impl<'a> LabelledScene<'a> {
    /// A scene with its labels, the parts that they do not name, and the maps made from them.
    pub fn new(
        scene: &'a Scene,
        labels: &'a LabelSet,
        parts: &'a [KnownPart],
        maps: &'a [Arc<FrameMap>],
    ) -> Self {
        Self {
            scene,
            classes: &labels.classes,
            objects: &labels.objects,
            parts,
            maps,
        }
    }
}

/// What an export did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Files that are new or have new content.
    pub files: usize,
    /// Files that were there already, byte for byte, and were left alone.
    pub unchanged: usize,
}

impl Written {
    /// Writes a file into an export's folder, unless it is there already, and counts it.
    pub(super) fn write(&mut self, folder: &Path, file: &OutputFile) -> Result<(), ExportError> {
        let count = match file.write(folder)? {
            true => &mut self.files,
            false => &mut self.unchanged,
        };
        *count += 1;
        Ok(())
    }

    /// Writes what is exported at once, file by file, unless `progress` answers [`ControlFlow::Break`] before.
    pub(super) fn at_once(
        folder: &Path,
        (inner, files): (&[&str], impl IntoIterator<Item = OutputFile>),
        frames: usize,
        progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
    ) -> Result<Self, ExportError> {
        if progress(0, frames).is_break() {
            return Err(ExportError::cancelled(folder, 0, frames));
        }
        super::prepare(folder, inner)?;
        let mut written = Self::default();
        for file in files {
            // That of a run would promise classes that belong to its label images.
            if file.path == Path::new(CLASSES) && !file.is_there(folder) {
                super::remove(&folder.join(REPORT))?;
            }
            written.write(folder, &file)?;
        }
        Ok(written)
    }
}

/// One frame as it is exported: in the pixels of its image on disk, distortion included.
pub(super) struct Labelled<'a> {
    pub(super) frame: &'a Frame,
    /// Place of the frame in the scene, counted from 1.
    pub(super) number: usize,
    /// Width and height in pixels.
    pub(super) size: [u32; 2],
    /// Class of every pixel, row-major `[height, width]`, under the ids that are exported.
    pub(super) labels: Vec<ClassId>,
    /// Entropy of every pixel, nats times [`ENTROPY_STEPS_PER_NAT`](crate::session::ENTROPY_STEPS_PER_NAT).
    pub(super) entropy: Vec<u16>,
    /// The exported classes.
    pub(super) classes: &'a [Class],
    /// Number of every pixel's object, row-major `[height, width]`; all of a class that is stuff is one, and 0 is void or a
    /// thing of which the object is not known. `None` where nothing is known of objects.
    pub(super) objects: Option<Vec<u16>>,
    /// The exported objects of all frames.
    pub(super) listed: &'a [ExportedObject],
}

/// Pixels that formats with instances keep together: those of an object, or of a class whose objects are not told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Segment {
    /// Position of the class in [`Labelled::classes`], counted from 1.
    pub(super) class: u16,
    /// Number of the object; 0 for none.
    pub(super) object: u16,
}

impl Labelled<'_> {
    /// The frame's name, which its files are named by.
    pub(super) fn stem(&self) -> &str {
        &self.frame.stem
    }

    /// Position of every pixel's class in [`Labelled::classes`], counted from 1, row-major `[height, width]`; 0 is void.
    ///
    /// # Errors
    /// A class that is not listed.
    pub(super) fn positions(&self) -> Result<Vec<u16>, Refusal> {
        let known = self.classes.iter().map(|class| class.id).zip(1..);
        let position_of: FxHashMap<ClassId, u16> = known.chain([(VOID, 0)]).collect();
        let position = |label: &ClassId| {
            let position = position_of.get(label).copied();
            position.ok_or_else(|| {
                format!("it shows class {label}, which is not in the list of classes; add it").into()
            })
        };
        self.labels.iter().map(position).collect()
    }

    /// The segments of the frame, ordered, and for every pixel the place of its segment, counted from 1, row-major
    /// `[height, width]`; 0 is void. More than 65,535 do not fit, and are void.
    ///
    /// # Errors
    /// A class that is not listed.
    pub(super) fn segments(&self) -> Result<(Vec<Segment>, Vec<u16>), Refusal> {
        let positions = self.positions()?;
        let no_objects;
        let objects = match &self.objects {
            Some(objects) => objects,
            None => {
                no_objects = vec![0; positions.len()];
                &no_objects
            }
        };
        let of_pixel = positions.iter().zip(objects);
        let of_pixel = of_pixel.map(|(&class, &object)| Segment { class, object });
        let mut segments: Vec<Segment> = of_pixel.clone().collect();
        segments.dedup();
        segments.sort_unstable();
        segments.dedup();
        segments.retain(|segment| segment.class != 0);
        let place: FxHashMap<Segment, u16> = segments.iter().copied().zip(1..=u16::MAX).collect();
        let places = of_pixel.map(|segment| place.get(&segment).copied().unwrap_or(0));
        Ok((segments, places.collect()))
    }
}

/// A file of an export.
pub(super) struct OutputFile {
    /// Below the export's folder.
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    /// Whether it is a copy of an image of the capture.
    is_copy: bool,
}

impl OutputFile {
    pub(super) fn new(path: impl Into<PathBuf>, bytes: Vec<u8>) -> Self {
        Self {
            path: path.into(),
            bytes,
            is_copy: false,
        }
    }

    /// A copy of an image of the capture.
    pub(super) fn copy(path: impl Into<PathBuf>, bytes: Vec<u8>) -> Self {
        Self {
            is_copy: true,
            ..Self::new(path, bytes)
        }
    }

    /// Its name in its folder.
    pub(super) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Whether it would be new in the folder of this image of the capture, over it or beside it as another, or be a copy over
    /// another image of the capture: that may have the same ones in several sizes.
    fn is_among(&self, folder: &Path, image: &Path, source: &SceneSource) -> bool {
        let path = folder.join(&self.path);
        let is_own = path.parent().is_some_and(|place| is_in(image, place));
        let replaces = || self.is_copy && path.exists() && is_capture(folder, source);
        (is_own || replaces()) && !self.is_there(folder)
    }

    /// Whether it is in an export's folder already.
    pub(super) fn is_there(&self, folder: &Path) -> bool {
        atomic::holds(&folder.join(&self.path), &self.bytes)
    }

    /// Writes it into an export's folder, unless it is there already; whether it was not.
    pub(super) fn write(&self, folder: &Path) -> Result<bool, ExportError> {
        let is_new = !self.is_there(folder);
        if is_new {
            self.replace(folder)?;
        }
        Ok(is_new)
    }

    /// Writes it into an export's folder in place of what is there.
    fn replace(&self, folder: &Path) -> Result<(), ExportError> {
        let path = folder.join(&self.path);
        atomic::replace(&path, &self.bytes).map_err(|error| ExportError::unwritable(&path, error))
    }
}

/// Whether a folder is that of the capture.
pub fn is_capture(folder: &Path, source: &SceneSource) -> bool {
    matches!(source, SceneSource::Folder(capture) if same_file(folder, capture))
}

/// Whether an image of the capture lies in a folder.
pub(super) fn is_in(image: &Path, folder: &Path) -> bool {
    image.parent().is_some_and(|images| same_file(images, folder))
}

/// A value as a JSON file on one line, for lists too long to be looked at.
pub(super) fn dense_json_file<T: serde::Serialize + ?Sized>(
    path: impl Into<PathBuf>,
    value: &T,
) -> Result<OutputFile, Refusal> {
    let mut text = serde_json::to_vec(value)?;
    text.push(b'\n');
    Ok(OutputFile::new(path, text))
}

/// A value as a JSON file.
pub(super) fn json_file<T: serde::Serialize + ?Sized>(path: &str, value: &T) -> Result<OutputFile, Refusal> {
    let mut text = serde_json::to_vec_pretty(value)?;
    text.push(b'\n');
    Ok(OutputFile::new(path, text))
}

impl Segment {
    /// The object's number, where it is one of a thing.
    pub(super) fn thing(&self, classes: &[Class]) -> Option<u16> {
        let class = classes.get(usize::from(self.class).checked_sub(1)?)?;
        (class.thing && self.object != 0).then_some(self.object)
    }
}

/// What the files about all frames tell of.
#[derive(Clone, Copy)]
pub(super) struct About<'a> {
    /// The exported classes.
    pub(super) classes: &'a [Class],
    /// The exported objects; `None` where nothing is known of objects.
    pub(super) objects: Option<&'a [ExportedObject]>,
}

/// A kind of data set: which files it has, and what is in them. The same maps give the same bytes.
pub(super) trait Layout: Sync {
    /// What the files that list all frames have to know of one.
    type Entry: Send;

    /// The folders that its files are in.
    const FOLDERS: &'static [&'static str];
    /// The folders of objects, where there are any.
    const OBJECT_FOLDERS: &'static [&'static str] = &[];
    /// The files about all frames but `objects.json`, which tells that the folders of objects are those of an export.
    const INDEX: &'static [&'static str] = &[];

    /// Whether classes can be written like this; asked before anything is written.
    ///
    /// # Errors
    /// Why they cannot.
    fn check(&self, _classes: &[Class]) -> Result<(), Refusal> {
        Ok(())
    }

    /// The files of one frame; called from several threads at once.
    ///
    /// # Errors
    /// Why the frame cannot be written like this.
    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal>;

    /// The files about all frames, whose entries are in the order of the scene; none unless said otherwise.
    ///
    /// # Errors
    /// Why they cannot be written.
    fn index(&self, _about: About<'_>, _entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        Ok(Vec::new())
    }
}

/// Writes a data set. Files that have the right content already are left alone.
///
/// `progress` is called with (frames written, frames in all), from any thread; when it answers
/// [`ControlFlow::Break`], no further frame is begun.
pub(super) fn write<L: Layout>(
    layout: &L,
    folder: &Path,
    labelled: LabelledScene<'_>,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    let incomplete = |reason: Refusal| ExportError::incomplete(folder, reason);
    let maps = in_order(labelled).map_err(incomplete)?;
    let ids = options.ids_of(labelled.classes);
    let classes = ids.classes();
    layout.check(classes).map_err(incomplete)?;
    let objects = Objects::of(labelled, &ids);
    refuse_truth(folder, labelled.scene)?;
    super::prepare(folder, L::FOLDERS)?;
    match &objects {
        Some(_) => super::prepare(folder, L::OBJECT_FOLDERS)?,
        None => remove_objects(folder, L::OBJECT_FOLDERS, labelled.scene)?,
    }
    // It would be taken for that of a run that has made all of these files.
    super::remove(&folder.join(REPORT))?;
    let places = ImagePixels::default();
    let (frames, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (files, unchanged) = (AtomicUsize::new(0), AtomicUsize::new(0));
    // Nothing may list other files than those beside it, even if this export is stopped: what does is removed before.
    let write_files = |written: Vec<OutputFile>, is_of_frame: bool| {
        written.iter().try_for_each(|file| -> Result<(), ExportError> {
            if file.is_there(folder) {
                unchanged.fetch_add(1, Ordering::Relaxed);
                return Ok(());
            }
            if is_of_frame {
                for name in L::INDEX {
                    super::remove(&folder.join(name))?;
                }
                if objects.is_some() {
                    forget_objects(folder, L::OBJECT_FOLDERS)?;
                }
            }
            files.fetch_add(1, Ordering::Relaxed);
            file.replace(folder)
        })
    };
    let write_frame = |(frame, map): (&Frame, &FrameMap)| -> Result<Option<L::Entry>, ExportError> {
        if stopped.load(Ordering::Relaxed) {
            return Ok(None);
        }
        // Without its files a frame would get labels of nothing.
        frame.pixels()?;
        let (written, entry) = exported(
            frame,
            (map, objects.as_ref()),
            &ids,
            options.least_probability,
            &places,
        )
        .and_then(|labelled| layout.frame(&labelled))
        .map_err(|reason| ExportError::incomplete(folder, format!("frame \"{}\": {reason}", frame.stem)))?;
        if let Some(file) = written
            .iter()
            .find(|file| file.is_among(folder, &frame.path, &labelled.scene.source))
        {
            let name = file.path.display();
            let reason = format!("{name} would lie among the capture's own images; choose another folder");
            return Err(ExportError::incomplete(folder, reason));
        }
        write_files(written, true)?;
        let done = frames.fetch_add(1, Ordering::Relaxed) + 1;
        if progress(done, maps.len()).is_break() {
            stopped.store(true, Ordering::Relaxed);
        }
        Ok(Some(entry))
    };
    let scene = labelled.scene;
    let entries: Vec<Option<L::Entry>> = maps
        .par_iter()
        .map(|&map| write_frame((&scene.frames[map.frame], map)))
        .collect::<Result<_, _>>()?;
    let entries: Vec<L::Entry> = entries.into_iter().flatten().collect();
    if entries.len() < maps.len() {
        return Err(ExportError::cancelled(folder, entries.len(), maps.len()));
    }
    let about = About {
        classes,
        objects: objects.as_ref().map(|objects| objects.listed.as_slice()),
    };
    write_files(layout.index(about, entries).map_err(incomplete)?, false)?;
    Ok(Written {
        files: files.into_inner(),
        unchanged: unchanged.into_inner(),
    })
}

/// Refuses the folder of a capture that has labels and lists of its own.
pub(super) fn refuse_truth(folder: &Path, scene: &Scene) -> Result<(), ExportError> {
    let is_any = |names: &[&str]| names.iter().any(|name| folder.join(name).exists());
    if is_capture(folder, &scene.source)
        && is_any(&["semantic_class", "semantic_instance"])
        && is_any(&[CLASSES, OBJECT_LIST])
    {
        let reason = format!(
            "it has the {CLASSES} or {OBJECT_LIST} of the capture's own labels; choose another folder"
        );
        return Err(ExportError::incomplete(folder, reason));
    }
    Ok(())
}

/// Makes void what is less probable than `least`, 0..=1, by its confidence as in [`FrameMap::confidence`].
pub(super) fn void_improbable(labels: &mut [ClassId], confidence: &[u16], least: f32) {
    let least = (least * f32::from(CERTAIN)).ceil() as u16;
    for (label, &confidence) in labels.iter_mut().zip(confidence) {
        if confidence < least {
            *label = VOID;
        }
    }
}

/// A frame's map as it is exported.
pub(super) fn exported<'a>(
    frame: &'a Frame,
    (map, objects): (&FrameMap, Option<&'a Objects>),
    ids: &'a Ids<'_>,
    least_probability: Option<f32>,
    places: &ImagePixels,
) -> Result<Labelled<'a>, Refusal> {
    let on_surface = objects.and_then(|objects| objects.on_surface_of(map));
    let map = map.in_image_with(frame, on_surface, places);
    let mut labels = map.labels().into_owned();
    if let Some(least) = least_probability {
        let confidence = map.confidence().ok_or(
            "its probabilities are not known yet; wait until it was trained again, or export without a threshold",
        )?;
        void_improbable(&mut labels, &confidence, least);
    }
    for same in labels.chunk_by_mut(|a, b| a == b) {
        same.fill(ids.of(same[0]));
    }
    let known = objects.zip(map.objects());
    let known = known.map(|(objects, things)| objects.of_pixels(&labels, things));
    Ok(Labelled {
        frame,
        number: map.frame + 1,
        size: [map.width, map.height],
        labels,
        entropy: map.entropy().into_owned(),
        classes: ids.classes(),
        objects: known,
        listed: objects.map_or(&[], |objects| &objects.listed),
    })
}

/// The maps in the order of the frames, if there is one of the right size for every frame.
fn in_order<'a>(labelled: LabelledScene<'a>) -> Result<Vec<&'a FrameMap>, Refusal> {
    let LabelledScene { scene, maps, .. } = labelled;
    let mut map_of: Vec<Option<&FrameMap>> = vec![None; scene.frames.len()];
    for map in maps {
        let Some(frame) = scene.frames.get(map.frame) else {
            let (number, source) = (map.frame, &scene.source);
            return Err(format!("there is a map of frame {number}, which {source} does not have").into());
        };
        if map_of[map.frame].replace(map).is_some() {
            return Err(format!("there are two maps of frame \"{}\"", frame.stem).into());
        }
        if [map.width, map.height] != [frame.camera.width, frame.camera.height] {
            let stem = &frame.stem;
            return Err(format!("the map of frame \"{stem}\" has another size than the frame").into());
        }
    }
    let maps = map_of.into_iter().zip(&scene.frames);
    maps.map(|(map, frame)| map.ok_or_else(|| format!("frame \"{}\" has no map yet", frame.stem).into()))
        .collect()
}
