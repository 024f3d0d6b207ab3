//! The project file `NAME.inplace`: one SQLite database in which every edit is a transaction.
//!
//! [`Project`] is the open file, [`Contents`] is what it holds, and a [`Journal`] is the thread that
//! writes to it, so that nobody waits for the disk. [`Opened`] is a file as it was found: whole, read-only or
//! damaged, in which case the newest backup is opened. The strokes and their history are the truth; the maps
//! and the model are kept so that a reopened project shows its result at once. `docs/project-file.md`
//! describes the tables.

mod backups;
mod columns;
mod consistency;
mod contents;
mod error;
mod imports;
mod journal;
mod location;
mod opened;
mod replace;
mod rows;
mod schema;
mod writer;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rusqlite::Connection;

pub use contents::{Contents, FrameRecord, SceneRecord};
pub use error::ProjectError;
pub use journal::Journal;
pub use location::{autosave_path, configuration_folder, log_path, picture_name, pictures_folder, same_file};
pub use opened::Opened;
pub use writer::{JournalEvent, SaveAs};

use crate::labels::{Edit, History, ImportId, ImportedLabels};
use crate::session::{FrameMap, ModelState};

/// Schema version that this program writes, and the highest that it reads.
const VERSION: i64 = 4;

/// SQL that forgets all maps.
const FORGET_MAPS: &str = "DELETE FROM map";

/// SQL that forgets all maps and the model.
const FORGET_RESULTS: &str = "DELETE FROM model; DELETE FROM map";

/// One step through the edit history.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Label images from elsewhere, which the next edit brings.
    Import(ImportId, Arc<ImportedLabels>),
    /// A new edit; what had been undone is forgotten.
    Do(Edit),
    /// The last edit was taken back.
    Undo,
    /// The last undone edit was done again.
    Redo,
}

/// An open project file. No other window or process can open it until this is dropped.
#[derive(Debug)]
pub struct Project {
    connection: Connection,
    path: PathBuf,
    identity: Option<replace::FileIdentity>,
    is_writable: bool,
}

/// What every SQLite file begins with.
const SQLITE: &[u8] = b"SQLite format 3\0";

impl Project {
    /// Whether a file looks like a project, by its name or by how it begins: a damaged one may have a backup.
    ///
    /// # Errors
    /// There is no such file, it cannot be read, or it is another one.
    pub fn recognise(path: &Path) -> Result<(), ProjectError> {
        if !path.exists() {
            return Err(ProjectError::Missing(path.to_path_buf()));
        }
        if path.extension().is_some_and(|extension| extension == "inplace") {
            return Ok(());
        }
        let mut start = Vec::new();
        let read = File::open(path).and_then(|file| file.take(SQLITE.len() as u64).read_to_end(&mut start));
        match read {
            Err(error) => Err(ProjectError::Unreadable(path.to_path_buf(), error.to_string())),
            Ok(_) if start != SQLITE => Err(ProjectError::NotAProject(path.to_path_buf())),
            Ok(_) => Ok(()),
        }
    }

    /// Writes a new project file and opens it. A file that is there is replaced as a whole, or not at all.
    ///
    /// # Errors
    /// [`ProjectError::InUse`] or [`ProjectError::Unwritable`].
    pub fn create(path: &Path, contents: &Contents) -> Result<Self, ProjectError> {
        replace::replace(path, |temporary| {
            let maps = encoded(path, &contents.maps)?;
            let write = || {
                let mut connection = Connection::open(temporary)?;
                // Whole or not at all: the file is synchronised before it gets its name.
                connection.pragma_update(None, "synchronous", "OFF")?;
                schema::create_tables(&connection)?;
                let transaction = connection.transaction()?;
                rows::write_all(&transaction, path, &contents.scene, &contents.history)?;
                rows::write_view(&transaction, contents.view.as_deref())?;
                maps.iter().try_for_each(|map| map.write(&transaction))?;
                if let Some(model) = &contents.model {
                    rows::write_model(&transaction, model)?;
                }
                transaction.commit()
            };
            write().map_err(|error| ProjectError::writing(path, &error))
        })?;
        Self::attach(path)
    }

    /// Opens a project file and reads all of it; decoding the maps takes a while, so do it off the UI
    /// thread.
    ///
    /// A file that cannot be written is opened all the same: see [`Project::is_writable`]. [`Opened::open`] goes
    /// on from a backup where the file is damaged.
    ///
    /// # Errors
    /// A missing file, one that is not a project, a newer or damaged one, one that is open elsewhere.
    pub fn open(path: &Path) -> Result<(Self, Contents), ProjectError> {
        if !path.is_file() {
            return Err(ProjectError::Missing(path.to_path_buf()));
        }
        let project = Self::attach(path)?;
        let contents = project.read(path)?;
        Ok((project, contents))
    }

    /// Reads all of the file as one at `path`.
    fn read(&self, path: &Path) -> Result<Contents, ProjectError> {
        rows::read(&self.connection, path).map_err(|fault| ProjectError::reading(path, fault))
    }

    fn attach(path: &Path) -> Result<Self, ProjectError> {
        let opened = schema::open(path).map_err(|fault| ProjectError::reading(path, fault));
        let (connection, is_writable) = opened?;
        Ok(Self {
            connection,
            path: path.to_path_buf(),
            identity: replace::identity(path),
            is_writable,
        })
    }

    /// Whether the file can be written: neither it nor its folder nor its disk is read-only.
    pub fn is_writable(&self) -> bool {
        self.is_writable
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes steps through the history in one transaction; on return they are on the disk. The maps of the labels of
    /// before are forgotten.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`]; then none of them is in the file.
    pub fn record(&mut self, steps: &[Step]) -> Result<(), ProjectError> {
        self.write(|transaction| {
            transaction.execute_batch(FORGET_MAPS)?;
            steps
                .iter()
                .try_for_each(|step| rows::write_step(transaction, step))
        })
    }

    /// Number of edits in the file, and how many of them are in force.
    fn position(&self) -> Result<(usize, usize), ProjectError> {
        let position = rows::read_position(&self.connection);
        position.map_err(|error| ProjectError::writing(&self.path, &error))
    }

    /// Replaces the scene, the labels and the history in one transaction; of maps and model, which were made from those of
    /// before, it forgets what the SQL `forget` says. The view stays.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`]; then the file is as before.
    fn rewrite(&mut self, scene: &SceneRecord, history: &History, forget: &str) -> Result<(), ProjectError> {
        let path = self.path.clone();
        self.write(|transaction| {
            transaction.execute_batch(forget)?;
            rows::write_all(transaction, &path, scene, history)
        })
    }

    /// Keeps these maps as the last ones of their frames, in one transaction.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`].
    pub fn save_maps(&mut self, maps: &[Arc<FrameMap>]) -> Result<(), ProjectError> {
        let maps = encoded(&self.path, maps)?;
        self.write(|transaction| maps.iter().try_for_each(|map| map.write(transaction)))
    }

    /// Keeps this model state as the last one.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`].
    pub fn save_model(&mut self, model: &ModelState) -> Result<(), ProjectError> {
        self.write(|transaction| rows::write_model(transaction, model))
    }

    /// Keeps view settings, a JSON text that means something to the window alone.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`].
    pub fn save_view(&mut self, json: &str) -> Result<(), ProjectError> {
        self.write(|transaction| rows::write_view(transaction, Some(json)))
    }

    /// Writes a copy under another name ("Save As") and opens it. A file that is there is replaced as a
    /// whole, or not at all.
    ///
    /// # Errors
    /// [`ProjectError::InUse`] or [`ProjectError::Unwritable`].
    pub fn copy_to(&self, path: &Path) -> Result<Self, ProjectError> {
        let own_scene = rows::read_scene(&self.connection, &self.path);
        let own_scene = own_scene.map_err(|fault| ProjectError::reading(&self.path, fault))?;
        replace::replace(path, |temporary| {
            let vacuum = "VACUUM INTO ?1";
            let copied = self.connection.execute(vacuum, [temporary.to_string_lossy()]);
            copied
                .and_then(|_| rows::write_location(&Connection::open(temporary)?, path, &own_scene))
                .map_err(|error| ProjectError::writing(path, &error))
        })?;
        Self::attach(path)
    }

    /// Changes the file in one transaction.
    fn write(
        &mut self,
        change: impl FnOnce(&Connection) -> rusqlite::Result<()>,
    ) -> Result<(), ProjectError> {
        self.ensure_in_place()?;
        let transaction = self.connection.transaction();
        let written = transaction.and_then(|transaction| {
            change(&transaction)?;
            transaction.commit()
        });
        written.map_err(|error| ProjectError::writing(&self.path, &error))
    }

    /// SQLite would go on writing to a file that was deleted or renamed, without an error.
    fn ensure_in_place(&self) -> Result<(), ProjectError> {
        if replace::identity(&self.path) == self.identity {
            return Ok(());
        }
        Err(ProjectError::unwritable(
            &self.path,
            "it was moved or deleted; save the project again",
        ))
    }
}

/// Maps as rows of the file at `path`.
fn encoded(path: &Path, maps: &[Arc<FrameMap>]) -> Result<Vec<rows::MapRow>, ProjectError> {
    let encoded: Result<_, png::EncodingError> = maps.iter().map(|map| rows::MapRow::encode(map)).collect();
    encoded.map_err(|error| ProjectError::unwritable(path, format!("a map has no image: {error}")))
}

#[cfg(test)]
mod tests;
