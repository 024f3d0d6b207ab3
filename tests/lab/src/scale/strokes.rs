//! Strokes of any number in any number of classes, at true places.

use std::hash::BuildHasher;
use std::sync::Arc;

use rand::{SeedableRng, rngs::SmallRng, seq::SliceRandom};
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::Failure;
use inplace_core::labels::{Class, ClassId, LabelSet, Pixel, Stroke, VOID};
use inplace_core::scene::{Scene, SceneError};

/// Side of the cells that a true class is cut into, in metres.
const CELL: f32 = 0.5;
/// Where the cells begin, in metres: not at the walls of a room that stands at the origin, where rounding would decide.
const CORNER: f32 = -0.17;
/// Most frames with strokes, evenly spaced.
const FRAMES: usize = 50;
/// About how many pixels of such a frame could be clicked.
const PIXELS: usize = 4800;

/// What is of one class: a true class in a cell of space.
type Piece = (ClassId, [i32; 3]);

/// A pixel that could be clicked.
struct Candidate {
    frame: usize,
    pixel: Pixel,
    piece: Piece,
}

/// So many clicks at random pixels, in so many classes: each true class is cut into cells of half a metre, and the cells
/// are dealt to the classes in an order that only their places decide, so that a class is a number of patches of the
/// surface. The first clicks are one of every class, as far as there are so many.
///
/// `truth` gives the true classes of a frame's pixels, row-major `[height, width]`. The frames need depth.
///
/// # Errors
/// When the scene shows too little for so many classes or clicks; images that cannot be read.
pub fn scattered(
    scene: &Scene,
    truth: &(dyn Fn(usize) -> Vec<ClassId> + Sync),
    classes: usize,
    clicks: usize,
    seed: u64,
) -> Result<LabelSet, Failure> {
    let too_little = |what: String| -> Failure {
        let scene = scene.name();
        format!("{scene}: there are too few {what}; measure with fewer, or in more frames").into()
    };
    let mut candidates = candidates(scene, truth)?;
    let mut pieces: Vec<Piece> = candidates.iter().map(|candidate| candidate.piece).collect();
    pieces.sort_unstable_by_key(|piece| (FxBuildHasher.hash_one(piece), *piece));
    pieces.dedup();
    if pieces.len() < classes || classes > usize::from(ClassId::MAX) {
        return Err(too_little(format!("surfaces for {classes} classes")));
    }
    if candidates.len() < clicks {
        return Err(too_little(format!("pixels for {clicks} strokes")));
    }
    let all = 1..=classes.max(1) as ClassId;
    let class_of: FxHashMap<Piece, ClassId> = pieces.into_iter().zip(all.cycle()).collect();
    candidates.shuffle(&mut SmallRng::seed_from_u64(seed));
    // The first of every class to the front; the order stays otherwise.
    let mut seen = vec![false; classes + 1];
    let (first, others): (Vec<&Candidate>, Vec<&Candidate>) = candidates
        .iter()
        .partition(|candidate| !std::mem::replace(&mut seen[usize::from(class_of[&candidate.piece])], true));
    let mut labels = LabelSet::default();
    for candidate in first.into_iter().chain(others).take(clicks) {
        let stroke = Stroke::click(candidate.frame, class_of[&candidate.piece], candidate.pixel);
        labels.strokes.insert(labels.next_stroke_id(), Arc::new(stroke));
    }
    let class = |id: ClassId| Class::new(id, format!("class {id}"));
    labels.classes = (1..=classes as ClassId).map(class).collect();
    Ok(labels)
}

/// Pixels of known class and place on an even grid, frame by frame.
fn candidates(
    scene: &Scene,
    truth: &(dyn Fn(usize) -> Vec<ClassId> + Sync),
) -> Result<Vec<Candidate>, Failure> {
    let count = scene.frames.len().min(FRAMES);
    let of = |index: usize| of_frame(scene, index * scene.frames.len() / count, truth);
    let of_frames: Result<Vec<_>, SceneError> = (0..count).into_par_iter().map(of).collect();
    Ok(of_frames?.into_iter().flatten().collect())
}

fn of_frame(
    scene: &Scene,
    index: usize,
    truth: &(dyn Fn(usize) -> Vec<ClassId> + Sync),
) -> Result<Vec<Candidate>, SceneError> {
    let frame = &scene.frames[index];
    let labels = truth(index);
    let pixels = frame.pixels()?;
    let Some(depth) = pixels.depth else {
        return Ok(Vec::new());
    };
    let camera = &frame.camera;
    let stride = ((camera.pixels() / PIXELS) as f64).sqrt().max(1.0) as u32;
    let middles = |size: u32| (stride / 2..size).step_by(stride as usize);
    let grid = middles(camera.height).flat_map(|y| middles(camera.width).map(move |x| [x, y]));
    let candidate = |pixel: Pixel| {
        let at = (pixel[1] * camera.width + pixel[0]) as usize;
        let class = labels.get(at).copied().filter(|&class| class != VOID)?;
        let seen = frame.center() + depth.ray_length(at)? * frame.ray_direction(at);
        let cell = (scene.origin.as_vec3() + seen - CORNER) / CELL;
        Some(Candidate {
            frame: index,
            pixel,
            piece: (class, cell.floor().to_array().map(|cell| cell as i32)),
        })
    };
    Ok(grid.filter_map(candidate).collect())
}
