//! Builds the surface that labels spread over: from measured depth at once, and again from the field's depth as
//! training makes that better.

use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{Receiver, TryRecvError, bounded};

use super::TrainingEnd;
use super::background::in_background;
use super::demand::Measured;
use crate::features::ImageFeatures;
use crate::field::{FieldError, HeldOut, Ray, Trainer, frame_rays, render_rays};
use crate::labels::LabelSet;
use crate::scene::{Camera, Frame, Scene};
use crate::semantics::{FieldDepth, LabelPropagation, Superpixels, Surface};

/// Fewest pixels of a frame, along each axis, per ray that is rendered for its depth.
const STRIDE: u32 = 4;
/// Most rays of a refinement, about: 220 frames of 320x240 pixels at the stride above. More would be closer together
/// than the voxels that they end in, whose number is bounded too.
const MOST_RAYS: usize = 1 << 20;
/// Rays rendered between two looks at the commands.
const RAYS_AT_A_TIME: usize = 1024;
/// Training steps at which the surface is refined, where little of it was measured and where it has holes; the last
/// refinement follows the end of training.
const REFINEMENT_STEPS: [u64; 4] = [300, 1000, 3000, 8000];
const HOLE_REFINEMENT_STEPS: [u64; 3] = [500, 3000, 8000];
/// Largest median held-out error of the field's depth, as a share of the ray length, at which that depth is used beside
/// measured depth. With a larger error, holes are filled from the measured pixels around them.
const MOST_DEPTH_ERROR: f32 = 0.03;

/// Renders the field's depth frame by frame, and builds the surface from it in the background.
pub struct SurfaceRefiner {
    scene: Arc<Scene>,
    /// Threads for building; the session's own are busy training.
    threads: usize,
    /// Side of the scene's box, in metres.
    extent: f32,
    /// Factor on the number of voxels.
    size: f32,
    /// Whether any keyframe has pixels without measured depth.
    incomplete: bool,
    /// Pixels of a frame, along each axis, per ray.
    stride: u32,
    /// Training steps from which the field knows more than what was estimated before.
    least_steps: u64,
    /// Training steps of the refinements to come, ascending.
    marks: Vec<u64>,
    /// Whether one more refinement follows the end of training.
    last_refinement: bool,
    rendering: Option<DepthRendering>,
    building: Option<Receiver<Option<BuiltSurface>>>,
    /// What a pretrained network sees in the images, once that is known.
    features: Option<Arc<ImageFeatures>>,
    /// Those of the images, whatever surface they are seen with.
    pub(super) superpixels: Arc<Superpixels>,
    /// Seconds that the newest refinement took, rendering and building.
    seconds: Option<f64>,
}

/// A new surface with the labels propagated over it.
struct BuiltSurface {
    propagation: LabelPropagation,
    /// Seconds of rendering and building; `None` where nothing was rendered for it.
    seconds: Option<f64>,
}

/// A rendering of the field's depth that is under way.
struct DepthRendering {
    /// The frames done.
    done: Vec<Option<Arc<FieldDepth>>>,
    /// Reduced camera and rays of the next frame, once it has been begun.
    begun: Option<(Camera, Vec<Ray>)>,
    /// Ray lengths of the next frame, as far as they are known.
    lengths: Vec<f32>,
    /// Seconds spent so far.
    seconds: f64,
}

impl SurfaceRefiner {
    /// Begins with the surface of measured depth, if there is any, and with the field's where that knows more. Surfaces have
    /// `size` times as many voxels as are chosen for the scene, and are built with `threads` threads of their own.
    pub fn new(scene: &Arc<Scene>, trainer: &Trainer, size: f32, threads: usize) -> Self {
        Self::beginning_with(Vec::new(), scene, trainer, size, threads)
    }

    /// Begins with the surface of estimated depth, by index of the frame, where none was measured.
    pub(super) fn beginning_with(
        estimated: Vec<Option<Arc<FieldDepth>>>,
        scene: &Arc<Scene>,
        trainer: &Trainer,
        size: f32,
        threads: usize,
    ) -> Self {
        let mut refiner = Self::idle(scene, trainer, &estimated, size, threads);
        let starts = trainer.steps() > 0 && refiner.is_useful(trainer);
        if scene.has_depth() || !starts && estimated.iter().any(Option::is_some) {
            refiner.build(estimated, LabelSet::default(), None);
        }
        if starts {
            refiner.start();
        }
        refiner
    }

    /// Makes the only surface of a field that is trained no further: with its depth, where that is any use.
    pub(super) fn of_learnt(
        estimated: Vec<Option<Arc<FieldDepth>>>,
        scene: &Arc<Scene>,
        trainer: &Trainer,
        threads: usize,
    ) -> Self {
        let mut refiner = Self::idle(scene, trainer, &estimated, 1.0, threads);
        refiner.last_refinement = true;
        refiner.finish(trainer);
        if refiner.is_idle() {
            refiner.build(estimated, LabelSet::default(), None);
        }
        refiner
    }

    fn idle(
        scene: &Arc<Scene>,
        trainer: &Trainer,
        estimated: &[Option<Arc<FieldDepth>>],
        size: f32,
        threads: usize,
    ) -> Self {
        let measured = Measured::of(scene);
        let incomplete = measured != Measured::All;
        let refines = incomplete && !trainer.settled();
        // What was estimated is better than what the field knows at the first mark.
        let least_steps = match estimated.iter().any(Option::is_some) {
            true => REFINEMENT_STEPS[1],
            false => 0,
        };
        let marks: &[u64] = match measured {
            Measured::Little => &REFINEMENT_STEPS,
            Measured::Most | Measured::All => &HOLE_REFINEMENT_STEPS,
        };
        Self {
            scene: Arc::clone(scene),
            threads,
            extent: trainer.field().volume().side,
            size,
            incomplete,
            stride: stride(scene),
            marks: marks
                .iter()
                .copied()
                .filter(|&mark| refines && mark >= least_steps && mark > trainer.steps())
                .collect(),
            least_steps,
            last_refinement: refines,
            rendering: None,
            building: None,
            features: None,
            superpixels: Arc::default(),
            seconds: None,
        }
    }

    /// The surfaces built from now on know what a pretrained network sees in the images.
    pub(super) fn set_features(&mut self, features: ImageFeatures) {
        self.features = Some(Arc::new(features));
    }

    /// Has this surface know that too, unless another is under way.
    pub(super) fn add_features(&mut self, surface: &Arc<Surface>, labels: &LabelSet) {
        if self.is_idle() {
            let surface = Arc::clone(surface);
            self.build_by(labels.clone(), None, move |_| Some(Surface::clone(&surface)));
        }
    }

    /// Whether the field's depth is being rendered.
    pub fn is_rendering(&self) -> bool {
        self.rendering.is_some()
    }

    /// Whether a surface is being built.
    pub(super) fn is_building(&self) -> bool {
        self.building.is_some()
    }

    /// Whether no refinement is under way or still to come.
    pub fn is_done(&self) -> bool {
        self.marks.is_empty() && !self.last_refinement && self.is_idle()
    }

    /// Whether no refinement is under way.
    pub(super) fn is_idle(&self) -> bool {
        self.rendering.is_none() && self.building.is_none()
    }

    /// Starts a refinement if one is due after a training step, or because training has ended. Where the labels stand,
    /// another surface would hardly change them.
    pub(super) fn start_if_due(&mut self, trainer: &Trainer, end: Option<TrainingEnd>) {
        if end == Some(TrainingEnd::LabelsStand) {
            return;
        }
        if end.is_some() {
            if self.last_refinement {
                self.finish(trainer);
            }
        } else if self.marks.first().is_some_and(|&mark| trainer.steps() >= mark) && self.is_useful(trainer) {
            self.marks.retain(|&mark| mark > trainer.steps());
            self.start();
        }
    }

    /// Starts the last refinement now, unless one is under way or it was made.
    pub fn finish(&mut self, trainer: &Trainer) {
        self.marks.clear();
        let is_due = std::mem::take(&mut self.last_refinement);
        if is_due && self.rendering.is_none() && self.is_useful(trainer) {
            self.start();
        }
    }

    /// Whether the field's depth is better than what there is without it: where some depth was measured, holes can be filled.
    fn is_useful(&self, trainer: &Trainer) -> bool {
        // The error is unknown where no held-out pixel was measured.
        let is_good = |error: HeldOut| {
            error
                .relative_depth_error
                .is_none_or(|error| error <= MOST_DEPTH_ERROR)
        };
        match self.scene.has_depth() {
            true => trainer.error().map_or(trainer.settled(), is_good),
            false => trainer.steps() >= self.least_steps || trainer.settled(),
        }
    }

    fn start(&mut self) {
        if self.incomplete {
            self.rendering = Some(DepthRendering {
                done: Vec::with_capacity(self.scene.frames.len()),
                begun: None,
                lengths: Vec::new(),
                seconds: 0.0,
            });
        }
    }

    /// Renders some more rays. After the last frame's, starts to build the surface with these labels in the
    /// background: a click must not wait for it.
    pub fn advance(&mut self, trainer: &Trainer, labels: &LabelSet) -> Result<(), FieldError> {
        let Some(rendering) = &mut self.rendering else {
            return Ok(());
        };
        let start = Instant::now();
        // Frames that are no keyframes take their depth from the surface.
        let needs_none = |frame: &&Frame| !frame.is_keyframe() || frame.has_complete_depth();
        let rest = &self.scene.frames[rendering.done.len()..];
        let skipped = rest.iter().take_while(needs_none).count();
        rendering.done.resize(rendering.done.len() + skipped, None);
        if let Some(frame) = rest.get(skipped) {
            let begin = || frame_rays(frame, self.stride);
            let (camera, rays) = rendering.begun.get_or_insert_with(begin);
            // Rays among measured pixels need not be rendered.
            let mut unknown = Vec::new();
            while rendering.lengths.len() < rays.len() && unknown.len() < RAYS_AT_A_TIME {
                let index = rendering.lengths.len();
                let measured = measured_around(frame, self.stride, index);
                rendering.lengths.push(measured.unwrap_or(f32::INFINITY));
                if measured.is_none() {
                    unknown.push(index);
                }
            }
            let wanted: Vec<Ray> = unknown.iter().map(|&index| rays[index]).collect();
            let (field, occupancy) = (trainer.field(), trainer.occupancy());
            let rendered = render_rays(field, occupancy, &wanted, trainer.render_step(), false)?;
            for (index, ray) in unknown.into_iter().zip(rendered) {
                rendering.lengths[index] = ray.length.unwrap_or(f32::INFINITY);
            }
            if rendering.lengths.len() == rays.len() {
                rendering.done.push(Some(Arc::new(FieldDepth {
                    stride: self.stride,
                    width: camera.width,
                    lengths: std::mem::take(&mut rendering.lengths),
                })));
                rendering.begun = None;
            }
        }
        rendering.seconds += start.elapsed().as_secs_f64();
        if rendering.done.len() == self.scene.frames.len()
            && let Some(rendering) = self.rendering.take()
        {
            self.build(rendering.done, labels.clone(), Some(rendering.seconds));
        }
        Ok(())
    }

    /// Seconds that the last refinement will take, estimated by the newest one; 0 where none is needed, `None` before
    /// the first has ended.
    pub(super) fn seconds_to_finish(&self) -> Option<f64> {
        if self.incomplete { self.seconds } else { Some(0.0) }
    }

    fn build(
        &mut self,
        lengths: Vec<Option<Arc<FieldDepth>>>,
        labels: LabelSet,
        rendering_seconds: Option<f64>,
    ) {
        let (extent, size) = (self.extent, self.size);
        self.build_by(labels, rendering_seconds, move |scene| {
            Surface::build_scaled(scene, &lengths, extent, size)
        });
    }

    fn build_by(
        &mut self,
        labels: LabelSet,
        rendering_seconds: Option<f64>,
        surface: impl FnOnce(&Scene) -> Option<Surface> + Send + 'static,
    ) {
        let (scene, features) = (Arc::clone(&self.scene), self.features.clone());
        let superpixels = Arc::clone(&self.superpixels);
        let build = move || {
            let start = Instant::now();
            let mut surface = surface(&scene)?;
            surface.superpixels = superpixels;
            if let Some(features) = features {
                surface.add_features(&scene, &features);
            }
            let mut propagation = LabelPropagation::new(Arc::new(surface));
            propagation.set_labels(&scene, &labels);
            Some(BuiltSurface {
                propagation,
                seconds: rendering_seconds.map(|before| before + start.elapsed().as_secs_f64()),
            })
        };
        self.building = Some(in_background("inplace-surface", self.threads, build));
    }

    /// Has this surface be [ready](Self::ready) again, unless a newer one is being built.
    pub(super) fn put_back(&mut self, propagation: LabelPropagation) {
        if self.building.is_none() {
            let built = BuiltSurface {
                propagation,
                seconds: None,
            };
            let (sender, ready) = bounded(1);
            // There is room for one, and its receiver is here.
            let _ = sender.send(Some(built));
            self.building = Some(ready);
        }
    }

    /// The surface that has become ready, if any, with the labels at the start of its building.
    ///
    /// # Errors
    /// The building thread died.
    pub fn ready(&mut self) -> Result<Option<LabelPropagation>, &'static str> {
        let Some(building) = &self.building else {
            return Ok(None);
        };
        match building.try_recv() {
            Ok(built) => {
                self.building = None;
                self.seconds = built.as_ref().and_then(|built| built.seconds).or(self.seconds);
                Ok(built.map(|built| built.propagation))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => {
                self.building = None;
                Err("the surface could not be built; open the scene again")
            }
        }
    }
}

/// Pixels of a frame, along each axis, per rendered ray.
fn stride(scene: &Scene) -> u32 {
    let frames = scene.frames.iter();
    let rendered = frames.filter(|frame| frame.is_keyframe() && !frame.has_complete_depth());
    stride_for(rendered.map(|frame| frame.camera.pixels()).sum())
}

/// The stride for frames with this many pixels in total.
fn stride_for(pixels: usize) -> u32 {
    let most = (pixels as f64 / MOST_RAYS as f64).sqrt().ceil() as u32;
    most.max(STRIDE)
}

/// Measured ray length in the middle of a sample's pixels; `None` unless all of them and those beside
/// them are measured.
fn measured_around(frame: &Frame, stride: u32, sample: usize) -> Option<f32> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let samples = width.div_ceil(stride);
    let (column, row) = (sample as u32 % samples, sample as u32 / samples);
    let range = |at: u32, limit: u32| (at * stride).saturating_sub(stride)..((at + 2) * stride).min(limit);
    let at = |x: u32, y: u32| frame.ray_length((y * width + x) as usize);
    let complete = range(row, height).all(|y| range(column, width).all(|x| at(x, y).is_some()));
    let middle = frame.camera.middle_of_reduced(stride, sample);
    complete.then(|| frame.ray_length(middle)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Preset;
    use crate::scene::testing::{wall, without_depth};

    #[test]
    fn a_field_that_has_hardly_learnt_does_not_take_the_place_of_estimated_depth() {
        let scene = Arc::new(without_depth(wall(3, 24, 18)));
        let mut trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
        trainer.step().unwrap();
        let depth = FieldDepth {
            stride: 1,
            width: 24,
            lengths: vec![2.0; 24 * 18],
        };
        let estimated = vec![Some(Arc::new(depth)); 3];
        let renders = |refiner: SurfaceRefiner| {
            assert!(refiner.is_rendering() != refiner.is_building());
            refiner.is_rendering()
        };
        let begun = |estimated| {
            renders(SurfaceRefiner::beginning_with(
                estimated, &scene, &trainer, 1.0, 1,
            ))
        };
        assert!(!begun(estimated.clone()) && begun(vec![None; 3]));
        let learnt = |estimated| renders(SurfaceRefiner::of_learnt(estimated, &scene, &trainer, 1));
        assert!(!learnt(estimated) && learnt(vec![None; 3]));
    }

    #[test]
    fn large_images_take_no_more_rays_than_small_ones() {
        assert_eq!(stride_for(0), STRIDE);
        assert_eq!(stride_for(180 * 320 * 240), STRIDE);
        let phone = 50 * 1080 * 1920;
        let stride = stride_for(phone);
        assert_eq!(stride, 10);
        assert!(phone / (stride * stride) as usize <= MOST_RAYS);
    }
}
