//! Files that are there as a whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

const SUFFIX: &str = ".inplace-tmp";

/// Writes a file under a temporary name in the same folder and renames it, unless it holds these bytes already;
/// returns whether it did not.
///
/// # Errors
/// What the file system says.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<bool> {
    let is_new = !holds(path, bytes);
    if is_new {
        replace(path, bytes)?;
    }
    Ok(is_new)
}

/// The same, whatever the file holds.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = temporary(path);
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// Whether a file is there with exactly this content.
pub(super) fn holds(path: &Path, bytes: &[u8]) -> bool {
    fs::metadata(path).is_ok_and(|found| found.len() == bytes.len() as u64)
        && fs::read(path).is_ok_and(|found| found == bytes)
}

/// Files that this process has begun.
static WRITTEN: AtomicU64 = AtomicU64::new(0);

/// The hidden name that a file has while this process writes it: short, as its own may be as long as names can be.
pub(super) fn temporary(path: &Path) -> PathBuf {
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".{number}.{}{SUFFIX}", std::process::id()))
}

/// Makes a folder, tries whether a file can be written in it, and removes what a killed run left there.
pub(super) fn prepare(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let trial = temporary(&folder.join("trial"));
    fs::write(&trial, b"trial")?;
    fs::remove_file(&trial)?;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let hidden = name.strip_prefix('.').and_then(|name| name.strip_suffix(SUFFIX));
        if let Some((number, process)) = hidden.and_then(|name| name.rsplit_once('.'))
            && (!is_running(process) || is_of_the_same_number(number, process))
        {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Whether a file is of an earlier process that had the number of this one, as every run in a container has: this one has
/// begun none with that number.
fn is_of_the_same_number(number: &str, process: &str) -> bool {
    let begun = WRITTEN.load(Ordering::Relaxed);
    process == std::process::id().to_string() && number.parse().is_ok_and(|number: u64| number >= begun)
}

/// Whether a process with this number runs, where the system says so in a file (Linux).
fn is_running(process: &str) -> bool {
    Path::new("/proc").join(process).exists()
}
