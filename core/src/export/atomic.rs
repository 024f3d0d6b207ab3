//! Files that are there as a whole or not at all.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

const SUFFIX: &str = ".inplace-tmp";

/// Writes a file under a temporary name in the same folder and renames it, unless it holds these bytes already;
/// returns whether it did not.
///
/// # Errors
/// What the file system says.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<bool> {
    if holds(path, bytes) {
        return Ok(false);
    }
    let temporary = temporary(path)?;
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written.map(|()| true)
}

/// Whether a file is there with exactly this content.
pub(super) fn holds(path: &Path, bytes: &[u8]) -> bool {
    fs::metadata(path).is_ok_and(|found| found.len() == bytes.len() as u64)
        && fs::read(path).is_ok_and(|found| found == bytes)
}

/// The hidden name that a file has while this process writes it.
pub(super) fn temporary(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    let mut hidden = OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}{SUFFIX}", std::process::id()));
    Ok(path.with_file_name(hidden))
}

/// Makes a folder, tries whether a file can be written in it, and removes what a killed run left there.
pub(super) fn prepare(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let trial = temporary(&folder.join("trial"))?;
    fs::write(&trial, b"trial")?;
    fs::remove_file(&trial)?;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with('.')
            && let Some((_, process)) = name.strip_suffix(SUFFIX).and_then(|name| name.rsplit_once('.'))
            && !is_running(process)
        {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Whether a process with this number runs, where the system says so in a file (Linux).
fn is_running(process: &str) -> bool {
    Path::new("/proc").join(process).exists()
}
