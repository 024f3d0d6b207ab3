//! Ground truth of captures in the Replica layout: label images and the frames to train and test on.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::EvalError;
use crate::labels::{ClassId, png};

/// Folders of label images; the first that a capture has counts. The latter two are ScanNet's.
const FOLDERS: [&str; 3] = ["semantic_class", "label-filt", "label"];

/// Where the ground truth of a capture lies: `semantic_class/*N.png` for frame number N, or in `label-filt/` or `label/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroundTruth {
    images: BTreeMap<u64, PathBuf>,
}

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

impl GroundTruth {
    /// Looks for the label images of a capture's folder; reads none of them yet.
    ///
    /// # Errors
    /// A capture without label images, or with two of one frame number.
    pub fn find(scene: &Path) -> Result<Self, EvalError> {
        let places = FOLDERS.map(|name| scene.join(name));
        let folder = places.iter().find(|place| place.is_dir()).unwrap_or(&places[0]);
        let missing = |error: std::io::Error| {
            EvalError::file(
                folder,
                format!("no ground truth: {error}; measure on a capture that has label images"),
            )
        };
        let mut images: BTreeMap<u64, PathBuf> = BTreeMap::new();
        for entry in fs::read_dir(folder).map_err(missing)? {
            let path = entry.map_err(missing)?.path();
            let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let Some(number) = frame_number(&stem).filter(|_| is_png) else {
                continue;
            };
            if let Some(other) = images.insert(number, path.clone()) {
                return Err(EvalError::file(
                    path,
                    format!("is for frame {number}, and so is {}; remove one", other.display()),
                ));
            }
        }
        if images.is_empty() {
            return Err(EvalError::file(
                folder,
                "has no PNGs with a frame number at the end of their names; measure on a capture that has label images",
            ));
        }
        Ok(Self { images })
    }

    /// The frame numbers that have a label image, ascending.
    pub fn numbers(&self) -> impl Iterator<Item = u64> {
        self.images.keys().copied()
    }

    /// Reads the label image of the frame with this stem; `None` when it has none.
    ///
    /// # Errors
    /// An image that cannot be read, or that is not one gray channel of ids.
    pub fn read(&self, stem: &str) -> Result<Option<LabelImage>, EvalError> {
        let Some(path) = frame_number(stem).and_then(|number| self.images.get(&number)) else {
            return Ok(None);
        };
        let unusable = |reason: String| EvalError::file(path, format!("is no label image: {reason}"));
        let bytes = fs::read(path).map_err(|error| unusable(error.to_string()))?;
        let (width, height, labels) =
            png::decode_gray(&bytes).map_err(|error| unusable(error.to_string()))?;
        Ok(Some(LabelImage {
            width,
            height,
            labels,
        }))
    }
}

/// The number at the end of a frame's stem: 12 for `rgb_12`.
pub fn frame_number(stem: &str) -> Option<u64> {
    let rest = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    stem[rest.len()..].parse().ok()
}

/// Frame numbers to take labels from and to measure on: `split.json`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Split {
    /// Frames that labels may be taken from.
    pub train: Vec<u64>,
    /// Frames that are only measured on.
    pub test: Vec<u64>,
}

impl Split {
    /// Reads `split.json` of a capture's folder.
    ///
    /// # Errors
    /// A missing or unusable file, or a frame that is in both lists.
    pub fn read(scene: &Path) -> Result<Self, EvalError> {
        let path = scene.join("split.json");
        let expected = "it must hold {\"train\": [frame numbers], \"test\": [...]}";
        let text = fs::read_to_string(&path)
            .map_err(|error| EvalError::file(&path, format!("cannot be read: {error}; {expected}")))?;
        let split: Self = serde_json::from_str(&text)
            .map_err(|error| EvalError::file(&path, format!("cannot be used: {error}; {expected}")))?;
        match split.test.iter().find(|number| split.train.contains(number)) {
            Some(both) => Err(EvalError::file(
                path,
                format!("frame {both} is both for training and for testing; take it out of one list"),
            )),
            None => Ok(split),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_images_are_found_by_the_number_at_the_end_of_the_stem() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("semantic_class");
        assert!(
            GroundTruth::find(root.path())
                .unwrap_err()
                .to_string()
                .contains("no ground truth")
        );
        fs::create_dir(&folder).unwrap();
        assert!(
            GroundTruth::find(root.path())
                .unwrap_err()
                .to_string()
                .contains("has no PNGs")
        );
        let labels = [0, 1, 2, 300];
        let png = png::encode_labels(2, 2, &labels).unwrap();
        fs::write(folder.join("semantic_class_12.png"), png).unwrap();
        fs::write(folder.join("semantic_class_2.png"), "no image").unwrap();
        fs::write(folder.join("legend.png"), "no frame").unwrap();
        let truth = GroundTruth::find(root.path()).unwrap();
        assert_eq!(truth.numbers().collect::<Vec<_>>(), [2, 12]);
        let image = truth.read("rgb_0012").unwrap().unwrap();
        assert_eq!((image.width, image.height, image.labels), (2, 2, labels.to_vec()));
        assert_eq!(truth.read("rgb_3").unwrap(), None);
        let error = truth.read("rgb_2").unwrap_err().to_string();
        assert!(
            error.contains("semantic_class_2.png: is no label image"),
            "{error}"
        );
        fs::copy(folder.join("legend.png"), folder.join("again_2.png")).unwrap();
        assert!(
            GroundTruth::find(root.path())
                .unwrap_err()
                .to_string()
                .contains("frame 2")
        );
    }

    #[test]
    fn the_label_images_of_scannet_count_where_there_are_no_others() {
        let root = tempfile::tempdir().unwrap();
        for (folder, number) in [("label", 1), ("label-filt", 20), ("semantic_class", 300)] {
            fs::create_dir(root.path().join(folder)).unwrap();
            fs::write(root.path().join(format!("{folder}/{number}.png")), "an image").unwrap();
            let truth = GroundTruth::find(root.path()).unwrap();
            assert_eq!(truth.numbers().collect::<Vec<_>>(), [number]);
        }
    }

    #[test]
    fn frame_numbers_are_trailing_digits() {
        assert_eq!(frame_number("rgb_12"), Some(12));
        assert_eq!(frame_number("0007"), Some(7));
        assert_eq!(frame_number("rgb"), None);
        assert_eq!(frame_number("7_rgb"), None);
        assert_eq!(frame_number("9999999999999999999999"), None);
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
