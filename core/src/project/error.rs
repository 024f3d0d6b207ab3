//! What can be wrong with a project file.

use std::path::{Path, PathBuf};

use rusqlite::{ErrorCode, ffi};

use super::location::backups_folder;
use crate::scene::in_one_line;

/// A project that cannot be opened or saved; each message is one sentence that names the file and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProjectError {
    /// There is no file at the path.
    #[error("{}: no such project file; check the name", .0.display())]
    Missing(PathBuf),
    /// The file is something else.
    #[error(
        "{}: is not an Inplace project, or too damaged to be known as one; choose a file that Inplace has saved",
        .0.display()
    )]
    NotAProject(PathBuf),
    /// The file has this schema version, later than this program knows.
    #[error(
        "{}: was saved by a newer Inplace (file version {}, this program reads up to {}); update Inplace to open it",
        .0.display(), .1, super::VERSION
    )]
    Newer(PathBuf, i64),
    /// Another window or process has the file open.
    #[error("{}: is open in another window; close it there first, or choose another name", .0.display())]
    InUse(PathBuf),
    /// The file is ours, but what it holds cannot be right, for this reason.
    #[error(
        "{}: is damaged ({}), and {} holds no backup of it that opens; put a copy of your own in its place, or \
         move it away to start anew",
        .0.display(), .1, backups_folder(.0).display()
    )]
    Damaged(PathBuf, String),
    /// The file cannot be read, for this reason.
    #[error("{}: cannot be read: {}; check that you may read it and that its disk is there", .0.display(), .1)]
    Unreadable(PathBuf, String),
    /// The file cannot be written, for this reason, which says what to do. What was drawn is still in memory.
    #[error("{}: cannot be saved: {}", .0.display(), .1)]
    Unwritable(PathBuf, String),
    /// The folder of a scene with none of the frames that the project labels, of which there are so many.
    #[error(
        "{}: has none of the {} frames of this project; choose the folder of the scene that was labelled",
        .0.display(), .1
    )]
    OtherScene(PathBuf, usize),
}

/// Why a project file cannot be read, whichever file it is.
#[derive(Debug)]
pub(super) enum Fault {
    /// What the database says.
    Database(rusqlite::Error),
    /// What it holds that no project does.
    Damage(String),
    /// It is no project.
    Foreign,
    /// It has this later schema version.
    Newer(i64),
}

impl From<rusqlite::Error> for Fault {
    fn from(error: rusqlite::Error) -> Self {
        Self::Database(error)
    }
}

impl Fault {
    pub(super) fn damage(reason: impl Into<String>) -> Self {
        Self::Damage(reason.into())
    }
}

const READ_ONLY: &str = "it is read-only; save it somewhere else";
const UNWRITABLE_FOLDER: &str = "its folder cannot be written; save it somewhere else";

fn extended_code(error: &rusqlite::Error) -> Option<i32> {
    error.sqlite_error().map(|error| error.extended_code)
}

impl ProjectError {
    /// What was met while opening or reading `path`.
    pub(super) fn reading(path: &Path, fault: Fault) -> Self {
        let path = path.to_path_buf();
        let error = match fault {
            Fault::Database(error) => error,
            Fault::Damage(reason) => return Self::Damaged(path, reason),
            Fault::Foreign => return Self::NotAProject(path),
            Fault::Newer(found) => return Self::Newer(path, found),
        };
        match error.sqlite_error_code() {
            Some(ErrorCode::NotADatabase) => Self::NotAProject(path),
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::InUse(path),
            // A name in the schema that has changed is a logic error.
            Some(
                ErrorCode::DatabaseCorrupt
                | ErrorCode::Unknown
                | ErrorCode::TypeMismatch
                | ErrorCode::ConstraintViolation
                | ErrorCode::TooBig,
            )
            | None => Self::Damaged(path, in_one_line(&error)),
            Some(_) => Self::Unreadable(path, in_one_line(&error)),
        }
    }

    /// An error met while writing `path`.
    pub(super) fn writing(path: &Path, error: &rusqlite::Error) -> Self {
        let reason = match error.sqlite_error_code() {
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
                return Self::InUse(path.to_path_buf());
            }
            Some(ErrorCode::DiskFull) => {
                "the disk is full; free some space or save it somewhere else".to_owned()
            }
            _ if extended_code(error) == Some(ffi::SQLITE_READONLY_DIRECTORY) => UNWRITABLE_FOLDER.to_owned(),
            Some(ErrorCode::ReadOnly) => READ_ONLY.to_owned(),
            Some(ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => UNWRITABLE_FOLDER.to_owned(),
            _ => format!("{}; save it somewhere else", in_one_line(error)),
        };
        Self::unwritable(path, reason)
    }

    /// A file system error met while writing `path`.
    pub(super) fn writing_file(path: &Path, error: &std::io::Error) -> Self {
        Self::unwritable(path, format!("{error}; save it somewhere else"))
    }

    pub(super) fn unwritable(path: &Path, reason: impl Into<String>) -> Self {
        Self::Unwritable(path.to_path_buf(), reason.into())
    }

    /// Why the file cannot be written, without its name.
    pub(super) fn reason(self) -> String {
        match self {
            Self::Unwritable(_, reason) => reason,
            other => other.to_string(),
        }
    }

    /// Nothing can be written at `path`.
    pub(super) fn read_only(path: &Path) -> Self {
        Self::unwritable(path, READ_ONLY)
    }
}
