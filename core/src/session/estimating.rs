//! Better poses and depth by stereo, before a scene without measured depth is learnt.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use crossbeam_channel::Receiver;

use super::opening::{Told, meanwhile};
use super::outbox::Outbox;
use super::serve::WorkerError;
use super::{Command, Event};
use crate::scene::reprojection::refine;
use crate::scene::{Scene, SparsePoint};
use crate::semantics::FieldDepth;
use crate::stereo::{self, StereoDepth, StereoError};

/// Most sparse points that stereo adds to a scene, over all of its frames.
const MOST_POINTS: usize = 1 << 20;

/// A scene whose depth was estimated, and whose poses were refined where that helps.
pub(super) struct Estimated {
    /// The scene, with what several views match alike as sparse points of its keyframes.
    pub(super) scene: Arc<Scene>,
    /// Depth of its keyframes, filled in between those points; by index of the frame.
    pub(super) depth: Vec<Option<Arc<FieldDepth>>>,
}

/// Estimates the depth of a scene on a thread of its own, so that it can be stopped; `None` when it was. Commands that
/// arrive are kept in `early`. Where all cameras are in one place there is no depth to estimate.
pub(super) fn estimate(
    scene: Arc<Scene>,
    commands: &Receiver<Command>,
    early: &mut Vec<Command>,
    outbox: &Outbox,
    threads: &Arc<rayon::ThreadPool>,
) -> Result<Option<Estimated>, WorkerError> {
    let (own, outbox, threads) = (Arc::clone(&scene), outbox.clone(), Arc::clone(threads));
    let work = move |stopped: &AtomicBool| {
        let told = Told::default();
        let go_on = |share| {
            told.now_and_then(share >= 1.0, || outbox.send(Event::Estimating { share }));
            !stopped.load(Ordering::Relaxed)
        };
        threads.install(|| {
            let scene = with_refined_poses(own, &|| !stopped.load(Ordering::Relaxed));
            let depth = stereo::estimate(&scene, &go_on)?;
            Ok((scene, depth))
        })
    };
    let failed = "the depth could not be estimated";
    let (scene, depth) = match meanwhile("inplace-stereo", failed, commands, early, work)? {
        None => return Ok(None),
        Some(Ok(estimated)) => estimated,
        Some(Err(StereoError::NoParallax | StereoError::Stopped)) => (scene, Vec::new()),
        Some(Err(StereoError::Scene(error))) => return Err(error.into()),
    };
    Ok(Some(with_depth(scene, &depth)))
}

/// The scene with poses that fit its images better, where there are any.
fn with_refined_poses(mut scene: Arc<Scene>, go_on: &(dyn Fn() -> bool + Sync)) -> Arc<Scene> {
    let start = Instant::now();
    let refined = refine(&scene, go_on);
    let seconds = start.elapsed().as_secs_f64();
    match refined {
        Ok(refined) => {
            tracing::info!(summary = %refined.summary, seconds, "poses are refined");
            refined.apply(Arc::make_mut(&mut scene));
        }
        Err(reason) => tracing::info!(%reason, seconds, "the capture's own poses are used"),
    }
    scene
}

fn with_depth(scene: Arc<Scene>, estimated: &[StereoDepth]) -> Estimated {
    let pixels: usize = estimated.iter().map(|depth| depth.camera.pixels()).sum();
    let every = pixels.div_ceil(MOST_POINTS).max(1);
    let mut depth = vec![None; scene.frames.len()];
    let mut scene = scene;
    for own in estimated {
        let frame = &mut Arc::make_mut(&mut scene).frames[own.frame];
        let grid = FieldDepth::from(own);
        let confident = (0..grid.lengths.len()).filter(|&index| own.is_confident(index));
        let points = confident.step_by(every).map(|index| SparsePoint {
            pixel: frame.camera.middle_of_reduced(own.stride, index) as u32,
            length: grid.lengths[index],
            error: 0.0,
            by_stereo: true,
        });
        let points: Vec<SparsePoint> = points.collect();
        frame.points.extend(points);
        let is_known = grid.lengths.iter().any(|length| !length.is_nan());
        depth[own.frame] = is_known.then(|| Arc::new(grid));
    }
    Estimated { scene, depth }
}

/// Lengths of rays in place of depth.
impl From<&StereoDepth> for FieldDepth {
    fn from(depth: &StereoDepth) -> Self {
        let camera = &depth.camera;
        let length = |index| {
            let z = depth.z_depth(index);
            z.map_or(f32::NAN, |z| z * camera.direction_at(index).length())
        };
        Self {
            stride: depth.stride,
            width: camera.width,
            lengths: (0..camera.pixels()).map(length).collect(),
        }
    }
}
