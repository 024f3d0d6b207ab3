//! `inplace info`: what was found in a capture.

use std::path::Path;

use inplace_core::eval::GroundTruth;
use inplace_core::field::{Capacity, Preset, Volume};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
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
    let facts = facts(&scene);
    if as_json {
        println!("{facts:#}");
    } else {
        print(&facts);
    }
    Ok(())
}

fn facts(scene: &Scene) -> Value {
    let bounds = scene.bounds();
    let volume = Volume::around(&bounds);
    let capacity = Capacity::for_scene(scene, &volume, Preset::Auto);
    let with_depth = scene.frames.iter().filter_map(|frame| frame.depth.as_ref());
    let coverage: Vec<f32> = with_depth.map(|depth| depth.coverage()).collect();
    let labelled = match &scene.source {
        SceneSource::Demo => scene.frames.len(),
        SceneSource::Folder(folder) => GroundTruth::find(folder).map_or(0, |truth| truth.numbers().count()),
    };
    let camera = scene.frames.first().map(|frame| frame.camera);
    json!({
        "scene": scene.source.to_string(),
        "format": scene.format,
        "frames": scene.frames.len(),
        "width": camera.map(|camera| camera.width),
        "height": camera.map(|camera| camera.height),
        "intrinsics": camera.map(|camera| [camera.fx, camera.fy, camera.cx, camera.cy]),
        "frames_with_depth": coverage.len(),
        "depth_coverage": (!coverage.is_empty()).then(|| coverage.iter().sum::<f32>() / coverage.len() as f32),
        "frames_with_labels": labelled,
        "bounds_min_m": (bounds.min.as_dvec3() + scene.origin).to_array(),
        "bounds_max_m": (bounds.max.as_dvec3() + scene.origin).to_array(),
        "capacity": capacity.to_string(),
        "warnings": scene.warnings,
    })
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
    println!("intrinsics  fx fy cx cy = {}", text("intrinsics"));
    match facts["depth_coverage"].as_f64() {
        Some(coverage) => println!(
            "depth       in {} frames, on {:.0}% of their pixels",
            text("frames_with_depth"),
            100.0 * coverage
        ),
        None => println!("depth       none"),
    }
    println!("labels      in {} frames (not used)", text("frames_with_labels"));
    println!(
        "bounds      {} to {} m",
        text("bounds_min_m"),
        text("bounds_max_m")
    );
    println!("model       {}", text("capacity"));
    for warning in facts["warnings"].as_array().into_iter().flatten() {
        println!("warning     {}", warning.as_str().unwrap_or_default());
    }
}
