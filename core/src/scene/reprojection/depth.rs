//! Measured depth of a frame against that of another.

use rayon::prelude::*;
use serde::Serialize;

use super::pairs::Pair;
use crate::scene::pixel_errors::median;
use crate::scene::{Frame, Scene};

/// About so many pixels of each frame are looked up in the other.
const PIXELS: usize = 500;
/// Relative difference of ray lengths within which two measurements are of one surface.
const SAME_SURFACE: f64 = 0.05;

/// How well measured depth agrees between neighbouring frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthAgreement {
    /// Number of pixels of one frame that the other should show: not hidden behind what it measured.
    pub pixels: usize,
    /// Median relative difference between where such a pixel is and what the other frame measured there.
    pub median_relative_difference: f64,
    /// Median difference of the colours where both agree to 5%, mean of the channels, 0..=255.
    pub median_colour_difference: Option<f64>,
    /// The same between pixels that have nothing to do with each other.
    pub median_colour_difference_by_chance: Option<f64>,
}

/// A pixel of one frame, as another shows it.
struct Seen {
    /// Relative difference of what the other measured, negative where it measured something nearer.
    difference: f64,
    colors: [[u8; 3]; 2],
}

/// Of all pairs whose frames have depth; `None` where no pixel can be compared.
pub(super) fn agreement(scene: &Scene, pairs: &[Pair]) -> Option<DepthAgreement> {
    let seen = pairs.par_iter().flat_map_iter(|pair| {
        let (a, b) = (&scene.frames[pair.first], &scene.frames[pair.second]);
        compare(a, b).into_iter().chain(compare(b, a))
    });
    let seen: Vec<Seen> = seen.collect();
    let visible = seen.iter().map(|seen| seen.difference);
    let visible = visible.filter(|&difference| difference >= -SAME_SURFACE);
    let differences: Vec<f64> = visible.map(f64::abs).collect();
    let same: Vec<[[u8; 3]; 2]> = seen
        .iter()
        .filter(|seen| seen.difference.abs() <= SAME_SURFACE)
        .map(|seen| seen.colors)
        .collect();
    let others = same.iter().cycle().skip(same.len() / 2);
    Some(DepthAgreement {
        pixels: differences.len(),
        median_relative_difference: median(differences.into_iter())?,
        median_colour_difference: median(same.iter().map(|[a, b]| apart(*a, *b))),
        median_colour_difference_by_chance: median(
            same.iter().zip(others).map(|([a, _], [_, b])| apart(*a, *b)),
        ),
    })
}

/// Pixels of `a` with depth where `b` has depth, too.
fn compare(a: &Frame, b: &Frame) -> Vec<Seen> {
    let (Some(depth), Some(measured)) = (a.depth(), b.depth()) else {
        return Vec::new();
    };
    let (own, other) = (a.color(), b.color());
    let seen = depth.sampled(PIXELS).filter_map(|(index, length)| {
        let (x, y, length) = b.project(a.place(index, length))?;
        let pixel = y as usize * b.camera.width as usize + x as usize;
        let difference = f64::from((measured.ray_length(pixel)? - length) / length);
        Some(Seen {
            difference,
            colors: [own.pixel(index), other.pixel(pixel)],
        })
    });
    seen.collect()
}

/// Mean absolute difference of the channels.
fn apart(a: [u8; 3], b: [u8; 3]) -> f64 {
    let channels = a.into_iter().zip(b);
    channels.map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>() / 3.0
}
