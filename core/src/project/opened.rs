//! A project file as it is found: whole, read-only, damaged, or beside a journal that cannot be used.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::backups::{self, Backup};
use super::replace::with_suffix;
use super::{Contents, Project, ProjectError};

/// An opened project: what the file says, and where the work on it goes on.
#[derive(Debug)]
pub struct Opened {
    /// The file in which the work goes on; [`ProjectError::Unwritable`] where there is none, so that it is in memory
    /// until it is saved elsewhere.
    pub project: Result<Project, ProjectError>,
    /// What was read.
    pub contents: Contents,
    /// A sentence about a file that was damaged: which backup was opened instead, what is missing, and where the
    /// damaged file is now.
    pub damage: Option<String>,
}

impl Opened {
    /// Opens a project file and reads all of it; takes a while, so do it off the UI thread.
    ///
    /// The newest backup takes the place of a damaged file, which is put aside as `NAME-damaged.inplace`, unchanged.
    /// Where that cannot be written, the backup is only read.
    ///
    /// # Errors
    /// A missing or newer file, one that is no project, a damaged one without a backup, one that is open elsewhere.
    pub fn open(path: &Path) -> Result<Self, ProjectError> {
        let (project, contents, damage) = match Project::open(path) {
            Ok((project, contents)) if project.is_writable() => (Ok(project), contents, None),
            Ok((_, contents)) => (Err(ProjectError::read_only(path)), contents, None),
            Err(error) => match read_apart(path, error)? {
                (contents, None) => (Err(ProjectError::read_only(path)), contents, None),
                (contents, Some(account)) => {
                    let (project, place) = match put_in_place(path, &contents) {
                        Ok((project, aside)) => (
                            Ok(project),
                            format!("the damaged file is now {}", aside.display()),
                        ),
                        Err(error) => (Err(error), "nothing was written".to_owned()),
                    };
                    (project, contents, Some(format!("{account}; {place}")))
                }
            },
        };
        Ok(Self {
            project,
            contents,
            damage,
        })
    }
}

impl Contents {
    /// Reads all of a project file, or its newest backup where it is damaged, to work on it elsewhere: nothing is
    /// written to it or beside it, except that an older one is brought up to date. A backup is told by a warning.
    ///
    /// # Errors
    /// Those of [`Opened::open`].
    pub fn read(path: &Path) -> Result<Self, ProjectError> {
        let error = match Project::open(path) {
            Ok((_, contents)) => return Ok(contents),
            Err(error) => error,
        };
        let (mut contents, account) = read_apart(path, error)?;
        contents.warnings.splice(0..0, account);
        Ok(contents)
    }
}

/// Reads a file that did not open with `error`, without writing to it: all of it from a copy, or its newest backup
/// with the account of that.
fn read_apart(path: &Path, error: ProjectError) -> Result<(Contents, Option<String>), ProjectError> {
    let reason = match &error {
        ProjectError::Damaged(_, reason) => reason.clone(),
        ProjectError::NotAProject(_) => "its header is unusable".to_owned(),
        // On a read-only disk SQLite can make no use of a journal that a killed process has left beside the file.
        ProjectError::Unreadable(_, reason) => match read_copy(path) {
            Ok(Ok(contents)) => return Ok((contents, None)),
            Ok(Err(ProjectError::Damaged(_, reason))) => reason,
            Ok(Err(_)) => reason.clone(),
            Err(refused) => match refused.kind() {
                // It may be whole.
                io::ErrorKind::PermissionDenied | io::ErrorKind::StorageFull => return Err(error),
                // Some of its sectors cannot be read.
                _ => reason.clone(),
            },
        },
        _ => return Err(error),
    };
    let Some(Backup { contents, time }) = backups::newest(path) else {
        return Err(error);
    };
    let account = format!(
        "{}: is damaged ({reason}); its backup of {time} is used instead, so anything done after that is missing",
        path.display()
    );
    Ok((contents, Some(account)))
}

/// Puts the damaged file at `path` aside and a new one with these contents in its place. Returns that, opened, and
/// where the damaged one is.
fn put_in_place(path: &Path, contents: &Contents) -> Result<(Project, PathBuf), ProjectError> {
    let damaged = unused(path, "damaged")?;
    let draft = unused(path, "restored")?;
    // An open database must not be renamed: its journal would get the old name.
    drop(Project::create(&draft, contents)?);
    let change_places = || -> io::Result<()> {
        // A link, where the disk has links: after a kill the file is still there, and the next opening does this again.
        fs::hard_link(path, &damaged).or_else(|_| fs::rename(path, &damaged))?;
        // A journal of the damaged file would be applied to the new one.
        match fs::rename(with_suffix(path, "-journal"), with_suffix(&damaged, "-journal")) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        fs::rename(&draft, path)
    };
    change_places().map_err(|error| ProjectError::writing_file(path, &error))?;
    Ok((Project::attach(path)?, damaged))
}

/// `NAME-WORD.inplace` beside the file, with a number where that is taken.
fn unused(path: &Path, word: &str) -> Result<PathBuf, ProjectError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    (1_u32..1000)
        .map(|number| match number {
            1 => path.with_file_name(format!("{stem}-{word}.inplace")),
            _ => path.with_file_name(format!("{stem}-{word}-{number}.inplace")),
        })
        .find(|candidate| fs::symlink_metadata(candidate).is_err())
        .ok_or_else(|| {
            let reason =
                format!("there are a thousand files {stem}-{word} beside it; move some of them away");
            ProjectError::unwritable(path, reason)
        })
}

/// Reads a copy of a project file, made with what lies beside it in a temporary folder.
///
/// # Errors
/// Outside: the file cannot be copied. Inside: the copy cannot be opened.
fn read_copy(path: &Path) -> io::Result<Result<Contents, ProjectError>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("copy.inplace");
    // Not `fs::copy`, which would make the copy read-only as well.
    let copy = |from: &Path, to: &Path| -> io::Result<u64> {
        io::copy(&mut fs::File::open(from)?, &mut fs::File::create(to)?)
    };
    copy(path, &file)?;
    for suffix in ["-journal", "-wal"] {
        match copy(&with_suffix(path, suffix), &with_suffix(&file, suffix)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(Project::attach(&file).and_then(|project| project.read(path)))
}
