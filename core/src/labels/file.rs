//! The strokes file: JSON that a person or a script can write.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::raster::redrawn;
use super::{Class, ClassId, LabelSet, Pixel, Stroke, StrokeId, VOID};
use crate::scene::{Frame, Scene, shown};

/// A strokes file that cannot be used; nothing of it is taken over.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", shown(.path.display()))]
pub struct StrokesError {
    path: PathBuf,
    reason: String,
}

#[derive(Serialize, Deserialize)]
struct StrokesFile {
    classes: Vec<Class>,
    strokes: Vec<StrokeRecord>,
}

#[derive(Serialize, Deserialize)]
struct StrokeRecord {
    frame: String,
    class: ClassId,
    points: Vec<Pixel>,
    #[serde(default)]
    radius: u32,
}

/// Reads a strokes file for a scene.
///
/// # Errors
/// An unreadable file, a class that is listed twice or not at all, an unknown frame, a point outside
/// the image: a sentence that names it.
pub fn read_strokes(path: &Path, scene: &Scene) -> Result<LabelSet, StrokesError> {
    let error = |reason: String| StrokesError {
        path: path.to_path_buf(),
        reason,
    };
    let text = std::fs::read_to_string(path).map_err(|e| error(format!("cannot be read: {e}")))?;
    parse_strokes(&text, scene).map_err(error)
}

/// The strokes in the text of a strokes file for a scene.
///
/// # Errors
/// What [`read_strokes`] refuses: a part of a sentence that says what is wrong.
pub fn parse_strokes(text: &str, scene: &Scene) -> Result<LabelSet, String> {
    let file = serde_json::from_str(text).map_err(|error| format!("is not a strokes file: {error}"));
    // A frame can be called by anything.
    file.and_then(|file| parse(file, scene)).map_err(shown)
}

fn parse(file: StrokesFile, scene: &Scene) -> Result<LabelSet, String> {
    let mut labels = LabelSet::default();
    for class in file.classes {
        if class.id == VOID {
            continue;
        }
        if labels.class(class.id).is_some() {
            return Err(format!(
                "class {} is listed twice; give each class its own id",
                class.id
            ));
        }
        labels.classes.push(class);
    }
    for (number, record) in file.strokes.into_iter().enumerate() {
        let place = format!("stroke {}", number + 1);
        let Some(index) = scene.frame_index(&record.frame) else {
            return Err(format!(
                "{place} names frame \"{}\", which {} does not have",
                record.frame, scene.source
            ));
        };
        if record.class != VOID && labels.class(record.class).is_none() {
            return Err(format!(
                "{place} names class {}, which \"classes\" does not list",
                record.class
            ));
        }
        let frame = &scene.frames[index];
        let image = frame.image();
        if let Some([x, y]) = record
            .points
            .iter()
            .find(|[x, y]| *x >= image.width || *y >= image.height)
        {
            return Err(format!(
                "{place} has the point [{x}, {y}], which is outside frame \"{}\" ({}x{} pixels)",
                record.frame, image.width, image.height
            ));
        }
        if record.points.is_empty() {
            return Err(format!("{place} has no points"));
        }
        if let Some([x, y]) = record
            .points
            .iter()
            .find(|&&point| frame.of_image(point).is_none())
        {
            return Err(format!(
                "{place} has the point [{x}, {y}], which the lens of frame \"{}\" bends too much to be used",
                record.frame
            ));
        }
        let line = match frame.lens {
            None => record.points,
            Some(_) => redrawn(&record.points, |point| frame.of_image(point)),
        };
        let stroke = Stroke {
            frame: index,
            class: record.class,
            radius: record.radius,
            lines: vec![line],
        };
        labels
            .strokes
            .insert(StrokeId(number as u64 + 1), Arc::new(stroke));
    }
    Ok(labels)
}

/// The labels as the text of a strokes file, in pixels of the frames' images on disk. Strokes on frames that
/// the scene does not have are left out.
///
/// A stroke with several lines (a filled polygon, or one of which parts were erased) becomes one entry per line.
pub fn strokes_json(labels: &LabelSet, frames: &[Frame]) -> String {
    let mut records = Vec::new();
    for stroke in labels.strokes.values() {
        let Some(frame) = frames.get(stroke.frame) else {
            continue;
        };
        for line in &stroke.lines {
            let points = match frame.lens {
                None => line.clone(),
                Some(_) => redrawn(line, |point| frame.to_image(point)),
            };
            // What was drawn where the image does not reach says nothing about it.
            if !points.is_empty() {
                records.push(StrokeRecord {
                    frame: frame.stem.clone(),
                    class: stroke.class,
                    points,
                    radius: stroke.radius,
                });
            }
        }
    }
    let file = StrokesFile {
        classes: labels.classes.clone(),
        strokes: records,
    };
    // Plain structs of numbers and strings always have a JSON form.
    serde_json::to_string_pretty(&file).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{erase, rasterise};
    use crate::scene::testing::wall;
    use crate::scene::{Distortion, Lens};

    /// The wall as an image of a barrel lens.
    fn bent() -> Scene {
        let mut scene = wall(1, 64, 48);
        let frame = &mut scene.frames[0];
        let lens = Lens {
            image: frame.camera,
            distortion: Distortion {
                k1: -0.05,
                ..Distortion::default()
            },
        };
        frame.camera = lens.pinhole().unwrap();
        frame.lens = Some(lens);
        scene
    }

    #[test]
    fn strokes_on_bent_images_are_moved_to_the_frame_and_back() {
        let scene = bent();
        let frame = &scene.frames[0];
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("strokes.json");
        let points = [[0, 0], [63, 0], [60, 40]];
        let file = StrokesFile {
            classes: vec![Class::new(1, "wall")],
            strokes: vec![StrokeRecord {
                frame: "rgb_0".to_owned(),
                class: 1,
                points: points.to_vec(),
                radius: 0,
            }],
        };
        std::fs::write(&path, serde_json::to_string(&file).unwrap()).unwrap();
        let labels = read_strokes(&path, &scene).unwrap();
        let line = &labels.strokes[&StrokeId(1)].lines[0];
        assert_eq!(line.first().copied(), frame.of_image(points[0]));
        assert_eq!(line.last().copied(), frame.of_image(points[2]));
        // The border of a barrel image is a curve in the straight one.
        assert!(line.len() > 3 && line.iter().any(|[_, y]| *y > line[0][1] + 1));

        let back: StrokesFile = serde_json::from_str(&strokes_json(&labels, &scene.frames)).unwrap();
        let [record] = back.strokes.as_slice() else {
            panic!()
        };
        assert!(record.points.iter().all(|[x, y]| *x < 64 && *y < 48));
        for corner in points {
            let close =
                |point: &Pixel| point[0].abs_diff(corner[0]) <= 1 && point[1].abs_diff(corner[1]) <= 1;
            assert!(record.points.iter().any(close), "{corner:?} {:?}", record.points);
        }
    }

    #[test]
    fn polygons_come_back_from_the_file_to_the_pixel() {
        let scene = wall(2, 64, 48);
        let mut labels = LabelSet::default();
        labels.classes.push(Class::new(1, "wall"));
        let polygon = Stroke::polygon(1, 1, &[[3, 4], [50, 10], [30, 40], [20, 12], [6, 30]]);
        let erased = erase(&polygon, &[[25, 0], [25, 47]], 2).unwrap();
        let void = Stroke::polygon(1, VOID, &[[40, 2], [60, 2], [60, 20]]);
        for (id, stroke) in (1..).zip([erased, void]) {
            labels.strokes.insert(StrokeId(id), Arc::new(stroke));
        }
        let file = serde_json::from_str(&strokes_json(&labels, &scene.frames)).unwrap();
        let back = parse(file, &scene).unwrap();
        let classes = |labels: &LabelSet| -> Vec<(u32, ClassId)> {
            let pixels = rasterise(labels, 1, 64, 48).into_iter();
            pixels.map(|(pixel, (class, _))| (pixel, class)).collect()
        };
        assert_eq!(classes(&back), classes(&labels));
        assert!(classes(&back).len() > 500);
    }

    #[test]
    fn a_point_is_outside_when_it_is_outside_the_image_on_disk() {
        let scene = bent();
        assert!(scene.frames[0].camera.width > 64);
        let file = |point: Pixel| StrokesFile {
            classes: vec![Class::new(1, "wall")],
            strokes: vec![StrokeRecord {
                frame: "rgb_0".to_owned(),
                class: 1,
                points: vec![point],
                radius: 0,
            }],
        };
        assert!(parse(file([63, 47]), &scene).is_ok());
        let refused = parse(file([64, 3]), &scene).unwrap_err();
        assert!(
            refused.contains("[64, 3]") && refused.contains("64x48"),
            "{refused}"
        );
    }
}
