//! The field as seen from a viewpoint, rendered in slices.

use std::sync::Arc;

use super::sampling;
use super::semantic_trainer::SemanticTrainer;
use crate::field::{FieldError, Ray, RenderedRay, Trainer, camera_rays, render_rays};
use crate::labels::{ClassId, Pixel};
use crate::scene::{Camera, ColorImage, Viewpoint};
use crate::semantics::most_likely;

/// Rays rendered between two looks at the commands.
const RAYS_AT_A_TIME: usize = 1024;
/// Most rays of a view: they take about a second on two cores.
const MOST_RAYS: usize = 80_000;
/// How much coarser, along each axis, the first pass is: it takes a sixteenth of the time.
const COARSER: u32 = 4;

/// The field as seen from a viewpoint.
#[derive(Clone, Debug)]
pub struct RenderedView {
    /// Where it is seen from.
    pub viewpoint: Viewpoint,
    /// Training steps of the field when it was rendered.
    pub steps: u64,
    /// Training steps of the semantic field.
    pub semantic_steps: u64,
    /// Generation of the labels at that time.
    pub generation: u64,
    /// Whether no finer image of these steps follows.
    pub is_last: bool,
    /// Pixels of the viewpoint's camera, along each axis, per pixel here: the centre of pixel (0, 0) here is at
    /// (0.5 stride, 0.5 stride) of the camera's image.
    pub stride: u32,
    /// Rendered colours, row-major, the camera's size divided by the stride and rounded up.
    pub color: ColorImage,
    /// Depth along the camera's axis (z) of every pixel, in metres, row-major; 0 where the ray meets nothing.
    pub depth: Vec<f32>,
    /// What the semantic field renders; `None` before it has learnt anything.
    pub labels: Option<RenderedLabels>,
}

/// Class and entropy of every pixel of a view by the semantic field, row-major.
#[derive(Clone, Debug)]
pub struct RenderedLabels {
    /// Most likely classes.
    pub classes: Arc<[ClassId]>,
    /// Entropies of the class distributions, in nats times
    /// [`ENTROPY_STEPS_PER_NAT`](crate::semantics::ENTROPY_STEPS_PER_NAT).
    pub entropy: Arc<[u16]>,
}

impl RenderedView {
    /// Depth (z) in metres of a pixel of the viewpoint's camera; `None` where the ray meets nothing, and outside the
    /// image.
    pub fn depth_at(&self, [x, y]: Pixel) -> Option<f32> {
        let (column, row) = (x / self.stride, y / self.stride);
        let inside = column < self.color.width() && row < self.color.height();
        let index = inside.then(|| (row * self.color.width() + column) as usize)?;
        self.depth.get(index).copied().filter(|&depth| depth > 0.0)
    }
}

/// A view under way: a coarse pass, then a fine one.
pub(super) struct ViewRendering {
    viewpoint: Viewpoint,
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

impl ViewRendering {
    /// A view from here.
    pub(super) fn new(viewpoint: Viewpoint) -> Self {
        let fits = |stride: &u32| viewpoint.camera.reduced(*stride).pixels() <= MOST_RAYS;
        let finest = (1..).find(fits).unwrap_or(1);
        Self {
            viewpoint,
            stride: COARSER * finest,
            finest,
            begun: None,
            done: Vec::new(),
            labels: Vec::new(),
            is_done: false,
        }
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
        trainer: &Trainer,
        (semantics, generation): (&SemanticTrainer, u64),
    ) -> Result<Option<RenderedView>, FieldError> {
        let Viewpoint {
            camera,
            camera_to_world,
        } = &self.viewpoint;
        let (camera, rays) = self.begun.get_or_insert_with(|| {
            let camera = camera.reduced(self.stride);
            (camera, camera_rays(&camera, camera_to_world))
        });
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
        let z_depth = |(index, ray): (usize, &RenderedRay)| {
            let direction = camera.direction_at(index);
            ray.length.map_or(0.0, |length| length / direction.length())
        };
        let depth = self.done.iter().enumerate().map(z_depth).collect();
        let labels = std::mem::take(&mut self.labels);
        // Where the semantic field came into being during the pass, there are not all pixels.
        let labels = (labels.len() == rays.len()).then(|| RenderedLabels {
            classes: labels.iter().map(|&(class, _)| class).collect(),
            entropy: labels.iter().map(|&(_, entropy)| entropy).collect(),
        });
        let stride = self.stride;
        self.is_done = stride == self.finest;
        self.stride = self.finest;
        self.begun = None;
        self.done.clear();
        Ok(color.map(|color| RenderedView {
            viewpoint: self.viewpoint,
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
    fn a_view_comes_coarse_first_and_then_at_its_own_size() {
        let scene = Arc::new(wall(3, 64, 48));
        let trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
        let semantics = SemanticTrainer::restored(&HashMap::new(), &trainer);
        let viewpoint = scene.frames[1].viewpoint();
        let mut rendering = ViewRendering::new(viewpoint);
        let mut views = Vec::new();
        let mut slices = 0;
        while !rendering.is_done() {
            views.extend(rendering.advance(&trainer, (&semantics, 0)).unwrap());
            slices += 1;
        }
        assert_eq!(slices, 1 + 3);
        assert!(views.iter().all(|view| view.viewpoint == viewpoint));
        let about = |view: &RenderedView| (view.stride, view.color.width(), view.depth.len(), view.is_last);
        let all: Vec<_> = views.iter().map(about).collect();
        assert_eq!(all, [(4, 16, 16 * 12, false), (1, 64, 64 * 48, true)]);
    }

    #[test]
    fn large_views_are_rendered_with_a_stride_and_read_by_the_cameras_own_pixels() {
        let viewpoint = wall(1, 1000, 700).frames[0].viewpoint();
        assert_eq!(ViewRendering::new(viewpoint).finest, 3);
        let view = RenderedView {
            viewpoint,
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
