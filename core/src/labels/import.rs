//! Reading label images from elsewhere: a folder of PNGs, or of arrays of probabilities.

mod image;
mod numpy;
mod objects;
mod probabilities;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use self::image::LabelImage;
use self::objects::ObjectList;
use self::probabilities::Array;
use super::palette::{parse_class_list, parse_with_void};
use super::{Class, ClassId, ImportedLabels, ImportedMap, Label, Object, ObjectId, Trust, VOID};
use crate::scene::{Frame, Scene, has_proportions, sampled, shown};

/// Cells with probabilities that are kept of all frames together, 12 bytes each: more than a thousand frames of 640 x
/// 480 at a quarter of their size have.
const MOST_CELLS: usize = 32 << 20;
/// Folders of class images and of object images in an export, and in a capture of the Replica layout.
const LABELS: [&str; 2] = ["labels", "semantic_class"];
const OBJECTS: [&str; 2] = ["objects", "semantic_instance"];
/// The index of a palette image that stands for "not labelled" where no class has it, as in PASCAL VOC.
const BORDER: ClassId = 255;

/// Label images that cannot be used; nothing of them is taken over.
#[derive(Debug, thiserror::Error)]
#[error("{}: {}", shown(.0.display()), shown(.1))]
pub struct ImportError(PathBuf, String);

impl ImportError {
    fn new(path: &Path, reason: impl Display) -> Self {
        Self(path.to_path_buf(), reason.to_string())
    }

    /// Objects that cannot be [united](crate::semantics::united), as there is no surface.
    pub fn without_surface(folder: &Path) -> Self {
        let reason = "the numbers of its objects differ from frame to frame, and the surface that tells which are the \
                      same is not known yet; import it again when the scene has a surface, or give an objects.json";
        Self::new(folder, reason)
    }
}

/// Label images as they were read, with the ids that they have in their files.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelImages {
    /// The images.
    pub labels: ImportedLabels,
    /// What `classes.json` and `objects.json` say of the ids; ids without an entry are what they are in the project.
    pub classes: Vec<Class>,
    /// The objects that they show, with the ids of their files; none where each frame has numbers of its own.
    pub objects: Vec<Object>,
    /// Files of the folder that could be label images and are named like no frame; they were left out.
    pub unmatched: usize,
}

/// Images that bring neither classes nor objects along.
impl From<ImportedLabels> for LabelImages {
    fn from(labels: ImportedLabels) -> Self {
        Self {
            labels,
            classes: Vec::new(),
            objects: Vec::new(),
            unmatched: 0,
        }
    }
}

impl LabelImages {
    /// Whether the images tell objects apart by numbers that mean something else in every frame. These are of no use
    /// before they are [united](crate::semantics::united) over a surface.
    pub fn is_by_frame(&self) -> bool {
        self.objects.is_empty() && !self.labels.objects().is_empty()
    }
}

/// Reads what a folder says of a scene's frames, a file for each, named by the frame's stem:
///
/// - `STEM.png`: class ids in one gray channel or as the indices of a palette, or colours of classes; 1 to 16 bit.
/// - `STEM.npy`, or `STEM.npz` with one array: float16, float32 or float64 probabilities, `[classes, height, width]`
///   or `[height, width, classes]`.
///
/// An image has the frame's size on disk, or another of the same aspect. Where it is smaller, each of its pixels speaks
/// for the frame's pixel in its middle; what is between them follows from the scene. Of probabilities the four likeliest
/// classes of each pixel are kept, or the likeliest alone where `trust` is right.
///
/// A folder that has none of its own but a folder `labels`, as an export has, stands for that one. `classes.json` (a
/// list of `{"id", "name", "color"}`) beside the files or one folder up names the ids, says which class has a colour,
/// and in which order the probabilities are; without it, colours are those of the `known` classes, and probabilities
/// those of the ids from 1 on.
///
/// Where `objects.json` (a list of `{"id", "class_id", "class_name", "thing", "name"}`) lies beside a folder `objects`, as
/// in an export, its PNGs are numbers of objects, the same in all frames. So they are in a folder with its own
/// `objects.json`. A pixel has the class of its object, and otherwise that of the label image, if there is one. Beside label
/// images, a folder `objects` or `semantic_instance` without `objects.json` tells the things of each frame apart by numbers
/// of its own.
///
/// # Errors
/// A folder without files of the scene's frames, a file, `classes.json` or `objects.json` that cannot be used: a sentence
/// that names it.
pub fn read_label_images(
    folder: &Path,
    scene: &Scene,
    known: &[Class],
    trust: Trust,
) -> Result<LabelImages, ImportError> {
    let mut files = Files::find(folder)?;
    let found = files.labels.len() + files.objects.len();
    let mut of_frames = Vec::new();
    for (index, frame) in scene.frames.iter().enumerate() {
        let [labels, objects] =
            [&mut files.labels, &mut files.objects].map(|files| files.remove(&frame.stem));
        let of_frame = FrameFiles {
            labels: labels.map(the_only).transpose()?,
            objects: objects.map(the_only).transpose()?,
        };
        if of_frame != FrameFiles::default() {
            of_frames.push((index, of_frame));
        }
    }
    if of_frames.is_empty() {
        let example = scene.frames.first().map_or("", |frame| frame.stem.as_str());
        let reason = if found == 0 {
            "has no label images; give a folder with a PNG, NPY or NPZ for each frame".to_owned()
        } else {
            format!(
                "has no label image that is named like a frame of {}; name them as the frames are, such as \
                 {example}.png",
                scene.source
            )
        };
        return Err(ImportError::new(&files.folder, reason));
    }
    let listed = ClassList::find(&files.folder)?;
    let mut classes = listed.as_ref().map_or_else(Vec::new, |list| list.classes.clone());
    let list = files.list.as_deref();
    let list = list.map(|path| ObjectList::read(path, &mut classes, known));
    let list = list.transpose()?;
    let meaning = Meaning::new(listed, known);
    let arrays = of_frames.iter().filter_map(|(_, own)| own.labels.as_deref());
    let reading = Reading {
        meaning: &meaning,
        objects: list.as_ref(),
        trust,
        most_cells: MOST_CELLS / arrays.filter(|path| is_array(path)).count().max(1),
    };
    let maps: Result<Vec<ImportedMap>, ImportError> = of_frames
        .par_iter()
        .map(|(index, own)| reading.frame(own, *index, &scene.frames[*index]))
        .collect();
    let maps = maps?;
    let said: BTreeSet<ClassId> = maps.iter().flat_map(ImportedMap::likeliest_classes).collect();
    if said.is_empty() {
        let reason =
            "all label images of the scene's frames are void everywhere; void is 0, classes are from 1 on";
        return Err(ImportError::new(&files.folder, reason));
    }
    // A network has a probability for every class that it knows, most of which are nowhere in the scene.
    let labels = ImportedLabels { maps, trust };
    let labels = labels.relabelled(|label| {
        if said.contains(&label.class) {
            label
        } else {
            VOID.into()
        }
    });
    let shown = labels.objects();
    let mut objects = list.map_or_else(Vec::new, |list| list.objects);
    objects.retain(|object| shown.contains(&object.id));
    Ok(LabelImages {
        labels,
        classes,
        objects,
        unmatched: files
            .labels
            .into_values()
            .chain(files.objects.into_values())
            .map(|own| own.len())
            .sum(),
    })
}

/// The files that [`read_label_images`] may read, whatever the frames are named: label images in the order of their names,
/// then the list of classes.
///
/// # Errors
/// A folder that cannot be read.
pub fn label_image_files(folder: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let files = Files::find(folder)?;
    let classes = ClassList::path(&files.folder);
    let images = files.labels.into_values().chain(files.objects.into_values());
    Ok(images.flatten().chain(classes).chain(files.list).collect())
}

/// Why a file or folder is of no use, and what to do: part of a sentence.
fn unreadable(error: std::io::Error) -> String {
    format!("cannot be read ({error}); check that it is there and that you may read it")
}

/// The file of a frame among those that are named like it.
fn the_only(mut paths: Vec<PathBuf>) -> Result<PathBuf, ImportError> {
    let path = paths.swap_remove(0);
    let Some(other) = paths.pop() else {
        return Ok(path);
    };
    let name = other.file_name().unwrap_or_default().to_string_lossy();
    let reason = format!("is there beside {name}; leave one of them for each frame");
    Err(ImportError::new(&path, reason))
}

fn is_array(path: &Path) -> bool {
    let is = |wanted: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
    is("npy") || is("npz")
}

/// Files that may be label images, by their stem, sorted.
type LabelFiles = BTreeMap<String, Vec<PathBuf>>;

/// The files of an import.
struct Files {
    /// The folder that the class images are in, or else the object images.
    folder: PathBuf,
    labels: LabelFiles,
    objects: LabelFiles,
    /// `objects.json`, where there are object images.
    list: Option<PathBuf>,
}

impl Files {
    fn find(folder: &Path) -> Result<Self, ImportError> {
        // So that "." has a name, and a folder above it.
        let folder = &std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let list = |folder: &Path| Some(folder.join("objects.json")).filter(|path| path.is_file());
        let inner = |names: &[&str]| {
            let mut places = names.iter().map(|name| folder.join(name));
            places.find(|place| place.is_dir())
        };
        let own = label_files(folder)?;
        if !own.is_empty() {
            let name = folder.file_name().unwrap_or_default();
            let is_of_objects = OBJECTS.iter().any(|objects| name == *objects);
            let above = folder.parent().filter(|_| is_of_objects).and_then(list);
            let list = list(folder).or(above);
            let (objects, labels) = match list {
                Some(_) => (own, LabelFiles::new()),
                None => (LabelFiles::new(), own),
            };
            return Ok(Self {
                folder: folder.to_path_buf(),
                labels,
                objects,
                list,
            });
        }
        let (labels, list) = (inner(&LABELS), list(folder));
        let objects = inner(&OBJECTS).filter(|_| list.is_some() || labels.is_some());
        let files = |place: &Option<PathBuf>| {
            place
                .as_deref()
                .map_or_else(|| Ok(LabelFiles::new()), label_files)
        };
        Ok(Self {
            labels: files(&labels)?,
            objects: files(&objects)?,
            list: list.filter(|_| objects.is_some()),
            folder: labels.or(objects).unwrap_or_else(|| folder.to_path_buf()),
        })
    }
}

/// The files of a frame: at least one of them.
#[derive(Default, PartialEq)]
struct FrameFiles {
    labels: Option<PathBuf>,
    objects: Option<PathBuf>,
}

fn label_files(folder: &Path) -> Result<LabelFiles, ImportError> {
    let unreadable = |error| ImportError::new(folder, unreadable(error));
    let mut files = LabelFiles::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        if let Some(stem) = stem
            && (is_png || is_array(&path))
        {
            files.entry(of_frame(&stem)).or_default().push(path);
        }
    }
    files.values_mut().for_each(|paths| paths.sort_unstable());
    Ok(files)
}

/// The stem of the frame that a file with this stem is of: in the Replica layout `rgb_12` for `semantic_class_12`.
fn of_frame(stem: &str) -> String {
    let prefixes = ["semantic_class_", "semantic_instance_"];
    match prefixes.iter().find_map(|prefix| stem.strip_prefix(prefix)) {
        Some(number) => format!("rgb_{number}"),
        None => stem.to_owned(),
    }
}

/// `classes.json` beside the files or one folder up.
struct ClassList {
    classes: Vec<Class>,
    /// The ids as they are listed, void among them where it is.
    order: Vec<ClassId>,
}

impl ClassList {
    /// `None` where there is no such file.
    fn path(folder: &Path) -> Option<PathBuf> {
        let above = folder.parent().map(|parent| parent.join("classes.json"));
        let path = [Some(folder.join("classes.json")), above];
        path.into_iter().flatten().find(|path| path.is_file())
    }

    /// `None` where there is no such file.
    fn find(folder: &Path) -> Result<Option<Self>, ImportError> {
        let Some(path) = Self::path(folder) else {
            return Ok(None);
        };
        let mut classes = parsed(&path, parse_with_void)?;
        let order = classes.iter().map(|class| class.id).collect();
        classes.retain(|class| class.id != VOID);
        Ok(Some(Self { classes, order }))
    }
}

/// What ids, colours and channels of a folder's files stand for.
struct Meaning {
    listed: Option<ClassList>,
    ids: BTreeSet<ClassId>,
    /// The class of each colour, 16 bits a channel; `None` where several have it.
    colors: FxHashMap<[u16; 3], Option<ClassId>>,
}

impl Meaning {
    fn new(listed: Option<ClassList>, known: &[Class]) -> Self {
        let with_colors = listed.as_ref().map_or(known, |list| list.classes.as_slice());
        let mut colors = FxHashMap::default();
        for class in with_colors {
            let color = class.color.map(|channel| 257 * u16::from(channel));
            let one = colors.entry(color).or_insert(Some(class.id));
            if *one != Some(class.id) {
                *one = None;
            }
        }
        colors.entry([0; 3]).or_insert(Some(VOID));
        let ids = with_colors.iter().chain(known).map(|class| class.id).collect();
        Self { listed, ids, colors }
    }
}

/// Everything that reading the files of a frame needs.
struct Reading<'a> {
    meaning: &'a Meaning,
    /// What the numbers in object images stand for; without it, they are those of each frame.
    objects: Option<&'a ObjectList>,
    trust: Trust,
    /// Cells with probabilities that a frame may have.
    most_cells: usize,
}

impl Reading<'_> {
    fn frame(&self, files: &FrameFiles, index: usize, frame: &Frame) -> Result<ImportedMap, ImportError> {
        let said = files.labels.as_deref().map(|path| self.file(path, index, frame));
        let said = said.unwrap_or_else(|| Ok(ImportedMap::new(index, &vec![VOID; frame.camera.pixels()])))?;
        let Some(path) = &files.objects else {
            return Ok(said);
        };
        let (size, numbers) = image(path, frame, LabelImage::numbers)?;
        let label = |(&number, &class): (&u16, &ClassId)| match (number, self.objects) {
            (0, _) | (_, None) => Ok(Label::new(class, ObjectId::new(number).filter(|_| class != VOID))),
            (_, Some(list)) => list.label(number).ok_or_else(|| {
                let reason = format!("has the number {number}, which objects.json does not list");
                ImportError::new(path, reason)
            }),
        };
        let numbers = in_frame(frame, size, &numbers);
        let labels: Result<Vec<Label>, ImportError> = numbers.iter().zip(&said.labels()).map(label).collect();
        Ok(ImportedMap::with_objects(index, &labels?))
    }

    fn file(&self, path: &Path, index: usize, frame: &Frame) -> Result<ImportedMap, ImportError> {
        if is_array(path) {
            return self
                .array(path, index, frame)
                .map_err(|error| ImportError::new(path, error));
        }
        let (size, labels) = image(path, frame, |image| image.classes(self.meaning))?;
        Ok(ImportedMap::new(index, &in_frame(frame, size, &labels)))
    }

    fn array(&self, path: &Path, index: usize, frame: &Frame) -> Result<ImportedMap, String> {
        let array = Array::read(path, frame, self.meaning.listed.as_ref())?;
        if !self.trust.is_right() {
            let kept = array.on_grid(frame, self.most_cells)?;
            return Ok(ImportedMap::of_probabilities(index, kept));
        }
        Ok(ImportedMap::new(
            index,
            &in_frame(frame, array.size(), &array.labels()?),
        ))
    }
}

/// The size of a PNG that has the aspect of its frame, and what is read of its pixels.
fn image(
    path: &Path,
    frame: &Frame,
    read: impl FnOnce(&LabelImage) -> Result<Vec<u16>, String>,
) -> Result<([u32; 2], Vec<u16>), ImportError> {
    let bytes = fs::read(path).map_err(|error| ImportError::new(path, unreadable(error)))?;
    let image = LabelImage::decode(&bytes).map_err(|error| ImportError::new(path, error))?;
    let size = [frame.image().width, frame.image().height];
    if !has_proportions(image.size, size) {
        return Err(ImportError::new(
            path,
            format!(
                "is {}x{} pixels and its frame {}x{}; give it the size of the frame, or its aspect",
                image.size[0], image.size[1], size[0], size[1]
            ),
        ));
    }
    let values = read(&image).map_err(|error| ImportError::new(path, error))?;
    Ok((image.size, values))
}

/// Labels of an image of this width and height in the frame's own pixels, both row-major. Pixels that the image does not
/// reach or that are hidden are void, and where the image is smaller, those that are in the middle of none of its own.
pub fn in_frame(frame: &Frame, size: [u32; 2], labels: &[ClassId]) -> Vec<ClassId> {
    let (own, image) = (&frame.camera, frame.image());
    let on_disk = [image.width, image.height];
    let at = |pixel: u32| {
        let Some(place) = frame.to_image([pixel % own.width, pixel / own.width]) else {
            return VOID;
        };
        let [column, row] = [0, 1].map(|axis| sampled(place[axis], on_disk[axis], size[axis]));
        let middle = [
            sampled(column, size[0], on_disk[0]),
            sampled(row, size[1], on_disk[1]),
        ];
        if middle == place {
            labels[(row * size[0] + column) as usize]
        } else {
            VOID
        }
    };
    let mut placed: Vec<ClassId> = (0..own.pixels() as u32).map(at).collect();
    for pixel in frame.hidden_pixels() {
        placed[pixel] = VOID;
    }
    placed
}

/// Reads `classes.json`, a list of `{"id", "name", "color"}`; void is left out, and a class without a colour gets one.
///
/// # Errors
/// A file that cannot be used: a sentence that names it.
pub fn read_class_list(path: &Path) -> Result<Vec<Class>, ImportError> {
    parsed(path, parse_class_list)
}

/// What `parse` finds in the text of a class list.
fn parsed<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, String>) -> Result<T, ImportError> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string());
    text.and_then(|text| parse(&text)).map_err(|error| {
        let expected = "it must hold [{\"id\": 1, \"name\": \"wall\"}, ...]";
        ImportError::new(path, format!("cannot be used: {error}; {expected}"))
    })
}

#[cfg(test)]
mod tests;
