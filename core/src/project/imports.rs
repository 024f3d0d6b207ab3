//! The rows of label images from elsewhere.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;
use rusqlite::{Connection, params};

use super::columns::{execute, integer, rows, unsigned};
use super::consistency::is_id;
use super::error::Fault;
use super::{SceneRecord, schema};
use crate::labels::{
    ClassId, History, ImportId, ImportedLabels, ImportedMap, Label, ObjectId, Probabilities, Trust, VOID, png,
};
use crate::scene::ImageError;

const IMPORTS: &str = "SELECT id, trust FROM import";

/// The label images that a history names, and those in force.
type Imports = (BTreeMap<ImportId, Arc<ImportedLabels>>, Option<ImportId>);

/// The PNGs of a map: its labels, and the shares of its probabilities and its objects where it has them.
type EncodedMap = [Option<Vec<u8>>; 3];

/// Replaces all label images by those of the frames that the project lists, and tells which are in force.
pub(super) fn write_all(connection: &Connection, history: &History) -> rusqlite::Result<()> {
    connection.execute_batch("DELETE FROM import; DELETE FROM imported_map")?;
    let (imports, in_force) = history.imports();
    for (&id, images) in imports {
        write(connection, id, images)?;
    }
    put_in_force(connection, in_force)
}

/// Adds label images of the frames that the project lists.
pub(super) fn write(connection: &Connection, id: ImportId, images: &ImportedLabels) -> rusqlite::Result<()> {
    let sizes = "SELECT width, height FROM frame ORDER BY number";
    let sizes = rows(connection, sizes, |row| Ok((row.get(0)?, row.get(1)?)))?;
    let trust = f64::from(images.trust.value());
    let insert = "INSERT OR REPLACE INTO import (id, trust) VALUES (?1, ?2)";
    execute(connection, insert, params![integer(id.0), trust])?;
    let png = |width: u32, height: u32, labels: &[ClassId]| {
        let png = png::encode_labels(width, height, labels);
        png.map_err(|error| rusqlite::Error::ToSqlConversionFailure(error.into()))
    };
    let encode = |map: &ImportedMap| {
        let Some(probabilities) = map.probabilities() else {
            let (width, height) = sizes.get(map.frame).copied().unwrap_or_default();
            let objects = map.objects().map(|objects| {
                let numbers = objects.iter().map(|object| object.map_or(0, ObjectId::number));
                png(width, height, &numbers.collect::<Vec<u16>>())
            });
            return Ok([
                Some(png(width, height, &map.labels())?),
                None,
                objects.transpose()?,
            ]);
        };
        let [width, _] = probabilities.size();
        let (classes, steps) = probabilities.planes();
        let height = classes.len() as u32 / width;
        Ok([
            Some(png(width, height, &classes)?),
            Some(png(width, height, &steps)?),
            None,
        ])
    };
    let encoded: rusqlite::Result<Vec<EncodedMap>> = images.maps.par_iter().map(encode).collect();
    let insert = "INSERT OR REPLACE INTO imported_map (import, frame, labels, shares, objects) VALUES (?1, ?2, ?3, ?4, ?5)";
    for (map, [labels, shares, objects]) in images.maps.iter().zip(encoded?) {
        let row = params![integer(id.0), integer(map.frame), labels, shares, objects];
        execute(connection, insert, row)?;
    }
    Ok(())
}

/// Tells which label images are in force.
pub(super) fn put_in_force(connection: &Connection, id: Option<ImportId>) -> rusqlite::Result<()> {
    let id = id.map(|id| integer(id.0));
    execute(connection, "UPDATE project SET imported = ?1", [id])
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
pub(super) fn read(connection: &Connection, scene: &SceneRecord) -> Result<Imports, Fault> {
    // Files of earlier versions that cannot be written keep the tables that they have.
    let (imports, maps) = match schema::version(connection)? {
        1 => return Ok((BTreeMap::new(), None)),
        2 => (schema::IMPORTS_OF_2, schema::MAPS_OF_2),
        3 => (IMPORTS, schema::MAPS_OF_3),
        _ => (
            IMPORTS,
            "SELECT import, frame, labels, shares, objects FROM imported_map ORDER BY import, frame",
        ),
    };
    let kinds = rows(connection, imports, |row| {
        Ok((ImportId(unsigned(row, 0)? as u64), row.get::<_, f64>(1)?))
    })?;
    let stored = rows(connection, maps, |row| {
        let id = ImportId(unsigned(row, 0)? as u64);
        Ok((id, unsigned(row, 1)?, [row.get(2)?, row.get(3)?, row.get(4)?]))
    })?;
    let decode = |(id, frame, images): &(ImportId, usize, EncodedMap)| {
        let record = scene
            .frames
            .get(*frame)
            .ok_or(ImageError::Misfit("it is of no frame"))?;
        let map = decoded(*frame, [record.width, record.height], images)?;
        Ok((*id, map))
    };
    let decoded: Result<Vec<(ImportId, ImportedMap)>, ImageError> = stored.par_iter().map(decode).collect();
    let decoded =
        decoded.map_err(|reason| Fault::Damage(format!("an imported label image is unusable: {reason}")))?;
    if let Some((id, _)) = kinds.iter().find(|(id, _)| !is_id(id.0)) {
        return Err(Fault::Damage(format!("no import has the number {}", id.0)));
    }
    let mut maps: BTreeMap<ImportId, Vec<ImportedMap>> = BTreeMap::new();
    for (id, map) in decoded {
        maps.entry(id).or_default().push(map);
    }
    let imports = kinds.into_iter().map(|(id, trust)| {
        let trust = Trust::new(trust as f32)?;
        let maps = maps.remove(&id).unwrap_or_default();
        Some((id, Arc::new(ImportedLabels { maps, trust })))
    });
    let imports: Option<BTreeMap<ImportId, Arc<ImportedLabels>>> = imports.collect();
    let imports = imports.ok_or_else(|| Fault::damage("the trust in imported labels is not from 0 to 1"))?;
    let in_force: Option<i64> = connection.query_row("SELECT imported FROM project", [], |row| row.get(0))?;
    let in_force = in_force.and_then(|id| u64::try_from(id).ok()).map(ImportId);
    if in_force.is_some_and(|id| !imports.contains_key(&id)) {
        return Err(Fault::damage("imported label images are missing"));
    }
    Ok((imports, in_force))
}

/// The image of a frame of this size, from its PNGs.
fn decoded(
    frame: usize,
    size: [u32; 2],
    [labels, shares, objects]: &EncodedMap,
) -> Result<ImportedMap, ImageError> {
    let [width, height] = size;
    let labels = labels.as_deref().unwrap_or_default();
    let Some(shares) = shares else {
        let labels = png::decode_gray_sized(labels, width, height)?;
        let Some(objects) = objects else {
            return Ok(ImportedMap::new(frame, &labels));
        };
        let objects = png::decode_gray_sized(objects, width, height)?;
        let label = |(&class, &number): (&ClassId, &u16)| {
            Label::new(class, ObjectId::new(number).filter(|_| class != VOID))
        };
        let labels: Vec<Label> = labels.iter().zip(&objects).map(label).collect();
        return Ok(ImportedMap::with_objects(frame, &labels));
    };
    let misfit = || ImageError::Misfit("it fits no frame");
    // A plane for each of the classes that are kept, and at most a cell for each pixel.
    let fits = |[across, down]: &[u32; 2]| {
        *across <= width && u64::from(*down) <= Probabilities::KEPT as u64 * u64::from(height)
    };
    let told = png::told_size(labels).filter(fits).ok_or_else(misfit)?;
    let (width, _, labels) = png::decode_gray(labels)?;
    let shares = png::decode_gray_sized(shares, told[0], told[1])?;
    let probabilities = Probabilities::from_planes(size, width, &labels, &shares);
    Ok(ImportedMap::of_probabilities(
        frame,
        probabilities.ok_or_else(misfit)?,
    ))
}
