//! Ground truth of captures in the Replica layout: label images and the frames to train and test on.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::EvalError;
use inplace_core::labels::{ClassId, decode_gray};
use inplace_core::scene::{frame_number, label_images};

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
        let images = label_images(scene)?;
        Ok(Self { images })
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
        let (width, height, labels) = decode_gray(&bytes).map_err(|error| unusable(error.to_string()))?;
        Ok(Some(LabelImage {
            width,
            height,
            labels,
        }))
    }
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
    use crate::testing::capture;

    #[test]
    fn label_images_are_read_by_the_number_of_their_frame() {
        let (_root, folder) = capture();
        fs::write(folder.join("semantic_class/semantic_class_2.png"), "no image").unwrap();
        let truth = GroundTruth::find(&folder).unwrap();
        let image = truth.read("rgb_0005").unwrap().unwrap();
        assert_eq!((image.width, image.height), (64, 48));
        assert_eq!((image.labels[0], image.labels[63]), (1, 2));
        assert_eq!(truth.read("rgb_6").unwrap(), None);
        let error = truth.read("rgb_2").unwrap_err().to_string();
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
