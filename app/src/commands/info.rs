//! `inplace info`: what was found in a capture.

use std::path::Path;

use inplace_core::eval::GroundTruth;
use inplace_core::field::{Capacity, Preset, Volume};
use inplace_core::scene::{Frame, OpenOptions, Scene, SceneSource};
use serde_json::{Value, json};

use super::Failure;
use super::progress::Progress;

/// Opens the capture and tells what it holds.
pub fn run(argument: &Path, as_json: bool) -> Result<(), Failure> {
    let source = SceneSource::from_argument(argument);
    let progress = std::sync::Mutex::new(Progress::new());
    let scene = Scene::open(&source, OpenOptions::default(), &|done, total| {
        if let Ok(mut progress) = progress.lock() {
            progress.show(&format!("reading frame {done} of {total}"));
        }
    })?;
    drop(progress);
    let facts = facts(&scene)?;
    if as_json {
        println!("{facts:#}");
    } else {
        print(&facts);
    }
    Ok(())
}

fn facts(scene: &Scene) -> Result<Value, Failure> {
    let bounds = scene.bounds();
    let volume = Volume::around(&bounds);
    let capacity = Capacity::for_scene(scene, &volume, Preset::Auto)?;
    let coverage: Vec<f32> = scene.frames.iter().filter_map(Frame::depth_coverage).collect();
    let labelled = match &scene.source {
        SceneSource::Demo => scene.frames.len(),
        SceneSource::Folder(folder) => GroundTruth::find(folder).map_or(0, |truth| truth.numbers().count()),
    };
    let image = scene.frames.first().map(|frame| *frame.image());
    let sparse: Vec<usize> = scene.frames.iter().map(|frame| frame.points.len()).collect();
    // In the capture's own coordinates, but in metres: they are named so.
    let metres = |position| (scene.to_capture(position) / scene.unit).to_array();
    Ok(json!({
        "scene": scene.source.to_string(),
        "format": scene.format,
        "frames": scene.frames.len(),
        "keyframes": scene.keyframes().len(),
        "width": image.map(|camera| camera.width),
        "height": image.map(|camera| camera.height),
        "intrinsics": image.map(|camera| [camera.fx, camera.fy, camera.cx, camera.cy]),
        "frames_with_distortion": scene.frames.iter().filter(|frame| frame.lens.is_some()).count(),
        "frames_with_depth": coverage.len(),
        "depth_coverage": (!coverage.is_empty()).then(|| coverage.iter().sum::<f32>() / coverage.len() as f32),
        "frames_with_points": sparse.iter().filter(|&&points| points > 0).count(),
        "sparse_points": sparse.iter().sum::<usize>(),
        "frames_with_labels": labelled,
        "bounds_min_m": metres(bounds.min),
        "bounds_max_m": metres(bounds.max),
        "capture_units_per_m": scene.unit,
        "capacity": capacity.to_string(),
        "notes": scene.notes,
        "warnings": scene.warnings,
    }))
}

fn print(facts: &Value) {
    let text = |key: &str| match &facts[key] {
        Value::String(text) => text.clone(),
        Value::Array(values) => values
            .iter()
            .map(|value| format!("{:.2}", value.as_f64().unwrap_or_default()))
            .collect::<Vec<_>>()
            .join(" "),
        other => other.to_string(),
    };
    println!("scene       {}", text("scene"));
    println!("format      {}", text("format"));
    println!(
        "frames      {} of {} x {} pixels",
        text("frames"),
        text("width"),
        text("height")
    );
    if facts["keyframes"] != facts["frames"] {
        println!("keyframes   {} of {}", text("keyframes"), text("frames"));
    }
    println!("intrinsics  fx fy cx cy = {}", text("intrinsics"));
    if facts["frames_with_distortion"] != 0 {
        println!("distortion  undone in {} frames", text("frames_with_distortion"));
    }
    match facts["depth_coverage"].as_f64() {
        Some(coverage) => println!(
            "depth       in {} frames, on {:.0}% of their pixels",
            text("frames_with_depth"),
            100.0 * coverage
        ),
        None => println!("depth       none"),
    }
    if facts["sparse_points"] != 0 {
        println!(
            "points      {} in {} frames",
            text("sparse_points"),
            text("frames_with_points")
        );
    }
    println!("labels      in {} frames (not used)", text("frames_with_labels"));
    println!(
        "bounds      {} to {} m",
        text("bounds_min_m"),
        text("bounds_max_m")
    );
    println!("model       {}", text("capacity"));
    for note in facts["notes"].as_array().into_iter().flatten() {
        println!("note        {}", note.as_str().unwrap_or_default());
    }
    for warning in facts["warnings"].as_array().into_iter().flatten() {
        println!("warning     {}", warning.as_str().unwrap_or_default());
    }
}
