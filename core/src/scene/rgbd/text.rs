//! Numbers, poses and intrinsics in text files.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::camera::pose_problem;
use crate::scene::{Camera, SceneError};

/// A 4x4 matrix that may not be a pose.
#[derive(Debug)]
pub(in crate::scene) struct Pose {
    /// Line of the file where it begins, from 1.
    pub line: usize,
    /// Row-major.
    pub values: [f64; 16],
}

impl Pose {
    /// Camera-to-world, or what is wrong with it.
    pub fn checked(&self) -> Result<DAffine3, &'static str> {
        let v = &self.values;
        let pose = DAffine3::from_mat3_translation(
            DMat3::from_cols_array(&[v[0], v[4], v[8], v[1], v[5], v[9], v[2], v[6], v[10]]),
            DVec3::new(v[3], v[7], v[11]),
        );
        if let Some(problem) = pose_problem(&pose) {
            return Err(problem);
        }
        let last_row = [v[12], v[13], v[14], v[15] - 1.0];
        if last_row.iter().all(|v| v.abs() < 1e-6) {
            Ok(pose)
        } else {
            Err("its last row is not 0 0 0 1")
        }
    }
}

/// Reads `fx fy cx cy width height`.
pub(in crate::scene) fn read_intrinsics(path: &Path) -> Result<Camera, SceneError> {
    let values: Vec<f64> = read_numbers(path)?
        .into_iter()
        .flat_map(|(_, values)| values)
        .collect();
    let &[fx, fy, cx, cy, width, height] = values.as_slice() else {
        return Err(SceneError::file(
            path,
            format!(
                "has {} numbers; write six: fx fy cx cy width height",
                values.len()
            ),
        ));
    };
    let is_size = |v: f64| v >= 1.0 && v <= f64::from(u16::MAX) && v.fract() == 0.0;
    if !is_size(width) || !is_size(height) {
        return Err(SceneError::file(
            path,
            format!(
                "{width} x {height} is not an image size in pixels; write six numbers: fx fy cx cy width height"
            ),
        ));
    }
    let camera = Camera {
        width: width as u32,
        height: height as u32,
        fx: fx as f32,
        fy: fy as f32,
        cx: cx as f32,
        cy: cy as f32,
    };
    let outside = !(cx > 0.0 && cx < width && cy > 0.0 && cy < height);
    match camera.problem() {
        Some(problem) => Err(SceneError::file(
            path,
            format!("{problem}; write six numbers in pixels: fx fy cx cy width height"),
        )),
        None if outside => Err(SceneError::file(
            path,
            format!(
                "the principal point ({cx}, {cy}) is outside the image of {width}x{height} pixels; correct cx and cy"
            ),
        )),
        None => Ok(camera),
    }
}

/// The numbers of each line that has any, with its number from 1; lines that start with # do not count.
pub(in crate::scene) fn read_numbers(path: &Path) -> Result<Vec<(usize, Vec<f64>)>, SceneError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| SceneError::file(path, format!("cannot be read as text: {error}")))?;
    let mut lines = Vec::new();
    for (line, content) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        if content.trim_start().starts_with('#') {
            continue;
        }
        let values = content
            .split(|c: char| c.is_whitespace() || c == ',')
            .filter(|word| !word.is_empty())
            .map(|word| {
                word.parse::<f64>().map_err(|_| {
                    let word: String = word.chars().take(20).collect();
                    SceneError::file(
                        path,
                        format!("line {line}: \"{word}\" is not a number; correct that line"),
                    )
                })
            })
            .collect::<Result<Vec<f64>, SceneError>>()?;
        if !values.is_empty() {
            lines.push((line, values));
        }
    }
    Ok(lines)
}
