//! The tables of a project file, and how a connection to one is set up. `docs/project-file.md` explains them.

use std::path::Path;
use std::time::Duration;

use rusqlite::{Connection, OpenFlags};

use super::ProjectError;

/// "INPL": tells a project from any other SQLite file.
pub(super) const APPLICATION_ID: i64 = 0x494e_504c;

/// Schema version that this program writes, and the highest that it reads.
pub(super) const VERSION: i64 = 2;

const TABLES: &str = "
CREATE TABLE project (
    id            INTEGER PRIMARY KEY CHECK (id = 1),
    scene         TEXT NOT NULL CHECK (scene IN ('demo', 'folder')),
    relative_path TEXT,
    absolute_path TEXT,
    depth         INTEGER NOT NULL,
    cursor        INTEGER NOT NULL,
    view          TEXT,
    written_by    TEXT NOT NULL,
    imported      INTEGER
) STRICT;
CREATE TABLE frame (
    number INTEGER PRIMARY KEY,
    stem   TEXT NOT NULL,
    width  INTEGER NOT NULL,
    height INTEGER NOT NULL,
    bytes  INTEGER NOT NULL
) STRICT;
CREATE TABLE class (
    position INTEGER PRIMARY KEY,
    id       INTEGER NOT NULL UNIQUE,
    name     TEXT NOT NULL,
    red      INTEGER NOT NULL,
    green    INTEGER NOT NULL,
    blue     INTEGER NOT NULL
) STRICT;
CREATE TABLE stroke (
    id     INTEGER PRIMARY KEY,
    frame  INTEGER NOT NULL,
    class  INTEGER NOT NULL,
    radius INTEGER NOT NULL,
    lines  TEXT NOT NULL
) STRICT;
CREATE TABLE edit (
    number INTEGER PRIMARY KEY,
    change TEXT NOT NULL
) STRICT;
CREATE TABLE model (
    id      INTEGER PRIMARY KEY CHECK (id = 1),
    steps   INTEGER NOT NULL,
    tensors BLOB NOT NULL
) STRICT;
CREATE TABLE map (
    frame      INTEGER PRIMARY KEY,
    generation INTEGER NOT NULL,
    labels     BLOB NOT NULL,
    entropy    BLOB NOT NULL
) STRICT;
";

/// What version 2 brought: label images from elsewhere.
const IMPORTS: &str = "
CREATE TABLE import (
    id    INTEGER PRIMARY KEY,
    trust TEXT NOT NULL CHECK (trust IN ('trusted', 'votes'))
) STRICT;
CREATE TABLE imported_map (
    import INTEGER NOT NULL,
    frame  INTEGER NOT NULL,
    labels BLOB NOT NULL,
    PRIMARY KEY (import, frame)
) STRICT;
";

/// Makes the tables of the current version in an empty database.
pub(super) fn create_tables(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch(TABLES)?;
    connection.execute_batch(IMPORTS)?;
    connection.pragma_update(None, "application_id", APPLICATION_ID)?;
    connection.pragma_update(None, "user_version", VERSION)
}

/// Connects to the database at `path` and takes it for this process alone.
///
/// - A rollback journal, not a write-ahead log: after every commit the whole project is in the one
///   file, so that it can be copied, synchronised or mailed at any time, even after a kill.
/// - `synchronous = FULL`: a commit returns once the file and the journal's end are on the disk, so a
///   committed edit outlives a power cut. A kill or a power cut in the middle of a commit leaves a
///   journal beside the file, from which the next opening restores the last commit.
/// - `locking_mode = EXCLUSIVE`: the lock is the file's own and goes with the process, so two windows
///   never write one project and a crash leaves nothing to unlock.
pub(super) fn connect(path: &Path, create: bool) -> rusqlite::Result<Connection> {
    let mut flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    if create {
        flags |= OpenFlags::SQLITE_OPEN_CREATE;
    }
    let connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(Duration::from_millis(200))?;
    // A project may come from anyone: nothing in its schema runs what it should not, and pages are checked when read.
    connection.pragma_update(None, "trusted_schema", "OFF")?;
    connection.pragma_update(None, "cell_size_check", "ON")?;
    connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
    connection.pragma_update(None, "journal_mode", "DELETE")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    if !connection.is_readonly("main")? {
        connection.execute_batch("BEGIN EXCLUSIVE; COMMIT")?;
    }
    Ok(connection)
}

/// The schema version that a database has.
pub(super) fn version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

/// Brings a database of an earlier version up to date, whole or not at all. One that cannot be written stays as it
/// is: [`version`] tells what it lacks.
fn upgrade(connection: &Connection) -> rusqlite::Result<()> {
    if connection.is_readonly("main")? {
        return Ok(());
    }
    connection.execute_batch(&format!(
        "BEGIN; ALTER TABLE project ADD COLUMN imported INTEGER; {IMPORTS} PRAGMA user_version = {VERSION}; COMMIT"
    ))
}

/// Whether the database is a project that this program can read; an older one is brought up to date.
pub(super) fn check(connection: &Connection, path: &Path) -> Result<(), ProjectError> {
    let reading = |error| ProjectError::reading(path, &error);
    let pragma = |name: &str| {
        connection
            .pragma_query_value(None, name, |row| row.get::<_, i64>(0))
            .map_err(reading)
    };
    if pragma("application_id")? != APPLICATION_ID {
        return Err(ProjectError::NotAProject(path.to_path_buf()));
    }
    let foreign = "SELECT count(*) FROM sqlite_schema WHERE type NOT IN ('table', 'index')";
    let foreign: i64 = connection
        .query_row(foreign, [], |row| row.get(0))
        .map_err(reading)?;
    if foreign > 0 {
        return Err(ProjectError::damaged(
            path,
            "it has views or triggers, which no project has",
        ));
    }
    match version(connection).map_err(reading)? {
        VERSION => Ok(()),
        1 => upgrade(connection).map_err(reading),
        found if found > VERSION => Err(ProjectError::Newer {
            path: path.to_path_buf(),
            found,
        }),
        found => Err(ProjectError::damaged(
            path,
            format!("there never was a file version {found}"),
        )),
    }
}
