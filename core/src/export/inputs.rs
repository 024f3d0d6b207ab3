//! What the labels of a run follow from, so that a run that was done is not done again.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};
use sha2::{Digest, Sha256};

use super::objects::OBJECTS;
use super::pngs::PNG_FOLDERS;
use super::{ExportError, REPORT, Report};
use crate::field::Preset;

/// Everything that decides the labels of a run, beside the version of the program and the files of the capture itself. The
/// number of threads is not among it: it decides how soon they are there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Absolute path of the capture or project; the word "demo". What is not Unicode in it is replaced.
    #[serde(serialize_with = "lossy")]
    pub scene: PathBuf,
    /// [`digest`] of the strokes file, or of the project that brings its own; `None` where they are built in or there
    /// are none.
    pub strokes_sha256: Option<String>,
    /// [`digest`] of the imported label images and their list of classes.
    pub import_sha256: Option<String>,
    /// How far those are trusted, 0 to 1, where that was said.
    pub trust: Option<f32>,
    /// [`digest`] of the file of a pretrained network.
    pub features_sha256: Option<String>,
    /// How much the field may model.
    pub preset: Preset,
    /// Seed of everything random.
    pub seed: u64,
    /// Whether measured depth is read.
    pub depth: bool,
    /// Whether images outside the capture's folder are read.
    pub outside_files: bool,
    /// Bytes that decoded images may take in memory.
    pub image_bytes: u64,
    /// Wall time that the run may take, in seconds.
    pub budget_s: Option<f64>,
}

fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// SHA-256 of the names and contents of files, in the given order, as hexadecimal digits. The folders that they are in do
/// not count.
///
/// # Errors
/// [`ExportError::Unreadable`].
pub fn digest<P: AsRef<Path>>(files: &[P]) -> Result<String, ExportError> {
    let mut hash = Sha256::new();
    for path in files.iter().map(AsRef::as_ref) {
        let mut content = Sha256::new();
        let copied = File::open(path).and_then(|mut file| io::copy(&mut file, &mut content));
        copied.map_err(|error| ExportError::Unreadable(path.to_path_buf(), error))?;
        let name = path.file_name().unwrap_or_default();
        // Of one length each: the end of a name and the beginning of a content cannot be taken for each other.
        hash.update(Sha256::digest(name.as_encoded_bytes()));
        hash.update(content.finalize());
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The text of the report in a folder that a run of this `version` with the same inputs finished, where all that it wrote
/// is still there; `None` where there is something to do.
pub fn finished(folder: &Path, version: &str, inputs: &Inputs) -> Option<String> {
    let text = fs::read_to_string(folder.join(REPORT)).ok()?;
    let report: Report = serde_json::from_str(&text).ok()?;
    // Numbers as they are after being written and read, like those of the report.
    let inputs: Inputs = serde_json::from_str(&serde_json::to_string(inputs).ok()?).ok()?;
    let is_same = report.version == version && report.inputs == Some(inputs);
    let is_whole = || {
        folder.join("classes.json").is_file()
            && PNG_FOLDERS
                .iter()
                .all(|kind| images(&folder.join(kind)) >= report.frames)
            && (!folder.join("objects.json").is_file() || images(&folder.join(OBJECTS)) >= report.frames)
    };
    (is_same && is_whole()).then_some(text)
}

/// Number of PNGs in a folder, those that are being written not among them.
fn images(folder: &Path) -> usize {
    let is_image = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|end| end == "png");
    fs::read_dir(folder).map_or(0, |entries| entries.flatten().filter(is_image).count())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder as a run leaves it.
    fn labelled(inputs: &Inputs) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for kind in PNG_FOLDERS {
            fs::create_dir(folder.path().join(kind)).unwrap();
            fs::write(folder.path().join(kind).join("a.png"), "").unwrap();
        }
        fs::write(folder.path().join("classes.json"), "[]").unwrap();
        let report = Report {
            version: "1".to_owned(),
            inputs: Some(inputs.clone()),
            frames: 1,
            ..Report::default()
        };
        super::super::write_report(folder.path(), &report).unwrap();
        folder
    }

    fn inputs() -> Inputs {
        Inputs {
            scene: PathBuf::from("/captures/kitchen"),
            strokes_sha256: Some("ab".to_owned()),
            trust: Some(0.1),
            budget_s: Some(1.0 / 3.0),
            seed: u64::MAX,
            ..Inputs::default()
        }
    }

    #[test]
    fn a_run_is_finished_only_for_what_it_was_made_from_and_while_all_of_it_is_there() {
        let folder = labelled(&inputs());
        let is_finished = |version: &str, inputs: &Inputs| finished(folder.path(), version, inputs).is_some();
        assert!(is_finished("1", &inputs()));
        assert!(!is_finished("2", &inputs()));
        let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
        let not_measured = "\"depth_error_m\": null";
        assert!(text.contains(not_measured), "{text}");
        let changes: [fn(&mut Inputs); 7] = [
            |inputs| inputs.scene.push("other"),
            |inputs| inputs.strokes_sha256 = Some("cd".to_owned()),
            |inputs| inputs.import_sha256 = Some("cd".to_owned()),
            |inputs| inputs.features_sha256 = Some("cd".to_owned()),
            |inputs| inputs.seed = 0,
            |inputs| inputs.budget_s = None,
            |inputs| inputs.depth = true,
        ];
        for change in changes {
            let mut other = inputs();
            change(&mut other);
            assert!(!is_finished("1", &other), "{other:?}");
        }
        let withdraw = || super::super::remove(&folder.path().join(REPORT)).unwrap();
        assert!(withdraw() && !withdraw());
        assert!(!is_finished("1", &inputs()));
        for lost in ["labels/a.png", "entropy/a.png", "color/a.png", "classes.json"] {
            let folder = labelled(&inputs());
            fs::remove_file(folder.path().join(lost)).unwrap();
            assert_eq!(finished(folder.path(), "1", &inputs()), None, "{lost}");
        }
    }

    #[test]
    fn a_digest_is_that_of_names_and_contents_wherever_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, content: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, content).unwrap();
            path
        };
        let [x, y, other] = [file("x", "abc"), file("y", ""), file("inner/x", "abc")];
        let first = digest(&[&x, &y]).unwrap();
        assert_eq!(first.len(), 64);
        assert_eq!(digest(&[&other, &y]).unwrap(), first);
        assert_ne!(digest(&[&y, &x]).unwrap(), first);
        assert_ne!(digest(&[&x]).unwrap(), first);
        file("y", "d");
        assert_ne!(digest(&[&x, &y]).unwrap(), first);
        let missing = digest(&[folder.path().join("z")]).unwrap_err();
        assert!(missing.to_string().contains("cannot be read"), "{missing}");
    }
}
