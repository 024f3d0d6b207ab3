//! Reading label images from elsewhere: a folder of PNGs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::palette::parse_class_list;
use super::{Class, ClassId, ImportedLabels, ImportedMap, Trust, VOID, png};
use crate::scene::{Frame, Scene};

/// Label images that cannot be used; nothing of them is taken over.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", .path.display())]
pub struct ImportError {
    path: PathBuf,
    reason: String,
}

impl ImportError {
    fn new(path: &Path, reason: impl Into<String>) -> Self {
        Self {
            path: path.to_path_buf(),
            reason: reason.into(),
        }
    }
}

/// Label images as they were read, with the ids that they have in their files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelImages {
    /// The images.
    pub labels: ImportedLabels,
    /// What `classes.json` beside them says of the ids; ids without an entry are what they are in the project.
    pub classes: Vec<Class>,
    /// PNGs of the folder that are named like no frame, and were left out.
    pub unmatched: usize,
}

/// Reads the label images `<stem>.png` of a scene's frames: one gray channel of class ids, 8 or 16 bit, as large
/// as the frame's image on disk. A folder that has none of its own but a folder `labels`, as an export has, stands
/// for that one. `classes.json` (a list of `{"id", "name", "color"}`) beside the images or one folder up names the
/// ids.
///
/// # Errors
/// A folder without images of the scene's frames, an image or `classes.json` that cannot be used: a sentence that
/// names it.
pub fn read_label_images(folder: &Path, scene: &Scene, trust: Trust) -> Result<LabelImages, ImportError> {
    let mut folder = folder.to_path_buf();
    let mut images = png_files(&folder)?;
    let inner = folder.join("labels");
    if images.is_empty() && inner.is_dir() {
        images = png_files(&inner)?;
        folder = inner;
    }
    let found = images.len();
    let of_frames: Vec<(usize, PathBuf)> = scene
        .frames
        .iter()
        .enumerate()
        .filter_map(|(index, frame)| Some((index, images.remove(&frame.stem)?)))
        .collect();
    if of_frames.is_empty() {
        let example = scene.frames.first().map_or("", |frame| frame.stem.as_str());
        let reason = if found == 0 {
            "has no PNGs; give a folder with a label image for each frame".to_owned()
        } else {
            format!(
                "has no PNG that is named like a frame of {}; name them as the frames are, such as {example}.png",
                scene.source
            )
        };
        return Err(ImportError::new(&folder, reason));
    }
    let maps: Result<Vec<ImportedMap>, ImportError> = of_frames
        .par_iter()
        .map(|(index, path)| read_image(path, *index, &scene.frames[*index]))
        .collect();
    let labels = ImportedLabels { maps: maps?, trust };
    if labels.classes().is_empty() {
        let reason =
            "all label images of the scene's frames are void everywhere; void is 0, classes are from 1 on";
        return Err(ImportError::new(&folder, reason));
    }
    Ok(LabelImages {
        labels,
        classes: read_classes(&folder)?,
        unmatched: images.len(),
    })
}

/// The PNGs of a folder by their stem.
fn png_files(folder: &Path) -> Result<BTreeMap<String, PathBuf>, ImportError> {
    let unreadable = |error: std::io::Error| ImportError::new(folder, format!("cannot be read: {error}"));
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        if let Some(stem) = stem
            && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
        {
            files.insert(stem, path);
        }
    }
    Ok(files)
}

fn read_image(path: &Path, index: usize, frame: &Frame) -> Result<ImportedMap, ImportError> {
    let bytes = fs::read(path).map_err(|error| ImportError::new(path, format!("cannot be read: {error}")))?;
    let (width, height, labels) = png::decode_gray(&bytes)
        .map_err(|reason| ImportError::new(path, format!("is no label image: {reason}")))?;
    let size = (frame.image().width, frame.image().height);
    if (width, height) != size {
        return Err(ImportError::new(
            path,
            format!(
                "is {width}x{height} pixels and its frame {}x{}; both must have one size",
                size.0, size.1
            ),
        ));
    }
    Ok(ImportedMap::new(index, &in_frame(frame, &labels)))
}

/// The labels of the frame's image on disk in the frame's own pixels, both row-major: the same where no lens
/// bends lines. Pixels that the image does not reach or that are hidden are void.
pub fn in_frame(frame: &Frame, image: &[ClassId]) -> Vec<ClassId> {
    let (own, width) = (&frame.camera, frame.image().width);
    let at = |index: u32| {
        let place = frame.to_image([index % own.width, index / own.width]);
        place.map_or(VOID, |[x, y]| image[(y * width + x) as usize])
    };
    let mut labels: Vec<ClassId> = (0..own.pixels() as u32).map(at).collect();
    for pixel in frame.hidden_pixels() {
        labels[pixel] = VOID;
    }
    labels
}

/// The classes of `classes.json` beside the images or one folder up; none where there is no such file.
fn read_classes(folder: &Path) -> Result<Vec<Class>, ImportError> {
    let above = folder.parent().map(|parent| parent.join("classes.json"));
    let path = [Some(folder.join("classes.json")), above];
    let Some(path) = path.into_iter().flatten().find(|path| path.is_file()) else {
        return Ok(Vec::new());
    };
    read_class_list(&path)
}

/// Reads `classes.json`, a list of `{"id", "name", "color"}`; void is left out, and a class without a colour gets one.
///
/// # Errors
/// A file that cannot be used: a sentence that names it.
pub fn read_class_list(path: &Path) -> Result<Vec<Class>, ImportError> {
    let unusable = |reason: String| {
        let expected = "it must hold [{\"id\": 1, \"name\": \"wall\"}, ...]";
        ImportError::new(path, format!("cannot be used: {reason}; {expected}"))
    };
    let text = fs::read_to_string(path).map_err(|error| unusable(error.to_string()))?;
    parse_class_list(&text).map_err(unusable)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{History, Stroke};
    use crate::scene::testing::{hide, wall};
    use crate::scene::{Distortion, Lens};

    fn write(folder: &Path, name: &str, width: u32, labels: &[ClassId]) {
        let png = png::encode_labels(width, labels.len() as u32 / width, labels).unwrap();
        fs::write(folder.join(name), png).unwrap();
    }

    fn read(folder: &Path, scene: &Scene) -> Result<LabelImages, String> {
        read_label_images(folder, scene, Trust::Votes).map_err(|error| error.to_string())
    }

    #[test]
    fn images_are_found_by_stem_and_ids_become_classes_by_name_number_and_palette() {
        let scene = wall(3, 8, 6);
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("labels");
        fs::create_dir(&folder).unwrap();
        let mut labels = vec![0; 48];
        labels[..5].copy_from_slice(&[1, 2, 3, 300, 300]);
        write(&folder, &format!("{}.png", scene.frames[2].stem), 8, &labels);
        write(&folder, "legend.png", 3, &[1, 2, 3]);
        let classes = r#"[{"id": 1, "name": "Floor"}, {"id": 2, "name": "door", "color": [1, 2, 3]}]"#;
        fs::write(root.path().join("classes.json"), classes).unwrap();
        // The folder above stands for the one with the images, as an export does.
        let found = read(root.path(), &scene).unwrap();
        assert_eq!(found, read(&folder, &scene).unwrap());
        assert_eq!((found.labels.maps.len(), found.unmatched), (1, 1));
        assert_eq!(found.labels.maps[0].labels(), labels);

        let mut history = History::default();
        history.add_class("wall");
        history.add_class("floor");
        history.add_stroke(Stroke::click(0, 1, [0, 0]));
        history.import(found);
        let now = history.labels();
        let named: Vec<(ClassId, &str)> = now.classes.iter().map(|c| (c.id, c.name.as_str())).collect();
        // Floor is 2 here, so that the images' door, 2 there, gets an id of its own.
        assert_eq!(
            named,
            [
                (1, "wall"),
                (2, "floor"),
                (3, "class 3"),
                (300, "class 300"),
                (301, "door")
            ]
        );
        assert_eq!(now.class(301).unwrap().color, [1, 2, 3]);
        let imported = now.imported.as_ref().unwrap();
        assert_eq!(imported.maps[0].labels()[..5], [2, 301, 3, 300, 300]);
    }

    #[test]
    fn what_cannot_be_used_is_one_sentence_that_names_it() {
        let scene = wall(2, 8, 6);
        let root = tempfile::tempdir().unwrap();
        let refused = |part: &str, word: &str| {
            let error = read(root.path(), &scene).unwrap_err();
            assert!(error.contains(part) && error.contains(word), "{error}");
            assert!(!error.contains('\n'), "{error}");
        };
        assert!(
            read(&root.path().join("nowhere"), &scene)
                .unwrap_err()
                .contains("nowhere")
        );
        refused("", "has no PNGs");
        write(root.path(), "other.png", 8, &[1; 48]);
        refused("", "named like a frame");
        let stem = scene.frames[0].stem.clone();
        let name = format!("{stem}.png");
        write(root.path(), &name, 8, &[0; 48]);
        refused("", "void everywhere");
        write(root.path(), &name, 8, &[1; 40]);
        refused(&name, "8x5");
        fs::write(root.path().join(&name), "no image").unwrap();
        refused(&name, "is no label image");
        fs::write(root.path().join(&name), png::encode_rgb(8, 6, &[9; 144]).unwrap()).unwrap();
        refused(&name, "colour");
        write(root.path(), &name, 8, &[1; 48]);
        for classes in ["[1]", r#"[{"id": 1, "name": "a"}, {"id": 1, "name": "b"}]"#] {
            fs::write(root.path().join("classes.json"), classes).unwrap();
            refused("classes.json", "cannot be used");
        }
    }

    #[test]
    fn hidden_pixels_are_void_whatever_the_image_says() {
        let mut frame = wall(1, 8, 6).frames.remove(0);
        hide(&mut frame, |index| index % 8 < 3);
        for (index, class) in in_frame(&frame, &[7; 48]).into_iter().enumerate() {
            assert_eq!(class, if index % 8 < 3 { VOID } else { 7 });
        }
    }

    #[test]
    fn images_of_bent_frames_are_straightened() {
        let mut scene = wall(1, 64, 48);
        let frame = &mut scene.frames[0];
        let lens = Lens {
            image: frame.camera,
            distortion: Distortion {
                k1: -0.1,
                ..Distortion::default()
            },
        };
        frame.camera = lens.pinhole().unwrap();
        frame.lens = Some(lens);
        let root = tempfile::tempdir().unwrap();
        let mut labels = vec![2; 64 * 48];
        (0..48).for_each(|y| labels[y * 64..y * 64 + 32].fill(1));
        write(root.path(), &format!("{}.png", frame.stem), 64, &labels);
        let found = read(root.path(), &scene).unwrap();
        let frame = &scene.frames[0];
        let own = found.labels.maps[0].labels();
        assert_eq!(own.len(), frame.camera.pixels());
        let at = |[x, y]: [u32; 2]| own[(y * frame.camera.width + x) as usize];
        assert_eq!(at(frame.of_image([10, 40]).unwrap()), 1);
        assert_eq!(at(frame.of_image([50, 5]).unwrap()), 2);
    }
}
