//! The field as seen from a frame, rendered in slices.

use std::sync::Arc;

use super::sampling;
use super::semantic_trainer::SemanticTrainer;
use crate::field::{FieldError, Ray, RenderedRay, Trainer, frame_rays, render_rays};
use crate::labels::ClassId;
use crate::scene::{Camera, ColorImage, Scene};
use crate::semantics::{FrameMap, most_likely};

/// Rays rendered between two looks at the commands.
const RAYS_AT_A_TIME: usize = 1024;
/// Most rays of a view: they take about a second on two cores.
const MOST_RAYS: usize = 80_000;
/// How much coarser, along each axis, the first pass is: it takes a sixteenth of the time.
const COARSER: u32 = 4;

/// The field as seen from a frame.
#[derive(Clone, Debug)]
pub struct RenderedFrame {
    /// Index of the frame.
    pub frame: usize,
    /// Training steps of the field when it was rendered.
    pub steps: u64,
    /// Training steps of the semantic field.
    pub semantic_steps: u64,
    /// Generation of the labels at that time.
    pub generation: u64,
    /// Whether no finer image of these steps follows.
    pub is_last: bool,
    /// Pixels of the frame, along each axis, per pixel here: the centre of pixel (0, 0) here is at
    /// (0.5 stride, 0.5 stride) of the frame.
    pub stride: u32,
    /// Rendered colours, row-major, the frame's size divided by the stride and rounded up.
    pub color: ColorImage,
    /// Depth along the camera's axis (z) of every pixel, in metres, row-major; 0 where the ray meets nothing.
    pub depth: Vec<f32>,
    /// Class and entropy of every pixel here by the semantic field; `None` before it has learnt anything.
    pub labels: Option<Arc<FrameMap>>,
}

impl RenderedFrame {
    /// Depth (z) in metres of a pixel of the frame; `None` where the ray meets nothing, and outside the image.
    pub fn depth_at(&self, [x, y]: [u32; 2]) -> Option<f32> {
        let (column, row) = (x / self.stride, y / self.stride);
        let inside = column < self.color.width() && row < self.color.height();
        let index = inside.then(|| (row * self.color.width() + column) as usize)?;
        self.depth.get(index).copied().filter(|&depth| depth > 0.0)
    }
}

/// A view under way: a coarse pass, then a fine one.
pub(super) struct FrameRendering {
    frame: usize,
    /// Stride of the pass under way.
    stride: u32,
    /// Stride of the last pass.
    finest: u32,
    /// Camera and rays of the pass under way, once it has been begun.
    begun: Option<(Camera, Vec<Ray>)>,
    done: Vec<RenderedRay>,
    /// Class and entropy of the rays done, where there is a semantic field.
    labels: Vec<(ClassId, u16)>,
    is_done: bool,
}

impl FrameRendering {
    /// A view from this frame; `None` when there is no such frame.
    pub(super) fn new(scene: &Scene, frame: usize) -> Option<Self> {
        let camera = &scene.frames.get(frame)?.camera;
        let fits = |stride: &u32| camera.reduced(*stride).pixels() <= MOST_RAYS;
        let finest = (1..).find(fits).unwrap_or(1);
        Some(Self {
            frame,
            stride: COARSER * finest,
            finest,
            begun: None,
            done: Vec::new(),
            labels: Vec::new(),
            is_done: false,
        })
    }

    /// Whether the last pass is complete.
    pub(super) fn is_done(&self) -> bool {
        self.is_done
    }

    /// Renders some more rays; returns the image at the end of each pass.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub(super) fn advance(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        (semantics, generation): (&SemanticTrainer, u64),
    ) -> Result<Option<RenderedFrame>, FieldError> {
        let frame = &scene.frames[self.frame];
        let (camera, rays) = self.begun.get_or_insert_with(|| frame_rays(frame, self.stride));
        let from = self.done.len();
        let slice = &rays[from..(from + RAYS_AT_A_TIME).min(rays.len())];
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        self.done
            .extend(render_rays(field, occupancy, slice, trainer.render_step(), true)?);
        if let Some(semantics) = semantics.field() {
            let sampling = sampling(trainer, None);
            let probabilities = semantics.along_rays(field, occupancy, slice, sampling)?;
            let classes = semantics.classes();
            let rows = probabilities.chunks_exact(classes.len().max(1));
            self.labels.extend(rows.map(|row| most_likely(classes, row)));
        }
        if self.done.len() < rays.len() {
            return Ok(None);
        }
        let rgb = self.done.iter().flat_map(|ray| {
            let color = (255.0 * ray.color).round().to_array();
            // A cast saturates.
            color.map(|channel| channel as u8)
        });
        let color = ColorImage::new(camera.width, camera.height, rgb.collect());
        let width = camera.width as usize;
        let z_depth = |(index, ray): (usize, &RenderedRay)| {
            let direction = camera.pixel_direction((index % width) as u32, (index / width) as u32);
            ray.length.map_or(0.0, |length| length / direction.length())
        };
        let depth = self.done.iter().enumerate().map(z_depth).collect();
        let (labels, entropy) = std::mem::take(&mut self.labels).into_iter().unzip();
        // Where the semantic field came into being during the pass, there are not all pixels.
        let size = [camera.width, camera.height];
        let labels = FrameMap::new(self.frame, generation, size, labels, entropy).map(Arc::new);
        let stride = self.stride;
        self.is_done = stride == self.finest;
        self.stride = self.finest;
        self.begun = None;
        self.done.clear();
        Ok(color.map(|color| RenderedFrame {
            frame: self.frame,
            steps: trainer.steps(),
            semantic_steps: semantics.steps(),
            generation,
            is_last: self.is_done,
            stride,
            color,
            depth,
            labels,
        }))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::field::Preset;
    use crate::scene::testing::wall;

    #[test]
    fn a_view_comes_coarse_first_and_then_at_the_frames_own_size() {
        let scene = Arc::new(wall(3, 64, 48));
        let trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
        let semantics = SemanticTrainer::restored(&HashMap::new(), &trainer);
        let mut rendering = FrameRendering::new(&scene, 1).unwrap();
        let mut views = Vec::new();
        let mut slices = 0;
        while !rendering.is_done() {
            views.extend(rendering.advance(&scene, &trainer, (&semantics, 0)).unwrap());
            slices += 1;
        }
        assert_eq!(slices, 1 + 3);
        let about = |view: &RenderedFrame| (view.stride, view.color.width(), view.depth.len(), view.is_last);
        let all: Vec<_> = views.iter().map(about).collect();
        assert_eq!(all, [(4, 16, 16 * 12, false), (1, 64, 64 * 48, true)]);
        assert!(FrameRendering::new(&scene, 3).is_none());
    }

    #[test]
    fn large_frames_are_rendered_with_a_stride_and_read_by_their_own_pixels() {
        let scene = wall(1, 1000, 700);
        assert_eq!(FrameRendering::new(&scene, 0).unwrap().finest, 3);
        let view = RenderedFrame {
            frame: 0,
            steps: 0,
            semantic_steps: 0,
            generation: 0,
            is_last: true,
            stride: 3,
            color: ColorImage::new(2, 1, vec![0; 6]).unwrap(),
            depth: vec![1.5, 0.0],
            labels: None,
        };
        assert_eq!(view.depth_at([2, 2]), Some(1.5));
        assert_eq!((view.depth_at([3, 0]), view.depth_at([0, 3])), (None, None));
    }
}
