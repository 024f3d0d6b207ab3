//! `inplace info`: what was found in a capture.

use std::path::Path;

use inplace_core::field::{Capacity, Preset, Volume};
use inplace_core::scene::reprojection::{
    Agreement, CornerAgreement, PixelErrors, PoseRefinement, Unrefined, refine,
};
use inplace_core::scene::{Frame, OpenOptions, Scene, SceneSource, label_images};
use inplace_core::session::Progress;
use serde_json::{Value, json};

use super::Failure;

/// Opens the capture and tells what it holds.
pub fn run(argument: &Path, outside_files: bool, as_json: bool) -> Result<(), Failure> {
    let source = SceneSource::from_argument(argument);
    let progress = Progress::default();
    let options = OpenOptions {
        outside_files,
        ..OpenOptions::default()
    };
    let scene = Scene::open(&source, options, &|done, total| {
        progress.show_share("reading frames", done as f32 / total as f32);
    })?;
    progress.show("comparing frames");
    let agreement = Agreement::of(&scene);
    let refinement = (!scene.has_depth()).then(|| refine(&scene, &|| true).map(|refined| refined.summary));
    drop(progress);
    let facts = facts(&scene, &agreement, refinement.and_then(Result::ok))?;
    if as_json {
        println!("{facts:#}")
    } else {
        print(&facts, &agreement, refinement.as_ref())
    }
}

fn facts(scene: &Scene, agreement: &Agreement, refinement: Option<PoseRefinement>) -> Result<Value, Failure> {
    let bounds = scene.bounds();
    let volume = Volume::around(&bounds);
    let capacity = Capacity::for_scene(scene, &volume, Preset::Auto);
    let coverage: Vec<f32> = scene.frames.iter().filter_map(Frame::depth_coverage).collect();
    let labelled = match &scene.source {
        SceneSource::Demo => scene.frames.len(),
        SceneSource::Folder(folder) => label_images(folder).map_or(0, |images| images.len()),
    };
    let image = scene.frames.first().map(|frame| *frame.image());
    let sparse: Vec<usize> = scene.frames.iter().map(|frame| frame.points.len()).collect();
    // In the capture's own coordinates, but in metres: they are named so.
    let metres = |position| (scene.to_capture(position) / scene.unit).to_array();
    let warnings: Vec<&String> = scene.warnings.iter().chain(&agreement.warnings).collect();
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
        "reprojection": agreement,
        "pose_refinement": refinement,
        "capacity": capacity.to_string(),
        "notes": scene.notes,
        "warnings": warnings,
    }))
}

fn print(
    facts: &Value,
    agreement: &Agreement,
    refinement: Option<&Result<PoseRefinement, Unrefined>>,
) -> Result<(), Failure> {
    let text = |key: &str| match &facts[key] {
        Value::String(text) => text.clone(),
        Value::Array(values) => values
            .iter()
            .map(|value| format!("{:.2}", value.as_f64().unwrap_or_default()))
            .collect::<Vec<_>>()
            .join(" "),
        other => other.to_string(),
    };
    println!("scene       {}", text("scene"))?;
    println!("format      {}", text("format"))?;
    println!(
        "frames      {} of {} x {} pixels",
        text("frames"),
        text("width"),
        text("height")
    )?;
    if facts["keyframes"] != facts["frames"] {
        println!("keyframes   {} of {}", text("keyframes"), text("frames"))?;
    }
    println!("intrinsics  fx fy cx cy = {}", text("intrinsics"))?;
    if facts["frames_with_distortion"] != 0 {
        println!("distortion  undone in {} frames", text("frames_with_distortion"))?;
    }
    match facts["depth_coverage"].as_f64() {
        Some(coverage) => println!(
            "depth       in {} frames, on {:.0}% of their pixels",
            text("frames_with_depth"),
            100.0 * coverage
        ),
        None => println!("depth       none"),
    }?;
    if facts["sparse_points"] != 0 {
        println!(
            "points      {} in {} frames",
            text("sparse_points"),
            text("frames_with_points")
        )?;
    }
    println!("labels      in {} frames (not used)", text("frames_with_labels"))?;
    println!(
        "bounds      {} to {} m",
        text("bounds_min_m"),
        text("bounds_max_m")
    )?;
    for line in agreement_lines(agreement) {
        println!("agreement   {line}")?;
    }
    match refinement {
        Some(Ok(refinement)) => println!("poses       {refinement}"),
        Some(Err(reason)) => println!("poses       used as they are: {reason}"),
        None => Ok(()),
    }?;
    println!("model       {}", text("capacity"))?;
    for note in facts["notes"].as_array().into_iter().flatten() {
        println!("note        {}", note.as_str().unwrap_or_default())?;
    }
    for warning in facts["warnings"].as_array().into_iter().flatten() {
        println!("warning     {}", warning.as_str().unwrap_or_default())?;
    }
    Ok(())
}

/// How well poses, cameras and measurements agree, a line each.
fn agreement_lines(agreement: &Agreement) -> Vec<String> {
    let pixels = |errors: &PixelErrors| {
        format!(
            "{:.2} px median, {:.2} px for nine in ten of {}",
            errors.median_px, errors.p90_px, errors.count
        )
    };
    let points = agreement
        .points
        .map(|errors| format!("reprojection of sparse points: {}", pixels(&errors)));
    let corners = agreement.corners.map(|corners: CornerAgreement| {
        format!(
            "{}: {} corners of {} pairs of frames; {:.0}% within 2 px, {:.0}% with exchanged poses",
            if corners.lifted_by_depth {
                "reprojection by depth"
            } else {
                "distance from epipolar lines"
            },
            pixels(&corners.errors),
            corners.pairs,
            100.0 * corners.within_2_px,
            100.0 * corners.within_2_px_by_chance
        )
    });
    let depth = agreement.depth.map(|depth| {
        let colours = depth
            .median_colour_difference
            .zip(depth.median_colour_difference_by_chance)
            .map(|(colours, by_chance)| {
                format!("; colours by {colours:.0} of 255, by chance {by_chance:.0}")
            });
        format!(
            "depth differs between frames by {:.1}% (median of {} pixels){}",
            100.0 * depth.median_relative_difference,
            depth.pixels,
            colours.unwrap_or_default()
        )
    });
    let found: Vec<String> = points.into_iter().chain(corners).chain(depth).collect();
    if found.is_empty() {
        return vec!["not known: no depth, no points, and too few corners that frames share".to_owned()];
    }
    found
}
