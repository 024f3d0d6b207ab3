//! Better poses and depth by stereo, before a scene without measured depth is learnt.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded};

use super::background::in_background;
use super::opening::{Told, stopped, wait_for};
use super::outbox::Outbox;
use super::serve::WorkerError;
use super::{Command, Event};
use crate::scene::reprojection::refine;
use crate::scene::{Scene, SparsePoint};
use crate::semantics::FieldDepth;
use crate::stereo::{self, StereoDepth, StereoError};

/// Most sparse points that stereo adds to a scene, over all of its frames.
const MOST_POINTS: usize = 1 << 20;
const FAILED: &str = "the depth could not be estimated";

/// A scene whose depth was estimated, and whose poses were refined where that helps.
pub(super) struct Estimated {
    /// The scene; once this is all, with what several views match alike as sparse points of its keyframes.
    pub(super) scene: Arc<Scene>,
    /// Depth of its keyframes, filled in between those points; by index of the frame.
    pub(super) depth: Vec<Option<Arc<FieldDepth>>>,
    /// Whether this is all, and no first look.
    pub(super) is_all: bool,
}

impl From<Arc<Scene>> for Estimated {
    /// Of which nothing is estimated.
    fn from(scene: Arc<Scene>) -> Self {
        Self {
            depth: vec![None; scene.frames.len()],
            scene,
            is_all: true,
        }
    }
}

/// The estimation of a scene's depth on threads of its own, until it is dropped.
pub(super) struct Estimation {
    answers: Receiver<Result<Estimated, WorkerError>>,
    /// Has it go on after the first look.
    go_on: Sender<()>,
    is_dropped: Arc<AtomicBool>,
    /// The share of the work that is done, in per cent.
    percent: Arc<AtomicU8>,
}

impl Estimation {
    /// Starts it: a first look comes before all of it if that is wanted; then it waits until it is to [go on](Self::go_on).
    /// Where all cameras are in one place there is no depth to estimate.
    pub(super) fn start(scene: Arc<Scene>, with_first: bool, outbox: &Outbox, threads: usize) -> Self {
        let ((sender, answers), (go_on, waiting)) = (bounded(2), bounded(1));
        let estimation = Self {
            answers,
            go_on,
            is_dropped: Arc::default(),
            percent: Arc::default(),
        };
        let (is_dropped, percent) = (
            Arc::clone(&estimation.is_dropped),
            Arc::clone(&estimation.percent),
        );
        let outbox = outbox.clone();
        let work = move || {
            let told = Told::default();
            let has_first = AtomicBool::new(false);
            let go_on = |share: f32| {
                percent.fetch_max((100.0 * share) as u8, Ordering::Relaxed);
                // From the first look on, the status says it.
                if !has_first.load(Ordering::Relaxed) {
                    told.now_and_then(share >= 1.0, || outbox.send(Event::Estimating { share }));
                }
                !is_dropped.load(Ordering::Relaxed)
            };
            let scene = with_refined_poses(scene, &|| !is_dropped.load(Ordering::Relaxed));
            let tell = |estimated| {
                // The receiver is gone when this has been dropped.
                let _ = sender.send(estimated);
            };
            let mut first = |depth: Vec<StereoDepth>| {
                has_first.store(true, Ordering::Relaxed);
                tell(Ok(Estimated {
                    scene: Arc::clone(&scene),
                    depth: lengths(&scene, &depth),
                    is_all: false,
                }));
                // What comes of it has all cores. There is nobody to tell any more when this has been dropped.
                let _ = waiting.recv();
            };
            let first: Option<&mut dyn FnMut(Vec<StereoDepth>)> = with_first.then_some(&mut first);
            tell(match stereo::estimate(&scene, first, &go_on) {
                Ok(depth) => Ok(with_points(scene, &depth)),
                Err(StereoError::NoParallax | StereoError::Stopped) => Ok(with_points(scene, &[])),
                Err(StereoError::Scene(error)) => Err(error.into()),
            });
        };
        // What it answers comes by the other channel, which is disconnected when it panics.
        drop(in_background("inplace-stereo", threads, work));
        estimation
    }

    /// Waits for the next answer and keeps the commands that arrive in the meantime; `None` as soon as one of them says
    /// stop.
    pub(super) fn next(
        &self,
        commands: &Receiver<Command>,
        early: &mut Vec<Command>,
    ) -> Result<Option<Estimated>, WorkerError> {
        wait_for(&self.answers, FAILED, commands, early)?.transpose()
    }

    /// The next answer, if it is there.
    pub(super) fn ready(&self) -> Result<Option<Estimated>, WorkerError> {
        match self.answers.try_recv() {
            Ok(answer) => answer.map(Some),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(stopped(FAILED)),
        }
    }

    /// Has it go on after the first look, as that has been made use of.
    pub(super) fn go_on(&self) {
        // It may have been told already.
        let _ = self.go_on.try_send(());
    }

    /// How much of the work is done, in per cent.
    pub(super) fn percent(&self) -> u8 {
        self.percent.load(Ordering::Relaxed)
    }
}

impl Drop for Estimation {
    fn drop(&mut self) {
        self.is_dropped.store(true, Ordering::Relaxed);
    }
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

/// Estimated depth as lengths of rays, by index of the frame.
fn lengths(scene: &Scene, estimated: &[StereoDepth]) -> Vec<Option<Arc<FieldDepth>>> {
    let mut depth = vec![None; scene.frames.len()];
    for own in estimated {
        let grid = FieldDepth::from(own);
        let is_known = grid.lengths.iter().any(|length| !length.is_nan());
        depth[own.frame] = is_known.then(|| Arc::new(grid));
    }
    depth
}

fn with_points(mut scene: Arc<Scene>, estimated: &[StereoDepth]) -> Estimated {
    let depth = lengths(&scene, estimated);
    let pixels: usize = estimated.iter().map(|depth| depth.camera.pixels()).sum();
    let every = pixels.div_ceil(MOST_POINTS).max(1);
    for own in estimated {
        let Some(grid) = &depth[own.frame] else {
            continue;
        };
        let frame = &mut Arc::make_mut(&mut scene).frames[own.frame];
        let confident = (0..grid.lengths.len()).filter(|&index| own.is_confident(index));
        let points = confident.step_by(every).map(|index| SparsePoint {
            pixel: frame.camera.middle_of_reduced(own.stride, index) as u32,
            length: grid.lengths[index],
            error: 0.0,
            by_stereo: true,
        });
        let points: Vec<SparsePoint> = points.collect();
        frame.points.extend(points);
    }
    let is_all = true;
    Estimated { scene, depth, is_all }
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
