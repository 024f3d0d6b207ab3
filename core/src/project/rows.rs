//! The rows of a project file, written and read.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use rusqlite::{Connection, OptionalExtension, Row, params};

use super::columns::{execute, from_json, integer, json, rows, unsigned};
use super::consistency;
use super::contents::Pending;
use super::error::Fault;
use super::{Contents, FrameRecord, SceneRecord, Step, imports, location, schema};
use crate::labels::{
    CheckChange, Class, Edit, History, LabelSet, Object, ObjectId, Stroke, StrokeId, is_thing, png,
};
use crate::scene::{ImageError, SceneSource};
use crate::session::{FrameMap, ModelState};

/// Replaces scene, labels and history.
pub(super) fn write_all(
    connection: &Connection,
    path: &Path,
    scene: &SceneRecord,
    history: &History,
) -> rusqlite::Result<()> {
    connection.execute_batch("DELETE FROM frame; DELETE FROM stroke; DELETE FROM edit")?;
    let (edits, cursor) = history.edits();
    let project =
        "INSERT OR IGNORE INTO project (id, scene, depth, cursor, written_by) VALUES (1, 'demo', 0, 0, ?1)";
    execute(connection, project, [env!("CARGO_PKG_VERSION")])?;
    write_location(connection, path, scene)?;
    write_cursor(connection, cursor)?;
    let insert = "INSERT INTO frame (number, stem, width, height, bytes) VALUES (?1, ?2, ?3, ?4, ?5)";
    for (number, frame) in scene.frames.iter().enumerate() {
        let bytes = integer(frame.bytes);
        let row = params![integer(number), frame.stem, frame.width, frame.height, bytes];
        execute(connection, insert, row)?;
    }
    write_classes(connection, &history.labels().classes)?;
    write_objects(connection, &history.labels().objects)?;
    for &frame in &history.labels().checked {
        write_checked(connection, CheckChange { frame, after: true })?;
    }
    for (&id, stroke) in &history.labels().strokes {
        write_stroke(connection, id, stroke)?;
    }
    imports::write_all(connection, history)?;
    edits
        .iter()
        .enumerate()
        .try_for_each(|(number, edit)| write_edit(connection, number, edit))
}

/// Writes where the scene is, as seen from a project file at `path`.
pub(super) fn write_location(
    connection: &Connection,
    path: &Path,
    scene: &SceneRecord,
) -> rusqlite::Result<()> {
    let (kind, relative, absolute) = match &scene.source {
        SceneSource::Demo => ("demo", None, None),
        SceneSource::Folder(folder) => (
            "folder",
            location::relative_to(path, folder),
            Some(location::absolute(folder).to_string_lossy().into_owned()),
        ),
    };
    let row = params![kind, relative, absolute, scene.depth, env!("CARGO_PKG_VERSION")];
    let update =
        "UPDATE project SET scene = ?1, relative_path = ?2, absolute_path = ?3, depth = ?4, written_by = ?5";
    execute(connection, update, row)
}

/// Writes one step through the history. A step that leads nowhere changes nothing.
pub(super) fn write_step(connection: &Connection, step: &Step) -> rusqlite::Result<()> {
    let cursor: i64 = connection
        .prepare_cached("SELECT cursor FROM project")?
        .query_row([], |row| row.get(0))?;
    let cursor = usize::try_from(cursor).unwrap_or(0);
    let (edit, after) = match step {
        Step::Import(id, images) => return imports::write(connection, *id, images),
        Step::Do(edit) => {
            let forgotten = connection
                .prepare_cached("DELETE FROM edit WHERE number >= ?1")?
                .execute([integer(cursor)])?;
            write_edit(connection, cursor, edit)?;
            apply(connection, edit)?;
            if forgotten > 0 {
                imports::delete_unnamed(connection)?;
            }
            return write_cursor(connection, cursor + 1);
        }
        Step::Undo => {
            let Some(before) = cursor.checked_sub(1) else {
                return Ok(());
            };
            (read_edit(connection, before)?.map(|edit| edit.inverse()), before)
        }
        Step::Redo => (read_edit(connection, cursor)?, cursor + 1),
    };
    let Some(edit) = edit else {
        return Ok(());
    };
    apply(connection, &edit)?;
    write_cursor(connection, after)
}

fn apply(connection: &Connection, edit: &Edit) -> rusqlite::Result<()> {
    for change in &edit.strokes {
        match &change.after {
            Some(stroke) => write_stroke(connection, change.id, stroke)?,
            None => execute(
                connection,
                "DELETE FROM stroke WHERE id = ?1",
                [integer(change.id.0)],
            )?,
        }
    }
    if let Some((_, after)) = &edit.classes {
        write_classes(connection, after)?;
    }
    if let Some((_, after)) = &edit.objects {
        write_objects(connection, after)?;
    }
    if let Some(change) = edit.checked {
        write_checked(connection, change)?;
    }
    match &edit.imported {
        Some(change) => imports::put_in_force(connection, change.after),
        None => Ok(()),
    }
}

fn write_cursor(connection: &Connection, cursor: usize) -> rusqlite::Result<()> {
    execute(connection, "UPDATE project SET cursor = ?1", [integer(cursor)])
}

fn write_stroke(connection: &Connection, id: StrokeId, stroke: &Stroke) -> rusqlite::Result<()> {
    let insert = "INSERT OR REPLACE INTO stroke (id, frame, class, radius, lines, object) VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
    let (frame, lines) = (integer(stroke.frame), json(&stroke.lines)?);
    let object = stroke.object.map(ObjectId::number);
    let row = params![integer(id.0), frame, stroke.class, stroke.radius, lines, object];
    execute(connection, insert, row)
}

fn write_classes(connection: &Connection, classes: &[Class]) -> rusqlite::Result<()> {
    execute(connection, "DELETE FROM class", [])?;
    let insert =
        "INSERT INTO class (position, id, name, red, green, blue, thing) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    for (position, class) in classes.iter().enumerate() {
        let [red, green, blue] = class.color;
        let row = params![
            integer(position),
            class.id,
            class.name,
            red,
            green,
            blue,
            class.thing
        ];
        execute(connection, insert, row)?;
    }
    Ok(())
}

fn write_objects(connection: &Connection, objects: &[Object]) -> rusqlite::Result<()> {
    execute(connection, "DELETE FROM object", [])?;
    let insert = "INSERT INTO object (position, id, class, name) VALUES (?1, ?2, ?3, ?4)";
    for (position, object) in objects.iter().enumerate() {
        let row = params![integer(position), object.id.number(), object.class, object.name];
        execute(connection, insert, row)?;
    }
    Ok(())
}

fn write_checked(connection: &Connection, change: CheckChange) -> rusqlite::Result<()> {
    let update = "UPDATE frame SET checked = ?2 WHERE number = ?1";
    execute(connection, update, params![integer(change.frame), change.after])
}

fn write_edit(connection: &Connection, number: usize, edit: &Edit) -> rusqlite::Result<()> {
    let row = params![integer(number), json(edit)?];
    execute(
        connection,
        "INSERT INTO edit (number, change) VALUES (?1, ?2)",
        row,
    )
}

/// Number of edits, by the number that the next one would have, and how many of them are in force.
pub(super) fn read_position(connection: &Connection) -> rusqlite::Result<(usize, usize)> {
    let position = "SELECT (SELECT ifnull(max(number) + 1, 0) FROM edit), cursor FROM project";
    connection.query_row(position, [], |row| Ok((unsigned(row, 0)?, unsigned(row, 1)?)))
}

pub(super) fn write_view(connection: &Connection, view: Option<&str>) -> rusqlite::Result<()> {
    execute(connection, "UPDATE project SET view = ?1", [view])
}

pub(super) fn write_model(connection: &Connection, model: &ModelState) -> rusqlite::Result<()> {
    let insert = "INSERT OR REPLACE INTO model (id, steps, tensors) VALUES (1, ?1, ?2)";
    execute(connection, insert, params![integer(model.steps), model.tensors])
}

/// A frame's maps as they are stored.
pub(super) struct MapRow {
    frame: usize,
    generation: u64,
    labels: Vec<u8>,
    entropy: Vec<u8>,
}

impl MapRow {
    pub(super) fn encode(map: &FrameMap) -> Result<Self, ::png::EncodingError> {
        let map = map.looked_up();
        Ok(Self {
            frame: map.frame,
            generation: map.generation,
            labels: png::encode_labels(map.width, map.height, &map.labels())?,
            entropy: png::encode_steps(map.width, map.height, &map.entropy())?,
        })
    }

    pub(super) fn write(&self, connection: &Connection) -> rusqlite::Result<()> {
        let insert =
            "INSERT OR REPLACE INTO map (frame, generation, labels, entropy) VALUES (?1, ?2, ?3, ?4)";
        let (frame, generation) = (integer(self.frame), integer(self.generation));
        execute(
            connection,
            insert,
            params![frame, generation, self.labels, self.entropy],
        )
    }

    fn decode(&self, record: &FrameRecord) -> Result<FrameMap, ImageError> {
        let FrameRecord { width, height, .. } = *record;
        let labels = png::decode_gray_sized(&self.labels, width, height)?;
        let entropy = png::decode_gray_sized(&self.entropy, width, height)?;
        FrameMap::new(self.frame, self.generation, [width, height], labels, entropy)
            .ok_or(ImageError::Misfit("labels or entropy do not fill the image"))
    }
}

/// Reads everything.
pub(super) fn read(connection: &Connection, path: &Path) -> Result<Contents, Fault> {
    let scene = read_scene(connection, path)?;
    let (cursor, view) = connection.query_row("SELECT cursor, view FROM project", [], |row| {
        Ok((unsigned(row, 0)?, row.get(1)?))
    })?;
    // A file that could not be brought up to date knows of no objects and no marks.
    let version = schema::version(connection)?;
    let (classes, strokes, objects, checked) = match version {
        ..4 => (
            "SELECT id, name, red, green, blue, NULL FROM class ORDER BY position",
            "SELECT id, frame, class, radius, lines, NULL FROM stroke",
            Vec::new(),
            Vec::new(),
        ),
        _ => (
            "SELECT id, name, red, green, blue, thing FROM class ORDER BY position",
            "SELECT id, frame, class, radius, lines, object FROM stroke",
            rows(
                connection,
                "SELECT id, class, name FROM object ORDER BY position",
                read_object,
            )?,
            rows(connection, "SELECT number FROM frame WHERE checked", |row| {
                unsigned(row, 0)
            })?,
        ),
    };
    let labels = LabelSet {
        classes: rows(connection, classes, read_class)?,
        objects,
        strokes: rows(connection, strokes, read_stroke)?.into_iter().collect(),
        imported: None,
        checked: checked.into_iter().collect(),
    };
    let edits = "SELECT change FROM edit ORDER BY number";
    let edits: Vec<Edit> = rows(connection, edits, |row| from_json(row, 0))?;
    consistency::check(&labels, &edits, scene.frames.len())?;
    if cursor > edits.len() {
        return Err(Fault::damage("edits are missing"));
    }
    let model = connection
        .query_row("SELECT steps, tensors FROM model", [], |row| {
            Ok(ModelState {
                steps: unsigned(row, 0)? as u64,
                tensors: row.get(1)?,
            })
        })
        .optional()?;
    let (maps, mut warnings) = read_maps(connection, path, &scene)?;
    let (images, in_force) = imports::read(connection, &scene)?;
    let history = History::restored(labels, edits, cursor).with_imports(images, in_force);
    warnings.extend(consistency::warning(path, &history, &scene.stems()));
    Ok(Contents {
        scene,
        history,
        view,
        model: model.map(Arc::new),
        maps,
        warnings,
        pending: Pending::Nothing,
    })
}

/// Reads where the scene is, as seen from a project file at `path`, and its frames.
pub(super) fn read_scene(connection: &Connection, path: &Path) -> Result<SceneRecord, Fault> {
    let frames = "SELECT stem, width, height, bytes FROM frame ORDER BY number";
    let frames = rows(connection, frames, |row| {
        Ok(FrameRecord {
            stem: row.get(0)?,
            width: row.get(1)?,
            height: row.get(2)?,
            bytes: unsigned(row, 3)? as u64,
        })
    })?;
    let scene = "SELECT scene, relative_path, absolute_path, depth FROM project";
    let (source, depth) = connection.query_row(scene, [], |row| {
        let kind: String = row.get(0)?;
        let (relative, absolute): (Option<String>, Option<String>) = (row.get(1)?, row.get(2)?);
        let source = match kind.as_str() {
            "demo" => Some(SceneSource::Demo),
            _ => location::resolve(path, relative.as_deref(), absolute.as_deref()).map(SceneSource::Folder),
        };
        Ok((source, row.get(3)?))
    })?;
    let source = source.ok_or_else(|| Fault::damage("it does not say where its scene is"))?;
    Ok(SceneRecord {
        source,
        depth,
        frames,
    })
}

/// Maps can be made again, so one that cannot be read is a warning.
fn read_maps(
    connection: &Connection,
    path: &Path,
    scene: &SceneRecord,
) -> rusqlite::Result<(Vec<Arc<FrameMap>>, Vec<String>)> {
    let sql = "SELECT frame, generation, labels, entropy FROM map ORDER BY frame";
    let stored = rows(connection, sql, |row| {
        Ok(MapRow {
            frame: unsigned(row, 0)?,
            generation: unsigned(row, 1)? as u64,
            labels: row.get(2)?,
            entropy: row.get(3)?,
        })
    })?;
    let (mut maps, mut warnings) = (Vec::new(), Vec::new());
    let decoded: Vec<_> = stored
        .par_iter()
        .filter_map(|row| Some((row.frame, row.decode(scene.frames.get(row.frame)?))))
        .collect();
    for (frame, map) in decoded {
        match map {
            Ok(map) => maps.push(Arc::new(map)),
            Err(reason) => warnings.push(format!(
                "{}: the saved map of frame {frame} is left out: {reason}",
                path.display()
            )),
        }
    }
    Ok((maps, warnings))
}

fn read_edit(connection: &Connection, number: usize) -> rusqlite::Result<Option<Edit>> {
    connection
        .prepare_cached("SELECT change FROM edit WHERE number = ?1")?
        .query_row([integer(number)], |row| from_json(row, 0))
        .optional()
}

fn read_class(row: &Row<'_>) -> rusqlite::Result<Class> {
    let name: String = row.get(1)?;
    let thing: Option<bool> = row.get(5)?;
    Ok(Class {
        id: row.get(0)?,
        color: [row.get(2)?, row.get(3)?, row.get(4)?],
        thing: thing.unwrap_or_else(|| is_thing(&name)),
        name,
    })
}

fn read_object(row: &Row<'_>) -> rusqlite::Result<Object> {
    let id = read_object_id(row, 0)?;
    Ok(Object {
        id: id.ok_or(rusqlite::Error::IntegralValueOutOfRange(0, 0))?,
        class: row.get(1)?,
        name: row.get(2)?,
    })
}

/// The number of an object; `None` for NULL and 0.
fn read_object_id(row: &Row<'_>, column: usize) -> rusqlite::Result<Option<ObjectId>> {
    let number: Option<u16> = row.get(column)?;
    Ok(number.and_then(ObjectId::new))
}

fn read_stroke(row: &Row<'_>) -> rusqlite::Result<(StrokeId, Arc<Stroke>)> {
    let stroke = Stroke {
        frame: unsigned(row, 1)?,
        class: row.get(2)?,
        object: read_object_id(row, 5)?,
        radius: row.get(3)?,
        lines: from_json(row, 4)?,
    };
    Ok((StrokeId(unsigned(row, 0)? as u64), Arc::new(stroke)))
}
