//! `inplace-lab bench stereo`: how good the depth is that multi-view stereo estimates from colours alone, beside measured depth that it never sees.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::Failure;
use super::arguments::StereoArguments;
use super::commands::begin;
use super::learnt::{pool, refine_poses};
use super::page::Page;
use super::table::csv;
use inplace_core::scene::{Frame, OpenOptions, Scene, SceneSource};
use inplace_core::session::Progress;
use inplace_core::stereo::{StereoDepth, estimate};
use inplace_core::{cores, export};

/// Neighbouring pixels whose depths differ by more than this share of the nearer are an edge.
const EDGE: f32 = 0.1;
/// Pixels that a band along edges reaches to either side.
const BAND: usize = 3;

/// The columns of `stereo.csv`.
const COLUMNS: &str =
    "scene look seconds:2 confident:4 complete:4 error:5 within_1:4 within_5:4 within_10:4 edge_error:5";

/// How good the depth of all keyframes is. Shares are of the pixels with measured depth, errors relative to it; unknown
/// without any.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct StereoPoint {
    /// Name of the scene.
    scene: String,
    /// "first" for what is known at a quarter of the images' width and height, "full" for the end.
    look: &'static str,
    /// Wall time since the scene was open, in seconds.
    seconds: f64,
    /// Share of all pixels that were matched, in several views alike.
    confident: f64,
    /// Share of all pixels that have depth.
    complete: f64,
    /// Median error of the pixels that have depth.
    error: f64,
    /// Shares with an error of at most 1, 5 and 10%.
    within_1: f64,
    /// At most 5%.
    within_5: f64,
    /// At most 10%.
    within_10: f64,
    /// Median error in the band of three pixels along edges of measured depth.
    edge_error: f64,
}

/// Measures every scene, writes `stereo.csv`, and prints.
pub fn run(arguments: &StereoArguments) -> Result<(), Failure> {
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.threads.map_or_else(cores, usize::from);
    let pool = pool(threads)?;
    let mut points = Vec::new();
    for argument in &arguments.scenes {
        let source = SceneSource::from_argument(argument);
        let options = OpenOptions {
            outside_files: arguments.outside_files,
            ..OpenOptions::default()
        };
        let scene = Scene::open(&source, options, &|_, _| {})?;
        let progress = Progress::default();
        let told = |share: f32| progress.show_share(argument.display().to_string(), share);
        points.extend(pool.install(|| stereo_depth(scene, &told))?);
    }
    export::write(&out.join("stereo.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(threads, &points)?.publish(&arguments.output, "stereo", &points)
}

fn page(threads: usize, points: &[StereoPoint]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(&format!(
        "Depth from colours alone, {threads} threads: per cent of the pixels that several views match alike, and \
         that have depth, relative errors of the median pixel and of that near edges of the measured depth, and per cent \
         of the pixels within 1, 5 and 10%."
    ));
    page.means(
        points,
        "scene | look | seconds:1 | confident:1% | complete:1% | median=error:2% | at edges=edge_error:2% | 1%=within_1:1% | \
         5%=within_5:1% | 10%=within_10:1%",
    )?;
    Ok(page)
}

/// Refines the poses of a scene where that helps, estimates its depth as a session does, and measures it; `told` hears
/// which share of the work is done.
///
/// # Errors
/// A scene without parallax, or whose files can no longer be read.
fn stereo_depth(mut scene: Scene, told: &(dyn Fn(f32) + Sync)) -> Result<Vec<StereoPoint>, Failure> {
    let start = Instant::now();
    refine_poses(&mut scene);
    let go_on = |share: f32| {
        told(share);
        true
    };
    let mut looks = Vec::with_capacity(2);
    let mut first = |maps| looks.push(("first", start.elapsed(), maps));
    let full = estimate(&scene, Some(&mut first), &go_on)?;
    looks.push(("full", start.elapsed(), full));
    let measured = |(look, elapsed, maps): &(&'static str, Duration, Vec<StereoDepth>)| {
        measured(&scene, maps, look, elapsed.as_secs_f64())
    };
    Ok(looks.iter().map(measured).collect())
}

fn measured(scene: &Scene, maps: &[StereoDepth], look: &'static str, seconds: f64) -> StereoPoint {
    let (mut pixels, mut confident, mut known, mut measured) = (0, 0, 0, 0);
    let (mut errors, mut at_edges) = (Vec::new(), Vec::new());
    for map in maps {
        let frame = &scene.frames[map.frame];
        let truth = z_depths(frame);
        let band = band(frame, &truth);
        let (width, stride) = (frame.camera.width, map.stride);
        pixels += frame.camera.pixels();
        for (index, (truth, is_near_edge)) in truth.into_iter().zip(band).enumerate() {
            let [column, row] = [index as u32 % width, index as u32 / width].map(|at| at / stride);
            let at = (row * map.camera.width + column) as usize;
            let own = map.z_depth(at);
            confident += usize::from(map.is_confident(at));
            known += usize::from(own.is_some());
            let Some(truth) = truth else {
                continue;
            };
            measured += 1;
            if let Some(own) = own {
                let error = (own / truth - 1.0).abs();
                errors.push(error);
                if is_near_edge {
                    at_edges.push(error);
                }
            }
        }
    }
    let within = |most: f32| {
        let count = errors.iter().filter(|&&error| error <= most).count();
        count as f64 / f64::from(measured)
    };
    let [within_1, within_5, within_10] = [0.01, 0.05, 0.1].map(within);
    StereoPoint {
        scene: scene.name(),
        look,
        seconds,
        confident: confident as f64 / pixels as f64,
        complete: known as f64 / pixels as f64,
        within_1,
        within_5,
        within_10,
        error: median(errors),
        edge_error: median(at_edges),
    }
}

/// Measured z-depths of a frame's pixels.
fn z_depths(frame: &Frame) -> Vec<Option<f32>> {
    let depth = frame.depth();
    let z = |index| Some(depth.as_ref()?.ray_length(index)? / frame.camera.direction_at(index).length());
    (0..frame.camera.pixels()).map(z).collect()
}

/// Whether each pixel is near an edge of the measured depth.
fn band(frame: &Frame, truth: &[Option<f32>]) -> Vec<bool> {
    let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
    let mut band = vec![false; truth.len()];
    for index in 0..truth.len() {
        let (column, row) = (index % width, index / width);
        let right = (column + 1 < width).then_some(index + 1);
        let below = (row + 1 < height).then_some(index + width);
        let is_far = |other: usize| match (truth[index], truth[other]) {
            (Some(a), Some(b)) => (a - b).abs() > EDGE * a.min(b),
            _ => false,
        };
        if right.into_iter().chain(below).any(is_far) {
            for row in row.saturating_sub(BAND)..(row + BAND + 1).min(height) {
                let columns = column.saturating_sub(BAND)..(column + BAND + 1).min(width);
                band[row * width + columns.start..row * width + columns.end].fill(true);
            }
        }
    }
    band
}

/// Not a number where there are none.
fn median(mut values: Vec<f32>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
