//! Where the label images of a capture lie; what they hold is not read here.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::SceneError;
use super::error::refuse;
use super::files::numbered_files;

/// Folders of label images; the first that a capture has counts. The latter two are ScanNet's.
const FOLDERS: [&str; 3] = ["semantic_class", "label-filt", "label"];

/// The label images of a capture's folder by the number of their frame: `semantic_class/*N.png` for frame N, or in
/// `label-filt/` or `label/`. None of them is read yet.
///
/// # Errors
/// A capture without label images, or with two of one frame number.
pub fn label_images(capture: &Path) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let places = FOLDERS.map(|name| capture.join(name));
    numbered_images(places.iter().find(|place| place.is_dir()).unwrap_or(&places[0]))
}

/// The PNGs of a folder by the number at the end of their stems. None of them is read.
///
/// # Errors
/// A folder without such images, or with two of one number.
pub fn numbered_images(folder: &Path) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    let images = match folder.is_dir() {
        true => numbered_files(folder, &["png"], &mut Vec::new())?,
        false => BTreeMap::new(),
    };
    if images.is_empty() {
        refuse!(
            folder,
            "no ground truth: there are no PNGs with a frame number at the end of their names; measure on a capture that \
             has label images"
        );
    }
    Ok(images)
}

/// The number at the end of a frame's stem: 12 for `rgb_12`.
pub fn frame_number(stem: &str) -> Option<usize> {
    let rest = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    stem[rest.len()..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn label_images_are_found_by_their_last_number_and_scannets_where_there_are_no_others() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("semantic_class");
        let numbers = || label_images(root.path()).map(|images| images.into_keys().collect::<Vec<_>>());
        let refusal = || numbers().unwrap_err().to_string();
        assert!(refusal().contains("no ground truth"));
        for (name, number) in [("label", 1), ("label-filt", 20)] {
            fs::create_dir(root.path().join(name)).unwrap();
            fs::write(root.path().join(format!("{name}/{number}.png")), "an image").unwrap();
            assert_eq!(numbers().unwrap(), [number]);
        }
        fs::create_dir(&folder).unwrap();
        assert!(refusal().contains("there are no PNGs"));
        fs::write(folder.join("semantic_class_12.png"), "an image").unwrap();
        fs::write(folder.join("semantic_class_2.png"), "an image").unwrap();
        for other in ["legend.png", "7_legend.png", "9999999999999999999999.png"] {
            fs::write(folder.join(other), "no frame").unwrap();
        }
        assert_eq!(numbers().unwrap(), [2, 12]);
        fs::copy(folder.join("legend.png"), folder.join("0002.png")).unwrap();
        assert!(refusal().contains("the same number"));
    }
}
