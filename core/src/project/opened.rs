//! A project file as it is found: whole, read-only, damaged, or beside a journal that cannot be used.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::replace::with_suffix;
use super::salvage::{Salvaged, salvage};
use super::{Contents, Project, ProjectError, rows};

/// An opened project: what the file says, and where the work on it goes on.
#[derive(Debug)]
pub struct Opened {
    /// The file in which the work goes on; [`ProjectError::Unwritable`] where there is none, so that it is in memory
    /// until it is saved elsewhere.
    pub project: Result<Project, ProjectError>,
    /// What was read.
    pub contents: Contents,
    /// A sentence about a file that was damaged: what was read, what is lost, where it lies now, and where the work
    /// goes on.
    pub damage: Option<String>,
}

/// Who has given a project file its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// A person: a damaged file keeps its name, and the work goes on in `NAME-recovered.inplace`.
    Person,
    /// This program, which looks for the work under that name again ([`autosave_path`](super::autosave_path)): a
    /// damaged file becomes `NAME-damaged.inplace`.
    Program,
}

impl Opened {
    /// Opens a project file and reads all of it, or what is readable; takes a while, so do it off the UI thread.
    ///
    /// A damaged file is never written: what was read of it goes into a new one.
    ///
    /// # Errors
    /// A missing or newer file, one that is no project or in which nothing is readable, one that is open elsewhere.
    pub fn open(path: &Path, owner: Owner) -> Result<Self, ProjectError> {
        let error = match Project::open(path) {
            Ok((project, contents)) => {
                let project = match project.is_read_only() {
                    true => Err(ProjectError::read_only(path)),
                    false => Ok(project),
                };
                return Ok(Self {
                    project,
                    contents,
                    damage: None,
                });
            }
            Err(error) => error,
        };
        match read_apart(path, error)? {
            Apart::Whole(contents) => Ok(Self {
                project: Err(ProjectError::read_only(path)),
                contents: *contents,
                damage: None,
            }),
            Apart::Damaged { salvaged, reason } => {
                let Salvaged { contents, account } = *salvaged;
                let (project, place) = match go_on(path, owner, &contents) {
                    Ok((project, place)) => (Ok(project), place),
                    Err(error) => (Err(error), "nothing was written".to_owned()),
                };
                let damage = format!("{}: is damaged ({reason}); {account}; {place}", path.display());
                Ok(Self {
                    project,
                    contents,
                    damage: Some(damage),
                })
            }
        }
    }
}

impl Contents {
    /// Reads all of a project file, or what is readable, to work on it elsewhere: nothing is written to it or beside
    /// it, except that an older one is brought up to date. What was damaged is told by a warning.
    ///
    /// # Errors
    /// Those of [`Opened::open`].
    pub fn read(path: &Path) -> Result<Self, ProjectError> {
        let error = match Project::open(path) {
            Ok((_, contents)) => return Ok(contents),
            Err(error) => error,
        };
        match read_apart(path, error)? {
            Apart::Whole(contents) => Ok(*contents),
            Apart::Damaged { salvaged, reason } => {
                let Salvaged {
                    mut contents,
                    account,
                } = *salvaged;
                let sentence = format!("{}: is damaged ({reason}); {account}", path.display());
                contents.warnings.insert(0, sentence);
                Ok(contents)
            }
        }
    }
}

/// What could be read of a file that did not open.
enum Apart {
    /// All of it, from a copy.
    Whole(Box<Contents>),
    Damaged {
        salvaged: Box<Salvaged>,
        reason: String,
    },
}

/// Reads a file that did not open with `error`, without writing to it.
fn read_apart(path: &Path, error: ProjectError) -> Result<Apart, ProjectError> {
    match &error {
        ProjectError::Damaged { reason, .. } => salvaged(path, path, reason.clone(), true).ok_or(error),
        ProjectError::NotAProject(_) => {
            // The mark by which a project is known may be what is damaged.
            let is_named = path.extension().is_some_and(|extension| extension == "inplace");
            let reason = "its header is unusable".to_owned();
            is_named
                .then(|| salvaged(path, path, reason, false))
                .flatten()
                .ok_or(error)
        }
        // On a read-only disk SQLite can make no use of a journal that a killed process has left beside the file.
        ProjectError::Unreadable { reason, .. } => {
            let Ok(copy) = Copy::of(path) else {
                // Some of its sectors may be readable.
                return salvaged(path, path, reason.clone(), false).ok_or(error);
            };
            let read = Project::attach(&copy.file).and_then(|project| rows::read(&project.connection, path));
            match read {
                Ok(contents) => Ok(Apart::Whole(Box::new(contents))),
                Err(ProjectError::Damaged { reason, .. } | ProjectError::Unreadable { reason, .. }) => {
                    salvaged(&copy.file, path, reason, true).ok_or(error)
                }
                Err(_) => Err(error),
            }
        }
        _ => Err(error),
    }
}

fn salvaged(file: &Path, path: &Path, reason: String, surely_ours: bool) -> Option<Apart> {
    let salvaged = Box::new(salvage(file, path, surely_ours)?);
    Some(Apart::Damaged { salvaged, reason })
}

/// Writes what was read of the damaged file at `path` into a new one and opens that; returns it with the end of a
/// sentence about the places of both.
fn go_on(path: &Path, owner: Owner, contents: &Contents) -> Result<(Project, String), ProjectError> {
    let recovered = unused(path, "recovered")?;
    let project = Project::create(&recovered, contents)?;
    if owner == Owner::Person {
        let place = format!(
            "the work goes on in {}, and the damaged file stays as it is",
            recovered.display()
        );
        return Ok((project, place));
    }
    // An open database must not be renamed: its journal would get the old name.
    drop(project);
    let damaged = unused(path, "damaged")?;
    let change_places = || -> io::Result<()> {
        fs::rename(path, &damaged)?;
        // A journal of the damaged file would be applied to the new one.
        match fs::rename(with_suffix(path, "-journal"), with_suffix(&damaged, "-journal")) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        fs::rename(&recovered, path)
    };
    change_places().map_err(|error| ProjectError::writing_file(path, &error))?;
    let place = format!("the damaged file is now {}", damaged.display());
    Ok((Project::attach(path)?, place))
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

/// A copy of a project file with what lies beside it, in a folder that goes with it.
struct Copy {
    _folder: tempfile::TempDir,
    file: PathBuf,
}

impl Copy {
    fn of(path: &Path) -> io::Result<Self> {
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
        Ok(Self {
            _folder: folder,
            file,
        })
    }
}
