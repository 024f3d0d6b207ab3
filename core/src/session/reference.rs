//! The worker of [`Preset::Reference`](crate::field::Preset): trains the paper's networks on colours and
//! labels, and renders every frame's maps from their logits.
//!
//! A ray costs milliseconds, so maps are rendered only when training rests (paused, settling or done): all
//! frames at a coarse stride first, then again at half of it, and so on for as long as there is time.

use std::sync::Arc;
use std::time::Instant;

use candle_core::Device;

use super::outbox::Outbox;
use super::serve::{WorkerError, WorkerTask, saved, timed};
use super::status_reporter::StatusReporter;
use super::{Command, Event, FrameMap, Phase, SessionOptions, Status, TrainingEnd};
use crate::field::reference::{PixelLabels, ReferenceRay, ReferenceSettings, ReferenceTrainer};
use crate::field::{HeldOut, Ray, RenderedRay, Work, best_device};
use crate::labels::{ClassId, LabelSet, VOID, rasterise};
use crate::scene::{Camera, Scene};
use crate::semantics::ENTROPY_STEPS_PER_NAT;

/// Stride of the first maps: so coarse that they cost less than a step, and always come in time.
const COARSEST: u32 = 128;
/// Held-out pixels that the error is measured on, once training rests.
const HELD_OUT_RAYS: usize = 64;

/// Trains and renders the published network, a slice of rays at a time.
pub(super) struct ReferenceWorker<'a> {
    scene: Arc<Scene>,
    options: &'a SessionOptions,
    outbox: &'a Outbox,
    device: Device,
    settings: ReferenceSettings,
    /// `None` until the classes are known, since the networks have a logit for each.
    trainer: Option<ReferenceTrainer>,
    labels: LabelSet,
    generation: u64,
    paused: bool,
    settling: bool,
    /// The maps of the present networks; starts over after each training step.
    rendering: MapRendering,
    held_out: Option<HeldOut>,
    map_stride: Option<u32>,
    reporter: StatusReporter,
    training_seconds: f64,
    render_seconds: f64,
}

/// Progress of the maps.
#[derive(Default)]
struct MapRendering {
    held_out: Vec<RenderedRay>,
    measured: bool,
    /// Stride of the pass under way; 0 before the first.
    stride: u32,
    frame: usize,
    /// The rays rendered of the frame under way, in the order of its [`coarse_pixels`].
    done: Vec<ReferenceRay>,
    /// Entropies of the pass under way, summed over its frames.
    entropy: f32,
    mean_entropy: Option<f32>,
    complete: bool,
}

impl<'a> ReferenceWorker<'a> {
    pub(super) fn new(
        scene: Arc<Scene>,
        options: &'a SessionOptions,
        outbox: &'a Outbox,
    ) -> Result<Self, WorkerError> {
        let device = best_device()?;
        Ok(Self {
            scene,
            options,
            outbox,
            settings: ReferenceSettings::published(&device),
            device,
            trainer: None,
            labels: LabelSet::default(),
            generation: 0,
            paused: false,
            settling: false,
            rendering: MapRendering::default(),
            held_out: None,
            map_stride: None,
            reporter: StatusReporter::new(),
            training_seconds: 0.0,
            render_seconds: 0.0,
        })
    }

    fn set_labels(&mut self, labels: LabelSet, generation: u64) -> Result<(), WorkerError> {
        if labels.imported.is_some() && self.labels.imported.is_none() {
            self.outbox.send(Event::Warning(
                "the published network does not learn from imported label images: they are left out"
                    .to_owned(),
            ));
        }
        let pixels = PixelLabels::new(&self.scene, &labels);
        self.labels = labels;
        self.generation = generation;
        self.reporter.repeat_next();
        self.rendering = MapRendering::default();
        match &mut self.trainer {
            _ if pixels.classes().is_empty() => self.trainer = None,
            Some(trainer) if trainer.labels().classes() == pixels.classes() => trainer.set_labels(pixels)?,
            // A logit for each class: with other classes the networks are others.
            _ => {
                let mut trainer = ReferenceTrainer::new(
                    Arc::clone(&self.scene),
                    pixels,
                    self.settings,
                    &self.device,
                    self.options.seed,
                )?;
                // A project's model is of the fused field unless this preset saved it.
                if let Some(state) = &self.options.state
                    && let Ok(tensors) = state.model.load()
                    && trainer.restore(&tensors, state.model.steps).is_ok()
                {
                    self.report_status();
                }
                self.trainer = Some(trainer);
            }
        }
        Ok(())
    }

    /// Whether training rests, so that there is time for maps.
    fn rests(&self) -> bool {
        self.paused || self.settling || self.trainer.as_ref().is_some_and(ReferenceTrainer::settled)
    }

    /// Trains on a slice of rays; `false` when there is nothing to train.
    fn train(&mut self) -> Result<bool, WorkerError> {
        if self.rests() {
            return Ok(false);
        }
        let Some(trainer) = &mut self.trainer else {
            return Ok(false);
        };
        // Earlier maps are of other networks.
        self.rendering = MapRendering::default();
        timed(&mut self.training_seconds, || trainer.advance())?;
        Ok(true)
    }

    /// Renders a slice of rays; `false` when there is nothing to render.
    fn render(&mut self) -> Result<bool, WorkerError> {
        let Some(trainer) = self.trainer.as_ref().filter(|_| !self.rendering.complete) else {
            return Ok(false);
        };
        let start = Instant::now();
        let (field, slice) = (trainer.field(), self.settings.slice);
        let rendering = &mut self.rendering;
        if !rendering.measured && rendering.stride < COARSEST && rendering.stride > 0 {
            // The error is measured after the first maps, which must not wait for it.
            let pixels = trainer.held_out().fewer(HELD_OUT_RAYS);
            let rays = pixels.rays(&self.scene);
            let done = rendering.held_out.len();
            if done < rays.len() {
                let rendered = field.render(&rays[done..(done + slice).min(rays.len())])?;
                rendering.held_out.extend(rendered.iter().map(|ray| ray.seen));
            } else {
                rendering.measured = true;
                self.held_out = pixels.error(&rendering.held_out, &self.scene);
            }
            self.render_seconds += start.elapsed().as_secs_f64();
            return Ok(true);
        }
        if rendering.stride == 0 {
            rendering.stride = COARSEST;
        }
        let frame = &self.scene.frames[rendering.frame];
        let pixels = coarse_pixels(&frame.camera, rendering.stride);
        let done = rendering.done.len();
        let rays: Vec<Ray> = pixels[done..(done + slice).min(pixels.len())]
            .iter()
            .map(|&pixel| Ray::through(frame, pixel))
            .collect();
        rendering.done.extend(field.render(&rays)?);
        if rendering.done.len() == pixels.len() {
            let said: Vec<(ClassId, u16)> = rendering
                .done
                .iter()
                .map(|ray| most_likely(ray, trainer.labels().classes()))
                .collect();
            let of = (rendering.frame, self.generation);
            if let Some(map) = frame_map(&self.scene, &self.labels, of, rendering.stride, &said) {
                rendering.entropy += map.mean_entropy();
                self.outbox.publish(map);
            }
            rendering.done.clear();
            rendering.frame += 1;
        }
        if rendering.frame == self.scene.frames.len() {
            self.map_stride = Some(rendering.stride);
            rendering.mean_entropy = Some(rendering.entropy / rendering.frame as f32);
            rendering.complete = rendering.stride == 1;
            rendering.stride = (rendering.stride / 2).max(1);
            rendering.frame = 0;
            rendering.entropy = 0.0;
            self.report_status();
            let generation = self.generation;
            self.outbox.send(Event::AllMaps { generation });
        }
        self.render_seconds += start.elapsed().as_secs_f64();
        Ok(true)
    }

    fn is_settled(&self) -> bool {
        self.rests() && !self.paused && self.rendering.complete
    }
}

impl WorkerTask for ReferenceWorker<'_> {
    fn handle(&mut self, command: Command) -> Result<bool, WorkerError> {
        match command {
            Command::Labels { labels, generation } => self.set_labels(labels, generation)?,
            // All frames are rendered at a stride before any is at the next.
            Command::View { .. } => {}
            // There are no suggestions without a surface, and nothing is known before it is learnt.
            Command::SuggestOn { .. } | Command::Preview(_) => {}
            // Labels do not spread along a surface here, so that none can be left out for a check.
            Command::CheckStrokes => {}
            Command::Render(_) => self.outbox.send(Event::NotRendered(
                "The published network takes minutes for a view of the scene: it is not shown here."
                    .to_owned(),
            )),
            Command::Pause => {
                self.paused = true;
                self.report_status();
            }
            Command::Resume => {
                self.paused = false;
                self.settling = false;
                self.report_status();
            }
            Command::Settle => {
                self.settling = true;
                self.reporter.repeat_next();
            }
            Command::Save => {
                if let Some(trainer) = &self.trainer {
                    let state = saved(&trainer.state()?, trainer.steps())?;
                    self.outbox.send(Event::State(Arc::new(state)));
                }
            }
            Command::Stop => return Ok(false),
        }
        Ok(true)
    }

    fn report_status(&mut self) {
        let trainer = self.trainer.as_ref();
        let status = Status {
            phase: if self.paused {
                Phase::Paused
            } else {
                Phase::Training
            },
            steps: trainer.map_or(0, ReferenceTrainer::steps),
            training_end: trainer
                .is_some_and(ReferenceTrainer::settled)
                .then_some(TrainingEnd::Learnt),
            work: trainer.map_or(Work::default(), ReferenceTrainer::work),
            geometry_seconds: self.training_seconds,
            render_seconds: self.render_seconds,
            skipped_steps: trainer.map_or(0, ReferenceTrainer::skipped),
            held_out_psnr: self.held_out.map(|held_out| held_out.psnr),
            depth_error: self.held_out.and_then(|held_out| held_out.depth_error),
            mean_entropy: self.rendering.mean_entropy,
            parameters: trainer.map_or(0, |trainer| trainer.field().parameters()),
            capacity: self.settings.to_string(),
            map_stride: self.map_stride,
            generation: self.generation,
            settled: self.is_settled(),
            ..Status::default()
        };
        self.reporter.report(self.outbox, status);
    }

    fn advance(&mut self) -> Result<bool, WorkerError> {
        if self.reporter.is_due() || (!self.reporter.reported_settled() && self.is_settled()) {
            self.report_status();
        }
        Ok(self.train()? || self.render()?)
    }
}

/// Row-major indices of the pixels that are rendered: the middle one of every square of `stride` pixels,
/// squares that the image's border cuts included.
fn coarse_pixels(camera: &Camera, stride: u32) -> Vec<usize> {
    let middles =
        |size: u32| (0..size.div_ceil(stride)).map(move |k| (k * stride + stride / 2).min(size - 1));
    middles(camera.height)
        .flat_map(|row| middles(camera.width).map(move |column| (row * camera.width + column) as usize))
        .collect()
}

/// The most likely class of a ray, and the entropy in the steps of a map.
fn most_likely(ray: &ReferenceRay, classes: &[ClassId]) -> (ClassId, u16) {
    let probabilities = ray.probabilities.iter().zip(classes);
    let best = probabilities.max_by(|(a, _), (b, _)| a.total_cmp(b));
    (
        best.map_or(VOID, |(_, &class)| class),
        (ray.entropy * ENTROPY_STEPS_PER_NAT).round() as u16,
    )
}

/// The dense map of a (frame, generation) from the classes and entropies of its [`coarse_pixels`]: each pixel has those
/// of its square, and painted pixels have the class of the stroke. `None` if the number of pixels is wrong.
fn frame_map(
    scene: &Scene,
    labels: &LabelSet,
    (frame, generation): (usize, u64),
    stride: u32,
    said: &[(ClassId, u16)],
) -> Option<FrameMap> {
    let camera = &scene.frames[frame].camera;
    let columns = camera.width.div_ceil(stride);
    let (mut classes, mut entropy): (Vec<ClassId>, Vec<u16>) = (0..camera.pixels() as u32)
        .map(|index| {
            let (row, column) = (index / camera.width, index % camera.width);
            said[(row / stride * columns + column / stride) as usize]
        })
        .unzip();
    for (pixel, (class, _)) in rasterise(labels, frame, camera.width, camera.height) {
        classes[pixel as usize] = class;
        entropy[pixel as usize] = 0;
    }
    for pixel in scene.frames[frame].hidden_pixels() {
        classes[pixel] = VOID;
        entropy[pixel] = 0;
    }
    let size = [camera.width, camera.height];
    FrameMap::new(frame, generation, size, classes, entropy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::testing::clicked;
    use crate::scene::testing::{hide, wall};

    #[test]
    fn every_square_has_a_rendered_pixel_inside_the_image_and_shows_it() {
        let scene = wall(1, 10, 7);
        let camera = &scene.frames[0].camera;
        let pixels = coarse_pixels(camera, 4);
        assert_eq!(pixels, [22, 26, 29, 62, 66, 69]);
        assert_eq!(coarse_pixels(camera, 128), [69]);
        assert_eq!(coarse_pixels(camera, 1), (0..70).collect::<Vec<_>>());

        let said: Vec<(ClassId, u16)> = (1..=6).map(|class| (class, 10 * class)).collect();
        let map = frame_map(&scene, &LabelSet::default(), (0, 1), 4, &said).unwrap();
        let (labels, entropies) = (map.labels(), map.entropy());
        for (pixel, &(class, entropy)) in pixels.iter().zip(&said) {
            assert_eq!((labels[*pixel], entropies[*pixel]), (class, entropy));
        }
        assert_eq!((labels[0], labels[9], labels[69]), (1, 3, 6));
    }

    #[test]
    fn painted_pixels_have_the_class_of_their_stroke_and_hidden_ones_are_void() {
        let mut scene = wall(1, 10, 7);
        hide(&mut scene.frames[0], |index| index == 3);
        let clicks = [(0, 1, [2, 0]), (0, 1, [3, 0]), (0, VOID, [4, 0])];
        let history = clicked(&["dark"], &clicks);
        let map = frame_map(&scene, history.labels(), (0, 1), 128, &[(9, 500)]).unwrap();
        assert_eq!(map.labels()[1..6], [9, 1, VOID, VOID, 9]);
        assert_eq!(map.entropy()[1..6], [500, 0, 0, 0, 500]);
    }
}
