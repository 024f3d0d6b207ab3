//! Label, entropy and colour PNGs of every frame.

use std::collections::{HashMap, HashSet};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::{ExportError, prepare, write, write_classes};
use crate::labels::{Class, ClassId, png};
use crate::scene::{Frame, Scene};
use crate::session::FrameMap;

/// Writes `labels/<stem>.png`, `entropy/<stem>.png` and `color/<stem>.png` for every frame of the scene,
/// and `classes.json`. The same maps give the same bytes.
///
/// - labels: class ids, 8 bit, or 16 bit where an id of the frame exceeds 255
/// - entropy: 16 bit, nats times [`ENTROPY_STEPS_PER_NAT`](crate::session::ENTROPY_STEPS_PER_NAT)
/// - color: the classes' colours; void and ids without a class are black
///
/// Each PNG has the pixels of the frame's image on disk, distortion included.
///
/// `progress` is called with (frames written, frames in all), from any thread; when it answers
/// [`ControlFlow::Break`], no further frame is begun.
///
/// # Errors
/// [`ExportError::Incomplete`] unless `maps` holds exactly one map of the right size for every frame,
/// before anything is written; [`ExportError::Cancelled`]; [`ExportError::Unwritable`].
pub fn write_maps(
    folder: &Path,
    scene: &Scene,
    classes: &[Class],
    maps: &[Arc<FrameMap>],
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<(), ExportError> {
    check(scene, maps).map_err(|reason| ExportError::Incomplete {
        folder: folder.to_path_buf(),
        reason,
    })?;
    prepare(folder)?;
    let colors: HashMap<ClassId, [u8; 3]> = classes.iter().map(|class| (class.id, class.color)).collect();
    let (written, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    maps.par_iter().try_for_each(|map| {
        if stopped.load(Ordering::Relaxed) {
            return Ok(());
        }
        write_map(folder, &scene.frames[map.frame], map, &colors)?;
        let done = written.fetch_add(1, Ordering::Relaxed) + 1;
        if progress(done, maps.len()).is_break() {
            stopped.store(true, Ordering::Relaxed);
        }
        Ok(())
    })?;
    let written = written.into_inner();
    if written < maps.len() {
        return Err(ExportError::Cancelled {
            folder: folder.to_path_buf(),
            written,
            frames: maps.len(),
        });
    }
    write_classes(folder, classes)
}

/// Whether there is one map of the right size for every frame, and a file name for each.
fn check(scene: &Scene, maps: &[Arc<FrameMap>]) -> Result<(), String> {
    let mut has_map = vec![false; scene.frames.len()];
    for map in maps {
        let Some(frame) = scene.frames.get(map.frame) else {
            return Err(format!(
                "there is a map of frame {}, which {} does not have",
                map.frame, scene.source
            ));
        };
        if std::mem::replace(&mut has_map[map.frame], true) {
            return Err(format!("there are two maps of frame \"{}\"", frame.stem));
        }
        let size = [frame.camera.width, frame.camera.height];
        if [map.width, map.height] != size {
            return Err(format!(
                "the map of frame \"{}\" has another size than the frame",
                frame.stem
            ));
        }
    }
    if let Some(index) = has_map.iter().position(|&has| !has) {
        return Err(format!("frame \"{}\" has no map yet", scene.frames[index].stem));
    }
    let mut names = HashSet::new();
    match scene
        .frames
        .iter()
        .find(|frame| !names.insert(frame.stem.as_str()))
    {
        Some(frame) => Err(format!(
            "two frames are named \"{}\"; rename one of their images",
            frame.stem
        )),
        None => Ok(()),
    }
}

fn write_map(
    folder: &Path,
    frame: &Frame,
    map: &FrameMap,
    colors: &HashMap<ClassId, [u8; 3]>,
) -> Result<(), ExportError> {
    let map = &*map.in_image(frame);
    let (width, height) = (map.width, map.height);
    let labels = map.labels();
    let rgb: Vec<u8> = labels
        .iter()
        .flat_map(|label| colors.get(label).copied().unwrap_or_default())
        .collect();
    let images = [
        ("labels", png::encode_labels(width, height, &labels)),
        ("entropy", png::encode_steps(width, height, &map.entropy())),
        ("color", png::encode_rgb(width, height, &rgb)),
    ];
    for (name, image) in images {
        let path = folder.join(name).join(format!("{}.png", frame.stem));
        let bytes = image.map_err(|error| ExportError::unwritable(&path, std::io::Error::other(error)))?;
        write(&path, &bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::PathBuf;

    use glam::{Affine3A, DVec3};

    use super::*;
    use crate::scene::{Camera, ColorImage, SceneSource};

    fn scene(stems: &[&str]) -> Scene {
        let frame = |stem: &&str| Frame {
            stem: (*stem).to_owned(),
            path: PathBuf::new(),
            camera: Camera::with_horizontal_fov(3, 2, 90.0),
            camera_to_world: Affine3A::IDENTITY,
            color: ColorImage::new(3, 2, vec![0; 18]).unwrap(),
            depth: None,
            points: Vec::new(),
            lens: None,
        };
        Scene {
            source: SceneSource::Demo,
            format: "test",
            frames: stems.iter().map(frame).collect(),
            origin: DVec3::ZERO,
            unit: 1.0,
            point_errors: None,
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }

    fn map(frame: usize, labels: [ClassId; 6]) -> Arc<FrameMap> {
        let entropy = vec![0, 1, 9_999, 10_000, 27_080, 65_535];
        Arc::new(FrameMap::new(frame, 1, [3, 2], labels.to_vec(), entropy).unwrap())
    }

    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let mut found = BTreeMap::new();
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            if entry.path().is_dir() {
                let inner = files(&entry.path());
                found.extend(
                    inner
                        .into_iter()
                        .map(|(file, bytes)| (format!("{name}/{file}"), bytes)),
                );
            } else {
                found.insert(name, fs::read(entry.path()).unwrap());
            }
        }
        found
    }

    #[test]
    fn every_frame_comes_back_from_its_pngs_and_no_temporary_files_stay() {
        let root = tempfile::tempdir().unwrap();
        let (first, second) = ([0, 1, 255, 1, 1, 0], [0, 1, 256, 1, 1, 0]);
        let classes = [Class::new(1, "wall"), Class::new(256, "lamp")];
        let maps = [map(1, second), map(0, first)];
        let calls = AtomicUsize::new(0);
        let progress = |_, total| {
            assert_eq!(total, 2);
            calls.fetch_add(1, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        let scene = scene(&["rgb_0", "rgb_1"]);
        write_maps(root.path(), &scene, &classes, &maps, &progress).unwrap();
        assert_eq!(calls.into_inner(), 2);
        let written = files(root.path());
        let names: Vec<&str> = written.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "classes.json",
                "color/rgb_0.png",
                "color/rgb_1.png",
                "entropy/rgb_0.png",
                "entropy/rgb_1.png",
                "labels/rgb_0.png",
                "labels/rgb_1.png"
            ]
        );
        let labels = |name: &str| png::decode_gray(&written[name]).unwrap().2;
        assert_eq!(labels("labels/rgb_0.png"), first);
        assert_eq!(labels("labels/rgb_1.png"), second);
        assert_eq!(labels("entropy/rgb_0.png"), maps[0].entropy()[..]);
        let depth = |name: &str| written[name][24];
        assert_eq!([depth("labels/rgb_0.png"), depth("labels/rgb_1.png")], [8, 16]);
        let color = image::load_from_memory(&written["color/rgb_1.png"])
            .unwrap()
            .to_rgb8();
        assert_eq!(color.get_pixel(0, 0).0, [0, 0, 0]);
        assert_eq!(color.get_pixel(1, 0).0, classes[0].color);
        assert_eq!(color.get_pixel(2, 0).0, classes[1].color);
        let read: Vec<Class> = serde_json::from_slice(&written["classes.json"]).unwrap();
        assert_eq!(read, classes);

        let again = tempfile::tempdir().unwrap();
        write_maps(again.path(), &scene, &classes, &maps, &|_, _| {
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!(files(again.path()), written);
    }

    #[test]
    fn a_cancelled_export_says_how_far_it_came_and_its_files_are_whole() {
        let root = tempfile::tempdir().unwrap();
        let stems: Vec<String> = (0..60).map(|index| format!("rgb_{index}")).collect();
        let stems: Vec<&str> = stems.iter().map(String::as_str).collect();
        let maps: Vec<_> = (0..60).map(|frame| map(frame, [1; 6])).collect();
        let progress = |_, _| ControlFlow::Break(());
        let error = write_maps(root.path(), &scene(&stems), &[], &maps, &progress).unwrap_err();
        let ExportError::Cancelled { written, frames, .. } = error else {
            panic!("{error}");
        };
        // One for each thread at most.
        assert!(
            frames == 60 && (1..60).contains(&written),
            "{written} of {frames}"
        );
        let files = files(root.path());
        assert_eq!(files.len(), 3 * written);
        assert!(!files.contains_key("classes.json"));
        for (name, bytes) in files.iter().filter(|(name, _)| name.starts_with("labels/")) {
            assert_eq!(png::decode_gray(bytes).unwrap().2, [1; 6], "{name}");
        }
    }

    #[test]
    fn nothing_is_written_unless_there_is_one_map_for_every_frame() {
        let root = tempfile::tempdir().unwrap();
        let two = scene(&["rgb_0", "rgb_1"]);
        let labels = [1; 6];
        let mut small = FrameMap::clone(&map(1, labels));
        small.width = 2;
        for (scene, maps, reason) in [
            (&two, vec![map(0, labels)], "frame \"rgb_1\" has no map yet"),
            (
                &two,
                vec![map(0, labels), map(0, labels)],
                "two maps of frame \"rgb_0\"",
            ),
            (&two, vec![map(0, labels), map(7, labels)], "frame 7"),
            (&two, vec![map(0, labels), Arc::new(small)], "another size"),
            (
                &scene(&["same", "same"]),
                vec![map(0, labels), map(1, labels)],
                "two frames are named \"same\"",
            ),
        ] {
            let error = write_maps(root.path(), scene, &[], &maps, &|_, _| ControlFlow::Continue(()))
                .unwrap_err()
                .to_string();
            assert!(error.contains(reason), "{error}");
            assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
        }
    }
}
