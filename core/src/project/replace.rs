//! Replacing a project file as a whole.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::location::folder_of;
use super::{ProjectError, schema};

/// Tells a file from another one that has taken its name.
pub(super) type FileIdentity = (u64, u64);

/// The identity of the file at a path; `None` where there is no file.
#[cfg(unix)]
pub(super) fn identity(path: &Path) -> Option<FileIdentity> {
    use std::os::unix::fs::MetadataExt;
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.dev(), metadata.ino()))
}

/// The identity of the file at a path; `None` where there is no file. An open file cannot be renamed here.
#[cfg(not(unix))]
pub(super) fn identity(path: &Path) -> Option<FileIdentity> {
    path.is_file().then_some((0, 0))
}

/// Has `write` make a database under a temporary name in the folder of `path`, and gives it that name
/// once it is on the disk.
pub(super) fn replace(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), ProjectError>,
) -> Result<(), ProjectError> {
    let Some(name) = path.file_name() else {
        return Err(ProjectError::unwritable(
            path,
            "that is not a file name; choose another one",
        ));
    };
    if path.is_dir() {
        return Err(ProjectError::unwritable(
            path,
            "a folder has that name; choose another one",
        ));
    }
    if path.is_file()
        && let Err(error) = schema::connect(path)
        && let in_use @ ProjectError::InUse(_) = ProjectError::reading(path, error.into())
    {
        return Err(in_use);
    }
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.tmp", std::process::id()));
    let temporary = Temporary(folder_of(path).join(hidden));
    temporary.remove();
    write(&temporary.0)?;
    let finish = || {
        File::options().write(true).open(&temporary.0)?.sync_all()?;
        // A journal that a killed process left beside a file of that name would be applied to the new one.
        for suffix in ["-journal", "-wal"] {
            match fs::remove_file(with_suffix(path, suffix)) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        fs::rename(&temporary.0, path)?;
        if cfg!(unix) {
            // Some network disks cannot do this, and by now the file has its name.
            let _ = File::open(folder_of(path)).and_then(|folder| folder.sync_all());
        }
        Ok(())
    };
    finish().map_err(|error: std::io::Error| ProjectError::writing_file(path, &error))
}

/// The file beside a database whose name is longer by this.
pub(super) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

/// A file that is gone when this goes, unless it was renamed.
struct Temporary(PathBuf);

impl Temporary {
    fn remove(&self) {
        // Most often they are not there.
        let _ = fs::remove_file(&self.0);
        let _ = fs::remove_file(with_suffix(&self.0, "-journal"));
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        self.remove();
    }
}
