//! The tables of a project file, and how a connection to one is set up. `docs/project-file.md` explains them.

use std::path::Path;
use std::time::Duration;

use rusqlite::{Connection, ErrorCode, OpenFlags};

use super::VERSION;
use super::error::Fault;

/// "INPL": tells a project from any other SQLite file.
const APPLICATION_ID: i64 = 0x494e_504c;

const TABLES: &str = include_str!("schema/tables.sql");

/// Label images from elsewhere, which version 2 brought. Version 3 made the trust a number, and has probabilities; version
/// 4 has objects.
const IMPORTS: &str = include_str!("schema/imports.sql");

/// The images of a file of version 2 as those of version 3, in its tables.
pub(super) const IMPORTS_OF_2: &str =
    "SELECT id, CASE trust WHEN 'trusted' THEN 1.0 ELSE 0.5 END FROM import";
pub(super) const MAPS_OF_2: &str =
    "SELECT import, frame, labels, NULL, NULL FROM imported_map ORDER BY import, frame";

/// The images of a file of version 3 as those of version 4.
pub(super) const MAPS_OF_3: &str =
    "SELECT import, frame, labels, shares, NULL FROM imported_map ORDER BY import, frame";

/// The objects, which version 4 brought, with `class.thing`, `stroke.object`, `imported_map.objects` and `frame.checked`.
const OBJECTS: &str = include_str!("schema/objects.sql");

/// Makes the tables of the current version in an empty database.
pub(super) fn create_tables(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch(TABLES)?;
    connection.execute_batch(IMPORTS)?;
    connection.execute_batch(OBJECTS)?;
    connection.pragma_update(None, "application_id", APPLICATION_ID)?;
    connection.pragma_update(None, "user_version", VERSION)
}

/// Opens the project at `path`, brought up to date where it can be written; and whether it can be.
///
/// # Errors
/// As [`check`], and whatever keeps the file from being opened.
pub(super) fn open(path: &Path) -> Result<(Connection, bool), Fault> {
    let connection = connect(path)?;
    let is_writable = check(&connection)?;
    Ok((connection, is_writable))
}

/// Connects to the database at `path` and takes it for this process alone. Nothing is written yet.
///
/// `locking_mode = EXCLUSIVE`: the lock is the file's own and goes with the process, so two windows never write one
/// project and a crash leaves nothing to unlock.
pub(super) fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(Duration::from_millis(200))?;
    // A file may come from anybody: it is data, and none of it is run.
    connection.pragma_update(None, "trusted_schema", false)?;
    connection.pragma_update(None, "cell_size_check", true)?;
    connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
    if !connection.is_readonly("main")? {
        // A commit, even of nothing, would put a damaged header right.
        connection.execute_batch("BEGIN EXCLUSIVE; ROLLBACK")?;
    }
    Ok(connection)
}

/// Has every commit of a whole database reach the disk.
///
/// - A rollback journal, not a write-ahead log: after every commit the whole project is in the one
///   file, so that it can be copied, synchronised or mailed at any time, even after a kill.
/// - `synchronous = FULL`: a commit returns once the file and the journal's end are on the disk, so a
///   committed edit outlives a power cut. (In exclusive locking mode a journal ends by a synchronised header of
///   zeros and not by its deletion, which would need `EXTRA`.) A kill or a power cut in the middle of a commit
///   leaves a journal beside the file, from which the next opening restores the last commit.
/// - `fullfsync`: on macOS, `fsync` alone leaves it to the disk when to write.
fn make_durable(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "journal_mode", "DELETE")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    connection.pragma_update(None, "fullfsync", true)
}

/// The schema version that a database has.
pub(super) fn version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

/// Brings a database of an earlier version up to date, whole or not at all.
fn upgrade(connection: &Connection) -> rusqlite::Result<()> {
    let version = version(connection)?;
    let imports = match version {
        1 => format!("ALTER TABLE project ADD COLUMN imported INTEGER; {IMPORTS}"),
        2 => format!(
            "CREATE TEMP TABLE import_of_2 AS {IMPORTS_OF_2};
             CREATE TEMP TABLE imported_map_of_2 AS {MAPS_OF_2};
             DROP TABLE import; DROP TABLE imported_map; {IMPORTS}
             INSERT INTO import SELECT * FROM import_of_2;
             INSERT INTO imported_map SELECT * FROM imported_map_of_2;
             DROP TABLE import_of_2; DROP TABLE imported_map_of_2;"
        ),
        3 => "ALTER TABLE imported_map ADD COLUMN objects BLOB;".to_owned(),
        _ => String::new(),
    };
    connection.execute_batch(&format!(
        "BEGIN; {imports} {OBJECTS}
         ALTER TABLE class ADD COLUMN thing INTEGER;
         ALTER TABLE stroke ADD COLUMN object INTEGER;
         ALTER TABLE frame ADD COLUMN checked INTEGER;
         PRAGMA user_version = {VERSION}; COMMIT"
    ))
}

/// Whether the database can be written, where it is a whole project that this program can read. An older one is brought
/// up to date; one that cannot be written stays as it is: [`version`] tells what it lacks.
///
/// # Errors
/// [`Fault::Foreign`], [`Fault::Newer`] or [`Fault::Damage`]; then nothing was written.
pub(super) fn check(connection: &Connection) -> Result<bool, Fault> {
    let application: i64 = connection.pragma_query_value(None, "application_id", |row| row.get(0))?;
    if application != APPLICATION_ID {
        return Err(Fault::Foreign);
    }
    let foreign = "SELECT count(*) FROM sqlite_schema WHERE type NOT IN ('table', 'index')";
    let foreign: i64 = connection.query_row(foreign, [], |row| row.get(0))?;
    if foreign > 0 {
        return Err(Fault::damage("it has views or triggers, which no project has"));
    }
    let found = version(connection)?;
    if found > VERSION {
        return Err(Fault::Newer(found));
    }
    if found < 1 {
        return Err(Fault::Damage(format!("there never was a file version {found}")));
    }
    let verdict: String = connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
    if verdict != "ok" {
        // SQLite tells the tree and page on a line of its own.
        return Err(Fault::damage(verdict.lines().last().unwrap_or_default().trim()));
    }
    if connection.is_readonly("main")? {
        return Ok(false);
    }
    let ready = make_durable(connection).and_then(|()| match found {
        VERSION => Ok(()),
        _ => upgrade(connection),
    });
    match ready {
        Ok(()) => Ok(true),
        Err(error) if is_about_writing(&error) => {
            // The transaction has ended already where the failure was that of the disk.
            if !connection.is_autocommit() {
                connection.execute_batch("ROLLBACK")?;
            }
            Ok(false)
        }
        Err(error) => Err(error.into()),
    }
}

/// Whether it is the file, the folder or the disk that refuses to be written.
fn is_about_writing(error: &rusqlite::Error) -> bool {
    matches!(
        error.sqlite_error_code(),
        Some(
            ErrorCode::ReadOnly
                | ErrorCode::CannotOpen
                | ErrorCode::PermissionDenied
                | ErrorCode::DiskFull
                | ErrorCode::SystemIoFailure
        )
    )
}
