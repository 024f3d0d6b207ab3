//! Ground truth of captures in the Replica layout: label images, the frames to train and test on, and both of an open
//! scene, frame by frame.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::metrics::Borders;
use super::{ConfusionMatrix, Failure, Scores, unusable_file, unusable_scene};
use crate::simulate::Click;
use inplace_core::labels::{self, Class, ClassId, Stroke, VOID, decode_gray, read_class_list, read_strokes};
use inplace_core::scene::demo::{self, Shot};
use inplace_core::scene::{Frame, Scene, SceneSource, frame_number, label_images, numbered_images};
use inplace_core::semantics::FrameMap;
use inplace_core::session::Client;

/// Class ids of one image, row-major `[height, width]`; 0 = void.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The class of every pixel.
    pub labels: Vec<ClassId>,
}

impl LabelImage {
    /// An image of this width and height in pixels.
    pub fn new([width, height]: [u32; 2], labels: Vec<ClassId>) -> Self {
        Self {
            width,
            height,
            labels,
        }
    }

    /// Reads the one of a frame with this stem, of a capture with [`label_images`]; `None` when it has none.
    ///
    /// # Errors
    /// An image that cannot be read, or that is not one gray channel of ids.
    pub fn read(images: &BTreeMap<usize, PathBuf>, stem: &str) -> Result<Option<Self>, Failure> {
        let Some(path) = frame_number(stem).and_then(|number| images.get(&number)) else {
            return Ok(None);
        };
        let unusable = |reason: String| unusable_file(path, format!("is no label image: {reason}"));
        let bytes = fs::read(path).map_err(|error| unusable(error.to_string()))?;
        let (width, height, labels) = decode_gray(&bytes).map_err(|error| unusable(error.to_string()))?;
        Ok(Some(Self::new([width, height], labels)))
    }
}

/// Frame numbers to take labels from and to measure on: `split.json`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Split {
    /// Frames that labels may be taken from.
    pub train: Vec<usize>,
    /// Frames that are only measured on.
    pub test: Vec<usize>,
}

impl Split {
    /// Reads `split.json` of a capture's folder.
    ///
    /// # Errors
    /// A missing or unusable file, or a frame that is in both lists.
    pub fn read(scene: &Path) -> Result<Self, Failure> {
        let path = scene.join("split.json");
        let split: Self = read_json(&path, "{\"train\": [frame numbers], \"test\": [...]}")?;
        match split.test.iter().find(|number| split.train.contains(number)) {
            Some(both) => Err(unusable_file(
                &path,
                format!("frame {both} is both for training and for testing; take it out of one list"),
            )),
            None => Ok(split),
        }
    }
}

/// Reads a JSON file of the ground truth, which must hold what `expected` says.
pub(super) fn read_json<T: DeserializeOwned>(path: &Path, expected: &str) -> Result<T, Failure> {
    let unusable =
        |reason: String| unusable_file(path, format!("cannot be used: {reason}; it must hold {expected}"));
    let text = fs::read_to_string(path).map_err(|error| unusable(error.to_string()))?;
    serde_json::from_str(&text).map_err(|error| unusable(error.to_string()))
}

/// A capture's own clicks, beside its images, and the folder of label images that were made by hand and only measure.
const CLICKS: &str = "clicks.json";
const BY_HAND: &str = "hand_labels";
/// What to do without label images.
const OTHER: &str = "measure on a capture that has them";
/// The file that lists a capture's classes.
const CLASSES: &str = "classes.json";

/// The label images of a scene's frames, and which of them labels may be taken from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneTruth {
    /// The label image of each frame that has one, in pixels of the frame's image on disk; by index of the frame.
    pub images: BTreeMap<usize, LabelImage>,
    /// Indices of the frames that labels may be taken from, ascending; all of them have a label image.
    pub train: Vec<usize>,
    /// Indices of the frames that are only measured on, ascending; all of them have a label image.
    pub test: Vec<usize>,
    /// The classes that the capture lists: what an annotator calls them tells things from stuff.
    pub listed: Vec<Class>,
    /// The clicks that a capture brings along whose training frames have no label images.
    pub clicks: Vec<Click>,
}

impl SceneTruth {
    /// Reads the label images and the split of a scene's folder; the demo has its own.
    ///
    /// # Errors
    /// A scene without ground truth for training or for testing, and unusable files.
    pub fn read(scene: &Scene) -> Result<Self, Failure> {
        let truth = Self::read_or_clicks(scene)?;
        if truth.train.is_empty() {
            return Err(without(scene, "train", OTHER));
        }
        Ok(truth)
    }

    /// The same; of a capture whose training frames have no label images, its own clicks in their place.
    ///
    /// # Errors
    /// A scene without ground truth for testing, or with neither for training; unusable files.
    pub fn read_or_clicks(scene: &Scene) -> Result<Self, Failure> {
        let mut truth = match &scene.source {
            SceneSource::Demo => Self::of_demo(scene),
            SceneSource::Folder(folder) => {
                let by_hand = folder.join(BY_HAND);
                let (files, split) = if by_hand.is_dir() {
                    let files = numbered_images(&by_hand)?;
                    let (train, test) = (Vec::new(), files.keys().copied().collect());
                    (files, Split { train, test })
                } else {
                    (label_images(folder)?, Split::read(folder)?)
                };
                let classes = folder.join(CLASSES);
                let listed = classes.is_file().then(|| read_class_list(&classes));
                let listed = listed.transpose()?.unwrap_or_default();
                let mut images = BTreeMap::new();
                for (index, frame) in scene.frames.iter().enumerate() {
                    let Some(image) = LabelImage::read(&files, &frame.stem)? else {
                        continue;
                    };
                    let (own, size) = ((image.width, image.height), frame.image());
                    if own != (size.width, size.height) {
                        let reason = format!(
                            "the label image of frame \"{}\" is {}x{} and the frame {}x{}; both must have one size",
                            frame.stem, own.0, own.1, size.width, size.height
                        );
                        return Err(unusable_scene(scene, reason));
                    }
                    images.insert(index, image);
                }
                let among = |numbers: &[usize]| -> Vec<usize> {
                    let chosen: BTreeSet<usize> = numbers.iter().copied().collect();
                    let own = |index: &usize| frame_number(&scene.frames[*index].stem);
                    let in_split = |index: &usize| own(index).is_some_and(|number| chosen.contains(&number));
                    images.keys().copied().filter(in_split).collect()
                };
                Self {
                    train: among(&split.train),
                    test: among(&split.test),
                    images,
                    listed,
                    clicks: Vec::new(),
                }
            }
        };
        if truth.test.is_empty() {
            return Err(without(scene, "test", OTHER));
        }
        if truth.train.is_empty()
            && let SceneSource::Folder(folder) = &scene.source
        {
            let path = folder.join(CLICKS);
            if !path.is_file() {
                return Err(without(scene, "train", &format!("add {CLICKS}, or {OTHER}")));
            }
            let labels = read_strokes(&path, scene)?;
            let strokes = labels.strokes.into_values();
            let click = |stroke: Arc<Stroke>| {
                let (frame, class) = (stroke.frame, stroke.class);
                let pixel = stroke.first_point()?;
                Some(Click { frame, pixel, class })
            };
            truth.clicks = strokes.filter_map(click).collect();
            truth.listed = labels.classes;
        }
        Ok(truth)
    }

    fn of_demo(scene: &Scene) -> Self {
        let held_out = |frame: &usize| Shot::default().held_out().contains(frame);
        let (test, train) = (0..scene.frames.len()).partition(held_out);
        let frames = scene.frames.iter().zip(Shot::default().ground_truth());
        let image = |(frame, labels): (&Frame, Vec<ClassId>)| {
            LabelImage::new([frame.image().width, frame.image().height], labels)
        };
        Self {
            images: frames.map(image).enumerate().collect(),
            train,
            test,
            listed: demo::classes(),
            clicks: Vec::new(),
        }
    }

    /// How good the test frames' maps are that a session has now; a frame without one is void all over.
    ///
    /// # Errors
    /// As [`scores`](Self::scores).
    pub fn scores_of(&self, client: &Client, scene: &Scene) -> Result<Scores, Failure> {
        // All at once, as the session goes on meanwhile.
        let map = |&frame: &usize| Some((frame, client.map(frame)?));
        let maps: BTreeMap<usize, Arc<FrameMap>> = self.test.iter().filter_map(map).collect();
        self.scores(&self.test, |frame| match maps.get(&frame) {
            Some(map) => map.in_image(&scene.frames[frame]).labels().into_owned(),
            None => vec![VOID; self.images[&frame].labels.len()],
        })
    }

    /// How good these maps of the test frames are, in their order and in the frames' own pixels.
    ///
    /// # Errors
    /// As [`scores`](Self::scores).
    pub fn scores_of_maps(&self, scene: &Scene, maps: Vec<Vec<ClassId>>) -> Result<Scores, Failure> {
        let mut maps = self.test.iter().zip(maps);
        self.scores(&self.test, |_| {
            let map = maps.next();
            map.map_or_else(Vec::new, |(&frame, labels)| in_image(scene, frame, labels))
        })
    }

    /// The classes that the training frames show, or its own clicks name, ascending.
    pub fn classes(&self) -> Vec<ClassId> {
        let shown = self.train.iter().flat_map(|frame| &self.images[frame].labels);
        let named = self.clicks.iter().map(|click| &click.class);
        let mut classes: BTreeSet<ClassId> = shown.chain(named).copied().collect();
        classes.remove(&VOID);
        classes.into_iter().collect()
    }

    /// The truth of a frame that has one, in the frame's own pixels, row-major.
    pub fn in_frame(&self, scene: &Scene, frame: usize) -> Vec<ClassId> {
        let image = &self.images[&frame];
        labels::in_frame(&scene.frames[frame], [image.width, image.height], &image.labels)
    }

    /// The scores of a label map for each of some frames, in pixels of their images on disk.
    ///
    /// # Errors
    /// Maps of another size, and frames in which there is nothing to measure.
    pub fn scores(
        &self,
        frames: &[usize],
        mut map: impl FnMut(usize) -> Vec<ClassId>,
    ) -> Result<Scores, Failure> {
        let (mut matrix, mut borders) = (ConfusionMatrix::default(), Borders::default());
        for frame in frames {
            let (truth, map) = (&self.images[frame], map(*frame));
            matrix.add(&truth.labels, &map)?;
            borders.add(&truth.labels, &map, truth.width as usize);
        }
        let scores = matrix.scores().map(|scores| Scores {
            boundary_miou: borders.miou(),
            ..scores
        });
        scores.ok_or_else(|| "ground truth: all pixels are void; measure on a capture with classes".into())
    }
}

/// None of the frames to train or to test on has a label image; `remedy` says what to do.
fn without(scene: &Scene, of: &str, remedy: &str) -> Failure {
    let is_by_hand = matches!(&scene.source, SceneSource::Folder(folder) if folder.join(BY_HAND).is_dir());
    let missing = match is_by_hand {
        true => format!("no frame has a label image in {BY_HAND} to {of} on"),
        false => format!("none of the \"{of}\" frames of split.json has a label image in semantic_class"),
    };
    unusable_scene(scene, format!("{missing}; {remedy}"))
}

/// A label map of a frame in the pixels of its image on disk.
pub(super) fn in_image(scene: &Scene, number: usize, labels: Vec<ClassId>) -> Vec<ClassId> {
    let frame = &scene.frames[number];
    let (size, sure) = ([frame.camera.width, frame.camera.height], vec![0; labels.len()]);
    match FrameMap::new(number, 0, size, labels, sure) {
        Some(map) => map.in_image(frame).labels().into_owned(),
        // Sizes that do not fit are an error where the map is measured.
        None => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{capture, opened};

    #[test]
    fn labels_are_taken_from_training_frames_and_measured_on_the_others() {
        let (_root, folder) = capture();
        let read = || SceneTruth::read(&opened(&folder));
        let truth = read().unwrap();
        assert_eq!(
            (truth.train.clone(), truth.test.clone()),
            (vec![0, 2, 4], vec![1, 3, 5])
        );
        assert_eq!(truth.classes(), [1, 2]);
        assert_eq!(truth.listed[1].name, "bright");
        let half = |frame: usize| [&truth.images[&frame].labels[..64 * 24], &[VOID; 64 * 24]].concat();
        assert_eq!(truth.scores(&truth.test, half).unwrap().total_accuracy, 0.5);

        for frame in [0, 2, 4] {
            fs::remove_file(folder.join(format!("semantic_class/semantic_class_{frame}.png"))).unwrap();
        }
        let error = read().unwrap_err().to_string();
        assert!(error.contains("\"train\"") && error.contains("wall"), "{error}");
        let by_hand = folder.join(BY_HAND);
        fs::rename(folder.join("semantic_class"), &by_hand).unwrap();
        let error = read().unwrap_err().to_string();
        let told = "no frame has a label image in hand_labels to train on; add clicks.json";
        assert!(error.contains(told), "{error}");
        fs::remove_dir_all(by_hand).unwrap();
        let error = read().unwrap_err().to_string();
        assert!(error.contains("no ground truth"), "{error}");
    }

    #[test]
    fn label_images_are_read_by_the_number_of_their_frame() {
        let (_root, folder) = capture();
        fs::write(folder.join("semantic_class/semantic_class_2.png"), "no image").unwrap();
        let files = label_images(&folder).unwrap();
        let read = |stem| LabelImage::read(&files, stem);
        let image = read("rgb_0005").unwrap().unwrap();
        assert_eq!((image.width, image.height), (64, 48));
        assert_eq!((image.labels[0], image.labels[63]), (1, 2));
        assert_eq!(read("rgb_6").unwrap(), None);
        let error = read("rgb_2").unwrap_err().to_string();
        assert!(
            error.contains("semantic_class_2.png: is no label image"),
            "{error}"
        );
    }

    #[test]
    fn a_split_is_read_and_a_frame_in_both_lists_is_refused() {
        let root = tempfile::tempdir().unwrap();
        let read = |text: &str| {
            fs::write(root.path().join("split.json"), text).unwrap();
            Split::read(root.path())
        };
        let split = read(r#"{"train": [1, 3], "test": [2], "unlabelled": [4]}"#).unwrap();
        assert_eq!((split.train, split.test), (vec![1, 3], vec![2]));
        for text in [r#"{"train": [1, 2], "test": [2]}"#, r#"{"train": [1]}"#, "[]"] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains("split.json"), "{error}");
        }
        fs::remove_file(root.path().join("split.json")).unwrap();
        assert!(Split::read(root.path()).is_err());
    }
}
