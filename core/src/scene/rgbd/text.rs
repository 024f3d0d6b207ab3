//! Numbers, poses and intrinsics in text files.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::camera::{image_size, rigid};
use crate::scene::error::{LAST_ROW, refusal, refuse};
use crate::scene::{Camera, SceneError};

/// Camera-to-world of a 4x4 matrix, row by row, or what is wrong with it.
pub(in crate::scene) fn pose_of(v: &[f64; 16]) -> Result<DAffine3, &'static str> {
    let pose = rigid(DAffine3::from_mat3_translation(
        DMat3::from_cols_array(&[v[0], v[4], v[8], v[1], v[5], v[9], v[2], v[6], v[10]]),
        DVec3::new(v[3], v[7], v[11]),
    ))?;
    let last_row = [v[12], v[13], v[14], v[15] - 1.0];
    if last_row.iter().all(|v| v.abs() < 1e-6) {
        Ok(pose)
    } else {
        Err(LAST_ROW)
    }
}

/// Reads a pose of four lines of four numbers: camera-to-world, or what is wrong with it.
///
/// # Errors
/// A file that holds something else.
pub(in crate::scene) fn read_pose(path: &Path) -> Result<Result<DAffine3, &'static str>, SceneError> {
    const FORM: &str = "write four lines of four numbers, the camera-to-world matrix";
    let rows = parse_numbers(path, &read_text(path)?)?;
    if let Some((line, row)) = rows.iter().find(|(_, row)| row.len() != 4) {
        refuse!(path, "line {line} has {} numbers; {FORM}", row.len());
    }
    let values: Vec<f64> = rows.into_iter().flat_map(|(_, row)| row).collect();
    let values = values
        .try_into()
        .map_err(|v: Vec<f64>| refusal!(path, "has {} lines; {FORM}", v.len() / 4))?;
    Ok(pose_of(&values))
}

/// Reads `fx fy cx cy width height`.
pub(in crate::scene) fn read_intrinsics(path: &Path) -> Result<Camera, SceneError> {
    let values = read_numbers(path)?;
    let &[fx, fy, cx, cy, width, height] = values.as_slice() else {
        refuse!(
            path,
            "has {} numbers; write six: fx fy cx cy width height",
            values.len()
        );
    };
    let Some(size) = image_size([width, height]) else {
        refuse!(
            path,
            "{width} x {height} is not an image size in pixels; write six numbers: fx fy cx cy width height"
        );
    };
    let camera = Camera::checked(size, [fx, fy, cx, cy]).map_err(|problem| {
        refusal!(
            path,
            "{problem}; write six numbers in pixels: fx fy cx cy width height"
        )
    })?;
    if !(cx > 0.0 && cx < width && cy > 0.0 && cy < height) {
        refuse!(
            path,
            "the principal point ({cx}, {cy}) is outside the image of {width}x{height} pixels; correct cx and cy"
        );
    }
    Ok(camera)
}

/// All numbers of a file, line after line.
pub(in crate::scene) fn read_numbers(path: &Path) -> Result<Vec<f64>, SceneError> {
    let lines = parse_numbers(path, &read_text(path)?)?;
    Ok(lines.into_iter().flat_map(|(_, values)| values).collect())
}

/// The text of a file, without the byte order mark that some editors save before it.
pub(in crate::scene) fn read_text(path: &Path) -> Result<String, SceneError> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        refusal!(
            path,
            "cannot be read as text ({error}); check that it is there, and save it as plain text in UTF-8"
        )
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// The numbers of each line of the file at `path` that has any, with its number from 1; lines that start with # do
/// not count.
pub(in crate::scene) fn parse_numbers(path: &Path, text: &str) -> Result<Vec<(usize, Vec<f64>)>, SceneError> {
    let mut lines = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        if content.trim_start().starts_with('#') {
            continue;
        }
        let values = content
            .split(|c: char| c.is_whitespace() || c == ',')
            .filter(|word| !word.is_empty())
            .map(|word| {
                word.parse::<f64>().map_err(|_| {
                    let word: String = word.chars().take(20).collect();
                    refusal!(path, "line {line}: {word:?} is not a number; correct that line")
                })
            })
            .collect::<Result<Vec<f64>, SceneError>>()?;
        if !values.is_empty() {
            lines.push((line, values));
        }
    }
    Ok(lines)
}
