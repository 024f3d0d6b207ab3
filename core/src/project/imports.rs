//! The rows of label images from elsewhere.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use rusqlite::{Connection, params};

use super::rows::{integer, rows, unsigned};
use super::{ProjectError, SceneRecord, schema};
use crate::labels::{History, ImportId, ImportedLabels, ImportedMap, Trust, png};

/// The label images that a history names, and those in force.
type Imports = (BTreeMap<ImportId, Arc<ImportedLabels>>, Option<ImportId>);

/// Replaces all label images, and tells which are in force.
pub(super) fn write_all(
    connection: &Connection,
    scene: &SceneRecord,
    history: &History,
) -> rusqlite::Result<()> {
    connection.execute_batch("DELETE FROM import; DELETE FROM imported_map")?;
    let (imports, in_force) = history.imports();
    for (&id, images) in imports {
        write_with(connection, id, images, |frame| {
            let record = scene.frames.get(frame)?;
            Some((record.width, record.height))
        })?;
    }
    put_in_force(connection, in_force)
}

/// Adds label images of the frames that the project lists.
pub(super) fn write(connection: &Connection, id: ImportId, images: &ImportedLabels) -> rusqlite::Result<()> {
    let sizes = rows(
        connection,
        "SELECT width, height FROM frame ORDER BY number",
        |row| Ok((row.get(0)?, row.get(1)?)),
    )?;
    write_with(connection, id, images, |frame| sizes.get(frame).copied())
}

fn write_with(
    connection: &Connection,
    id: ImportId,
    images: &ImportedLabels,
    size: impl Fn(usize) -> Option<(u32, u32)> + Sync,
) -> rusqlite::Result<()> {
    let trust = match images.trust {
        Trust::Trusted => "trusted",
        Trust::Votes => "votes",
    };
    connection.execute(
        "INSERT OR REPLACE INTO import (id, trust) VALUES (?1, ?2)",
        params![integer(id.0), trust],
    )?;
    let encode = |map: &ImportedMap| {
        let (width, height) = size(map.frame).unwrap_or_default();
        let png = png::encode_labels(width, height, &map.labels());
        png.map_err(|error| rusqlite::Error::ToSqlConversionFailure(error.into()))
    };
    let encoded: rusqlite::Result<Vec<Vec<u8>>> = images.maps.par_iter().map(encode).collect();
    let mut insert = connection
        .prepare_cached("INSERT OR REPLACE INTO imported_map (import, frame, labels) VALUES (?1, ?2, ?3)")?;
    for (map, png) in images.maps.iter().zip(encoded?) {
        insert.execute(params![integer(id.0), integer(map.frame), png])?;
    }
    Ok(())
}

/// Tells which label images are in force.
pub(super) fn put_in_force(connection: &Connection, id: Option<ImportId>) -> rusqlite::Result<()> {
    connection.execute("UPDATE project SET imported = ?1", [id.map(|id| integer(id.0))])?;
    Ok(())
}

/// Deletes the label images that no edit names and that are not in force: edits that were undone and replaced
/// brought them.
pub(super) fn delete_unnamed(connection: &Connection) -> rusqlite::Result<()> {
    connection.execute_batch(
        "DELETE FROM import WHERE id NOT IN (
             SELECT imported FROM project WHERE imported IS NOT NULL
             UNION SELECT json_extract(change, '$.imported.before') FROM edit
                   WHERE json_extract(change, '$.imported.before') IS NOT NULL
             UNION SELECT json_extract(change, '$.imported.after') FROM edit
                   WHERE json_extract(change, '$.imported.after') IS NOT NULL);
         DELETE FROM imported_map WHERE import NOT IN (SELECT id FROM import)",
    )
}

/// Reads all label images. A person gave them and they are nowhere else: one that cannot be read is damage.
pub(super) fn read(
    connection: &Connection,
    path: &Path,
    scene: &SceneRecord,
) -> Result<Imports, ProjectError> {
    let reading = |error| ProjectError::reading(path, &error);
    // A file of version 1 that cannot be written has no such tables.
    if schema::version(connection).map_err(reading)? < 2 {
        return Ok((BTreeMap::new(), None));
    }
    let kinds = rows(connection, "SELECT id, trust FROM import", |row| {
        let trust: String = row.get(1)?;
        let trust = if trust == "trusted" {
            Trust::Trusted
        } else {
            Trust::Votes
        };
        Ok((ImportId(unsigned(row, 0)? as u64), trust))
    });
    let stored = "SELECT import, frame, labels FROM imported_map ORDER BY import, frame";
    let stored = rows(connection, stored, |row| {
        let id = ImportId(unsigned(row, 0)? as u64);
        Ok((id, unsigned(row, 1)?, row.get::<_, Vec<u8>>(2)?))
    });
    let decode = |(id, frame, png): &(ImportId, usize, Vec<u8>)| {
        let record = scene.frames.get(*frame).ok_or("it is of no frame")?;
        let labels = png::decode_gray_sized(png, record.width, record.height)?;
        Ok((*id, ImportedMap::new(*frame, &labels)))
    };
    let decoded: Result<Vec<(ImportId, ImportedMap)>, String> =
        stored.map_err(reading)?.par_iter().map(decode).collect();
    let decoded = decoded.map_err(|reason| {
        ProjectError::damaged(path, format!("an imported label image is unusable: {reason}"))
    })?;
    let mut maps: BTreeMap<ImportId, Vec<ImportedMap>> = BTreeMap::new();
    for (id, map) in decoded {
        maps.entry(id).or_default().push(map);
    }
    let imports = kinds.map_err(reading)?.into_iter().map(|(id, trust)| {
        let maps = maps.remove(&id).unwrap_or_default();
        (id, Arc::new(ImportedLabels { maps, trust }))
    });
    let imports: BTreeMap<ImportId, Arc<ImportedLabels>> = imports.collect();
    let in_force: Option<i64> = connection
        .query_row("SELECT imported FROM project", [], |row| row.get(0))
        .map_err(reading)?;
    let in_force = in_force.and_then(|id| u64::try_from(id).ok()).map(ImportId);
    if in_force.is_some_and(|id| !imports.contains_key(&id)) {
        return Err(ProjectError::damaged(path, "imported label images are missing"));
    }
    Ok((imports, in_force))
}
