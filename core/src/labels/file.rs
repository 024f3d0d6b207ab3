//! The strokes file: JSON that a person or a script can write.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::raster::redrawn;
use super::{Class, ClassId, LabelSet, Object, ObjectId, Pixel, Stroke, StrokeId, VOID, unused_name};
use crate::scene::{Frame, Scene, shown};

/// A strokes file that cannot be used; nothing of it is taken over.
#[derive(Debug, thiserror::Error)]
#[error("{}: {}", shown(.0.display()), .1)]
pub struct StrokesError(PathBuf, String);

#[derive(Serialize, Deserialize)]
struct StrokesFile {
    classes: Vec<Class>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    objects: Vec<Object>,
    strokes: Vec<StrokeRecord>,
}

#[derive(Serialize, Deserialize)]
struct StrokeRecord {
    frame: String,
    class: ClassId,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    object: Option<ObjectId>,
    points: Vec<Pixel>,
    #[serde(default)]
    radius: u32,
    /// The number of the entry whose stroke this is a further line of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part_of: Option<u64>,
}

/// Reads a strokes file for a scene.
///
/// # Errors
/// An unreadable file, a class that is listed twice or not at all, an unknown frame, a point outside
/// the image: a sentence that names it.
pub fn read_strokes(path: &Path, scene: &Scene) -> Result<LabelSet, StrokesError> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        format!("cannot be read ({error}); check that it is there and is text that you may read")
    });
    text.and_then(|text| parse_strokes(&text, scene))
        .map_err(|problem| StrokesError(path.to_path_buf(), problem))
}

/// The strokes in the text of a strokes file for a scene.
///
/// # Errors
/// What [`read_strokes`] refuses: part of a sentence. Strokes are counted from 1.
pub fn parse_strokes(text: &str, scene: &Scene) -> Result<LabelSet, String> {
    // Some editors save a byte order mark before the text.
    let file = serde_json::from_str(text.trim_start_matches('\u{feff}'));
    let file: StrokesFile = file.map_err(|error| format!("is not a strokes file: {}", shown(error)))?;
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
    for object in file.objects {
        let number = object.id.number();
        let added = add_object(&mut labels, object);
        added.map_err(|reason| shown(format_args!("object {number} {reason}")))?;
    }
    for (number, record) in (1..).zip(file.strokes) {
        let (name, class) = (&record.frame, record.class);
        let refuse = |reason: String| Err(shown(format_args!("stroke {number} {reason}")));
        let Some(index) = scene.frame_index(name) else {
            return refuse(format!(
                "names frame \"{name}\", which {} does not have",
                scene.source
            ));
        };
        if class != VOID && labels.class(class).is_none() {
            return refuse(format!("names class {class}, which \"classes\" does not list"));
        }
        if let Some(id) = record.object {
            match labels.object(id).map(|object| object.class) {
                Some(own) if own == class => {}
                Some(own) => {
                    return refuse(format!(
                        "is of class {class}, and its object {id} of class {own}",
                        id = id.number()
                    ));
                }
                None => {
                    let name = labels.class(class).map_or("", |class| class.name.as_str());
                    let names = labels.objects.iter().map(|object| object.name.as_str());
                    let name = unused_name(name, names);
                    if let Err(reason) = add_object(&mut labels, Object { id, class, name }) {
                        return refuse(format!("names object {}, which {reason}", id.number()));
                    }
                }
            }
        }
        let frame = &scene.frames[index];
        let (width, height) = (frame.image().width, frame.image().height);
        let mut points = record.points.iter();
        if let Some(point) = points.find(|[x, y]| *x >= width || *y >= height) {
            return refuse(format!(
                "has the point {point:?}, which is outside frame \"{name}\" ({width}x{height} pixels)"
            ));
        }
        if record.points.is_empty() {
            return refuse("has no points".to_owned());
        }
        let mut points = record.points.iter();
        if let Some(point) = points.find(|&&point| frame.of_image(point).is_none()) {
            return refuse(format!(
                "has the point {point:?}, which the lens of frame \"{name}\" bends too much to be used"
            ));
        }
        let line = match frame.lens {
            None => record.points,
            Some(_) => redrawn(&record.points, |point| frame.of_image(point)),
        };
        let stroke = Stroke {
            frame: index,
            class,
            object: record.object,
            radius: record.radius,
            lines: vec![line],
        };
        let Some(first) = record.part_of else {
            labels.strokes.insert(StrokeId(number), Arc::new(stroke));
            continue;
        };
        let says = |stroke: &Stroke| (stroke.frame, stroke.class, stroke.object, stroke.radius);
        let whole = labels.strokes.get_mut(&StrokeId(first));
        let Some(whole) = whole.filter(|whole| says(whole) == says(&stroke)) else {
            return refuse(format!(
                "is a part of stroke {first}, which has to come before it, with the same frame, class, object and radius"
            ));
        };
        Arc::make_mut(whole).lines.extend(stroke.lines);
    }
    Ok(labels)
}

/// Adds an object to those of a file, or tells what is wrong with it: part of a sentence.
fn add_object(labels: &mut LabelSet, object: Object) -> Result<(), String> {
    if labels.object(object.id).is_some() {
        return Err("is listed twice; give each object its own id".to_owned());
    }
    match labels.class(object.class) {
        Some(class) if class.thing => {
            labels.objects.push(object);
            Ok(())
        }
        Some(class) => Err(format!(
            "is of class \"{}\", which is stuff; give the class \"thing\": true",
            class.name
        )),
        None => Err(format!(
            "is of class {}, which \"classes\" does not list",
            object.class
        )),
    }
}

/// The labels as the text of a strokes file, in pixels of the frames' images on disk. Strokes on frames that
/// the scene does not have are left out.
///
/// A stroke with several lines (a filled polygon, or one of which parts were erased) becomes one entry per line, each a part
/// of the first. Objects of a class that has become stuff are left out.
pub fn strokes_json(labels: &LabelSet, frames: &[Frame]) -> String {
    let is_thing = |object: &Object| labels.class(object.class).is_some_and(|class| class.thing);
    let objects: Vec<Object> = labels
        .objects
        .iter()
        .filter(|object| is_thing(object))
        .cloned()
        .collect();
    let is_listed = |id: &ObjectId| objects.iter().any(|object| object.id == *id);
    let mut records = Vec::new();
    for stroke in labels.strokes.values() {
        let Some(frame) = frames.get(stroke.frame) else {
            continue;
        };
        let mut first = None;
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
                    object: stroke.object.filter(is_listed),
                    points,
                    radius: stroke.radius,
                    part_of: first,
                });
                first = first.or(Some(records.len() as u64));
            }
        }
    }
    let file = StrokesFile {
        classes: labels.classes.clone(),
        strokes: records,
        objects,
    };
    // Plain structs of numbers and strings always have a JSON form.
    serde_json::to_string_pretty(&file).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::testing::{clicked, named};
    use crate::labels::{erase, rasterise};
    use crate::scene::testing::{bend, wall};

    /// The wall as an image of a barrel lens.
    fn bent() -> Scene {
        let mut scene = wall(1, 64, 48);
        bend(&mut scene.frames[0], -0.05);
        scene
    }

    /// A file with two classes and a stroke on the only frame.
    fn file(points: &[Pixel]) -> serde_json::Value {
        serde_json::json!({
            "classes": [Class::new(1, "wall"), Class::new(2, "floor")],
            "strokes": [{ "frame": "rgb_0", "class": 1, "points": points, "radius": 0, "part_of": null }],
        })
    }

    #[test]
    fn strokes_on_bent_images_are_moved_to_the_frame_and_back() {
        let scene = bent();
        let frame = &scene.frames[0];
        let points = [[0, 0], [63, 0], [60, 40]];
        let labels = parse_strokes(&file(&points).to_string(), &scene).unwrap();
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
    fn strokes_that_cannot_be_used_are_named_with_the_reason() {
        let scene = bent();
        assert!(
            scene.frames[0].camera.width > 64,
            "the size of the image on disk counts"
        );
        assert!(parse_strokes(&format!("\u{feff}{}", file(&[[63, 47]])), &scene).is_ok());
        for (pointer, value, parts) in [
            ("/strokes/0/frame", "\"rgb_77\"", ["stroke 1", "\"rgb_77\""]),
            ("/strokes/0/class", "999", ["stroke 1", "class 999"]),
            ("/strokes/0/points", "[[64, 3]]", ["[64, 3]", "64x48"]),
            ("/strokes/0/points", "[]", ["stroke 1", "no points"]),
            ("/strokes/0/part_of", "1", ["stroke 1", "before it"]),
            ("/strokes/0/points", "[[-1, 0]]", ["-1", "line"]),
            ("/classes/1/id", "1", ["class 1", "twice"]),
        ] {
            let mut file = file(&[[3, 4]]);
            *file.pointer_mut(pointer).unwrap() = serde_json::from_str(value).unwrap();
            let reason = parse_strokes(&file.to_string(), &scene).unwrap_err();
            for part in parts {
                assert!(reason.contains(part), "{pointer} = {value}: {reason}");
            }
        }
    }

    #[test]
    fn objects_come_back_and_are_made_where_only_strokes_name_them() {
        let scene = wall(1, 64, 48);
        let click = |class: u16, object: u16| serde_json::json!({ "frame": "rgb_0", "class": class, "object": object, "points": [[3, 4]] });
        let parse = |strokes: &[serde_json::Value]| {
            let classes = [Class::new(1, "wall"), Class::new(2, "chair")];
            let file = serde_json::json!({ "classes": classes, "strokes": strokes });
            parse_strokes(&file.to_string(), &scene)
        };
        let mut labels = parse(&[click(2, 7), click(2, 3), click(2, 7)]).unwrap();
        assert_eq!(named(&labels.objects), [(7, "chair 1"), (3, "chair 2")]);
        assert_eq!(
            parse_strokes(&strokes_json(&labels, &scene.frames), &scene).unwrap(),
            labels
        );
        for (stroke, part) in [
            (click(1, 1), "stuff"),
            (click(0, 1), "class 0"),
            (click(2, 0), "nonzero"),
        ] {
            let reason = parse(&[stroke]).unwrap_err();
            assert!(reason.contains(part), "{reason}");
        }
        labels.classes[1].thing = false;
        let stuff = parse_strokes(&strokes_json(&labels, &scene.frames), &scene).unwrap();
        assert!(stuff.objects.is_empty() && stuff.strokes.len() == 3, "{stuff:?}");
        let reason = parse(&[click(2, 7), click(1, 7)]).unwrap_err();
        assert!(
            reason.contains("stroke 2 is of class 1, and its object 7 of class 2"),
            "{reason}"
        );
    }

    #[test]
    fn polygons_come_back_from_the_file_to_the_pixel() {
        let scene = wall(2, 64, 48);
        let mut history = clicked(&["wall"], &[]);
        let polygon = Stroke::polygon(1, 1, &[[3, 4], [50, 10], [30, 40], [20, 12], [6, 30]]);
        let erased = erase(&polygon, &[[25, 0], [25, 47]], 2).unwrap();
        let void = Stroke::polygon(1, VOID, &[[40, 2], [60, 2], [60, 20]]);
        for stroke in [erased, void] {
            history.add_stroke(stroke);
        }
        let labels = history.labels();
        let back = parse_strokes(&strokes_json(labels, &scene.frames), &scene).unwrap();
        let classes = |labels: &LabelSet| -> Vec<(u32, ClassId)> {
            let pixels = rasterise(labels, 1, 64, 48).into_iter();
            pixels.map(|(pixel, (class, _))| (pixel, class)).collect()
        };
        assert_eq!(classes(&back), classes(labels));
        assert!(classes(&back).len() > 500);
        let kinds = |labels: &LabelSet| -> Vec<_> { labels.strokes.values().map(|own| own.kind()).collect() };
        assert_eq!(kinds(&back), kinds(labels));
    }
}
