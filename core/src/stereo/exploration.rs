//! How near a scene comes and which of its views go together, before its depth is estimated.

use glam::Vec3;
use rayon::prelude::*;

use super::StereoError;
use super::consistency::Tolerance;
use super::level::Level;
use super::selection::select;
use super::view::View;
use crate::scene::{Bounds, Frame, Scene};

/// Nearest depth that is looked for at first, as a share of the cameras' extent.
const NEAREST: f32 = 0.06;
/// Depths that the choice of the first views assumes where there are no sparse points, as shares of that extent.
const ASSUMED: [f32; 4] = [0.2, 0.4, 0.8, 1.6];
/// Fewest sparse points of a frame that say how deep it is, and about as many as are looked at.
const FEWEST_POINTS: usize = 8;
const MOST_POINTS: usize = 48;
/// When a depth counts: this many views agree, and more than see through it.
const TOLERANCE: Tolerance = Tolerance {
    depth: 0.04,
    pixels: 1.0,
};
const AGREE: u8 = 2;
/// One pixel in so many may be nearer by mistake.
const OUTLIERS: usize = 200;
/// Rows and columns of places in a view that decide which others go with it.
const PLACES: [usize; 2] = [6, 8];

/// What is known of a scene before its depth is estimated.
pub struct Setup {
    /// Nearest depth, in metres.
    pub nearest: f32,
    /// The views that go with each view, the best first.
    pub neighbours: Vec<Vec<usize>>,
}

impl Setup {
    /// What poses and sparse points tell of these frames.
    ///
    /// # Errors
    /// Cameras that are all in one place.
    pub fn assumed(views: &[View], scene: &Scene, frames: &[usize]) -> Result<Self, StereoError> {
        let cameras = Bounds::of_cameras(views.iter().map(|view| view.center));
        let extent = cameras.size().max_element();
        if extent <= 0.0 {
            return Err(StereoError::NoParallax);
        }
        let assumed = |number: usize| {
            let frame = &scene.frames[frames[number]];
            if frame.points.len() >= FEWEST_POINTS {
                return sparse_points(frame);
            }
            let depths = ASSUMED.iter().map(|share| share * extent);
            let at = |depth: f32| grid(&views[number], [3, 3], move |_, _| 1.0 / depth);
            depths.flat_map(at).collect()
        };
        Ok(Self {
            nearest: NEAREST * extent,
            neighbours: neighbours(views, assumed),
        })
    }

    /// Chooses again by what was matched in images of one size. The scene comes no nearer than `margin` times the nearest
    /// depth found there, that of one pixel in 200 aside.
    pub fn improve(&mut self, level: &Level, matched: &[Vec<f32>], margin: f32) {
        let views = &level.views;
        let all = |_, _| true;
        let sure = level.checked(self, matched, TOLERANCE, all, |own, verdict| {
            if verdict.is_sure(AGREE) { own } else { 0.0 }
        });
        let mut known: Vec<f32> = sure.iter().flatten().copied().filter(|&own| own > 0.0).collect();
        if known.is_empty() {
            return;
        }
        known.sort_by(|a, b| b.total_cmp(a));
        let (near, median) = (known[known.len() / OUTLIERS], known[known.len() / 2]);
        self.nearest = self.nearest.max(margin / near);
        self.neighbours = neighbours(views, |number| {
            let view = &views[number];
            let own = sure[number].iter().enumerate().filter(|&(_, &own)| own > 0.0);
            let own = own.map(|(index, &own)| (view.camera.center_of(index), own));
            let own: Vec<((f32, f32), f32)> = own.collect();
            grid(view, PLACES, |x, y| {
                let off = |&((u, v), _): &((f32, f32), f32)| (u - x).powi(2) + (v - y).powi(2);
                let nearest = own.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
                nearest.map_or(median, |&(_, inverse)| inverse)
            })
        });
    }
}

/// The views that go with each view, by world positions in what it sees.
fn neighbours(views: &[View], points: impl Fn(usize) -> Vec<Vec3> + Sync) -> Vec<Vec<usize>> {
    let numbers = (0..views.len()).into_par_iter();
    numbers
        .map(|number| select(views, number, &points(number)))
        .collect()
}

fn sparse_points(frame: &Frame) -> Vec<Vec3> {
    let stride = frame.points.len().div_ceil(MOST_POINTS);
    let points = frame.points.iter().step_by(stride);
    points
        .map(|point| frame.place(point.pixel as usize, point.length))
        .collect()
}

/// World positions of the middles of so many rows and columns of cells of a view, at the inverse depths of their image
/// positions.
fn grid(view: &View, [rows, columns]: [usize; 2], inverse: impl Fn(f32, f32) -> f32) -> Vec<Vec3> {
    let middle = |at: usize, count: usize, side: u32| (at as f32 + 0.5) * side as f32 / count as f32;
    let place = |cell: usize| {
        let x = middle(cell % columns, columns, view.camera.width);
        let y = middle(cell / columns, rows, view.camera.height);
        view.place(x, y, inverse(x, y))
    };
    (0..rows * columns).map(place).collect()
}
