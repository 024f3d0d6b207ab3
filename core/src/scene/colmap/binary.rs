//! Models in binary files: little endian, a count and then the records.

use std::path::Path;

use glam::DVec3;

use super::model::{
    Model, ModelCamera, ModelImage, ModelPoint, Observation, Readers, add_camera, model_numbered,
};
use crate::scene::SceneError;
use crate::scene::error::refusal;

/// Id of a point that is none.
const NO_POINT: u64 = u64::MAX;

/// What reads cameras, images and points.
pub(super) const READERS: Readers = [read_cameras, read_images, read_points];

fn read_cameras(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let mut file = Records::new(path, bytes, "camera", 24)?;
    while file.next() {
        let id = file.u32()?;
        let kind = model_numbered(path, id, file.u32()? as i32)?;
        let size = [file.u64()?, file.u64()?];
        let parameters = (0..kind.1)
            .map(|_| file.f64())
            .collect::<Result<Vec<f64>, SceneError>>()?;
        let camera = ModelCamera::new(path, id, kind, size, &parameters)?;
        add_camera(path, model, id, camera)?;
    }
    file.finish()
}

fn read_images(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let mut file = Records::new(path, bytes, "image", 73)?;
    while file.next() {
        let _id = file.u32()?;
        let rotation = [file.f64()?, file.f64()?, file.f64()?, file.f64()?];
        let translation = DVec3::new(file.f64()?, file.f64()?, file.f64()?);
        let camera = file.u32()?;
        let name = file.text()?;
        let mut observations = Vec::new();
        for _ in 0..file.count(24)? {
            let (x, y, point) = (file.f64()?, file.f64()?, file.u64()?);
            if point != NO_POINT {
                observations.push(Observation { x, y, point });
            }
        }
        model.images.push(ModelImage {
            name,
            rotation,
            translation,
            camera,
            observations,
        });
    }
    file.finish()
}

fn read_points(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let mut file = Records::new(path, bytes, "point", 51)?;
    while file.next() {
        let id = file.u64()?;
        let position = DVec3::new(file.f64()?, file.f64()?, file.f64()?);
        let _color: [u8; 3] = file.take()?;
        let error = file.f64()?;
        let views = file.count(8)?;
        for _ in 0..views {
            file.u64()?;
        }
        let point = ModelPoint {
            position,
            error,
            views,
        };
        model.points.insert(id, point);
    }
    file.finish()
}

/// A file that is read record by record. Nothing is believed of a count but what the file has bytes for.
struct Records<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// What has not been read yet.
    rest: &'a [u8],
    /// What a record is.
    what: &'static str,
    count: u64,
    /// Number of the record that is being read, from 1.
    number: u64,
}

impl<'a> Records<'a> {
    /// Reads the count of records, each of at least `smallest` bytes.
    fn new(path: &'a Path, bytes: &'a [u8], what: &'static str, smallest: u64) -> Result<Self, SceneError> {
        let mut records = Self {
            path,
            bytes,
            rest: bytes,
            what,
            count: 0,
            number: 0,
        };
        records.count = records.count(smallest)?;
        Ok(records)
    }

    /// Goes on to the next record; `false` after the last.
    fn next(&mut self) -> bool {
        self.number += 1;
        self.number <= self.count
    }

    /// A count of things of at least `smallest` bytes, all of which the file still has room for.
    fn count(&mut self, smallest: u64) -> Result<u64, SceneError> {
        let count = self.u64()?;
        if count > self.rest.len() as u64 / smallest {
            return Err(self.truncated());
        }
        Ok(count)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], SceneError> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or_else(|| self.truncated())?;
        self.rest = rest;
        Ok(*bytes)
    }

    fn u32(&mut self) -> Result<u32, SceneError> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, SceneError> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, SceneError> {
        self.take().map(f64::from_le_bytes)
    }

    /// Text up to a zero byte.
    fn text(&mut self) -> Result<String, SceneError> {
        let end = self.rest.iter().position(|&byte| byte == 0);
        let end = end.ok_or_else(|| self.truncated())?;
        let text = std::str::from_utf8(&self.rest[..end]).map_err(|_| {
            refusal!(
                self.path,
                "{} {} has a name that is not UTF-8; rename the image",
                self.what,
                self.number
            )
        })?;
        self.rest = &self.rest[end + 1..];
        Ok(text.to_owned())
    }

    fn truncated(&self) -> SceneError {
        let place = match self.number {
            0 => "before its first record".to_owned(),
            number => format!("inside {} {number} of {}", self.what, self.count),
        };
        refusal!(
            self.path,
            "is truncated or spoilt: its {} bytes end {place}; copy the model again",
            self.bytes.len()
        )
    }

    /// Refuses bytes after the last record.
    fn finish(&self) -> Result<(), SceneError> {
        if self.rest.is_empty() {
            return Ok(());
        }
        Err(refusal!(
            self.path,
            "is spoilt: {} bytes follow its last {}, number {}; copy the model again",
            self.rest.len(),
            self.what,
            self.count
        ))
    }
}
