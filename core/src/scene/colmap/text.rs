//! Models in text files: fields separated by spaces, lines that start with # do not count.

use std::path::Path;
use std::str::{FromStr, SplitWhitespace};

use glam::DVec3;

use super::model::{
    Model, ModelCamera, ModelImage, ModelPoint, Observation, Readers, add_camera, model_named,
};
use crate::scene::SceneError;
use crate::scene::error::{refusal, refuse};

/// What reads cameras, images and points.
pub(super) const READERS: Readers = [read_cameras, read_images, read_points];

/// `ID MODEL WIDTH HEIGHT PARAMETERS...`
fn read_cameras(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let text = text_of(path, bytes)?;
    for mut line in lines(path, text).filter(Line::counts) {
        let id = line.number("a camera's id")?;
        let kind = model_named(path, id, line.word("a camera model")?)?;
        let size = [line.number("a width")?, line.number("a height")?];
        let mut parameters = Vec::new();
        while line.has_more() {
            parameters.push(line.number("a parameter")?);
        }
        let camera = ModelCamera::new(path, id, kind, size, &parameters)?;
        add_camera(path, model, id, camera)?;
    }
    Ok(())
}

/// Two lines each: `ID QW QX QY QZ TX TY TZ CAMERA NAME` and `X Y POINT ...`, the second of which may be
/// empty.
fn read_images(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let text = text_of(path, bytes)?;
    let mut lines = lines(path, text);
    while let Some(mut line) = lines.find(Line::counts) {
        let _id: u32 = line.number("an image's id")?;
        let mut next = || line.number("a part of a pose");
        let rotation = [next()?, next()?, next()?, next()?];
        let translation = DVec3::new(next()?, next()?, next()?);
        let camera = line.number("a camera's id")?;
        let name = line.remainder("an image's name")?;
        let Some(mut line) = lines.next() else {
            refuse!(
                path,
                "is truncated: image {name:?} has no line with its points; copy the model again"
            );
        };
        let mut observations = Vec::new();
        while line.has_more() {
            let (x, y) = (line.number("a column")?, line.number("a row")?);
            let point: i64 = line.number("a point's id")?;
            if let Ok(point) = u64::try_from(point) {
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
    Ok(())
}

/// `ID X Y Z R G B ERROR (IMAGE INDEX)...`
fn read_points(path: &Path, bytes: &[u8], model: &mut Model) -> Result<(), SceneError> {
    let text = text_of(path, bytes)?;
    for mut line in lines(path, text).filter(Line::counts) {
        let id = line.number("a point's id")?;
        let mut next = || line.number("a coordinate");
        let position = DVec3::new(next()?, next()?, next()?);
        for _ in 0..3 {
            line.number::<u8>("a colour")?;
        }
        let error = line.number("an error")?;
        let mut views = 0;
        while line.has_more() {
            line.number::<u64>("an image's id")?;
            line.number::<u64>("the index of a place")?;
            views += 1;
        }
        let point = ModelPoint {
            position,
            error,
            views,
        };
        model.points.insert(id, point);
    }
    Ok(())
}

fn text_of<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, SceneError> {
    std::str::from_utf8(bytes).map_err(|error| refusal!(path, "is not text ({error}); copy the model again"))
}

fn lines<'a>(path: &'a Path, text: &'a str) -> impl Iterator<Item = Line<'a>> {
    (1..)
        .zip(text.trim_start_matches('\u{feff}').lines())
        .map(|(number, text)| Line {
            path,
            number,
            text,
            words: text.split_whitespace(),
        })
}

/// A line that is read word by word.
struct Line<'a> {
    path: &'a Path,
    /// From 1.
    number: usize,
    text: &'a str,
    words: SplitWhitespace<'a>,
}

impl<'a> Line<'a> {
    /// Whether the line is neither empty nor a comment.
    fn counts(&self) -> bool {
        let text = self.text.trim_start();
        !text.is_empty() && !text.starts_with('#')
    }

    fn has_more(&self) -> bool {
        self.words.clone().next().is_some()
    }

    fn word(&mut self, what: &str) -> Result<&'a str, SceneError> {
        self.words.next().ok_or_else(|| {
            refusal!(
                self.path,
                "line {} ends where {what} should follow; copy the model again",
                self.number
            )
        })
    }

    fn number<T: FromStr>(&mut self, what: &str) -> Result<T, SceneError> {
        let word = self.word(what)?;
        word.parse().map_err(|_| {
            let word: String = word.chars().take(20).collect();
            refusal!(
                self.path,
                "line {}: {word:?} is not {what}; correct that line",
                self.number
            )
        })
    }

    /// All that is left of the line, spaces included.
    fn remainder(&mut self, what: &str) -> Result<String, SceneError> {
        let first = self.word(what)?;
        // A word is a part of the line's own text.
        let start = first.as_ptr() as usize - self.text.as_ptr() as usize;
        Ok(self.text[start..].trim_end().to_owned())
    }
}
