//! Views of a labelled scene from any pose.

use std::sync::Arc;

use rayon::prelude::*;

use super::borders::nodes_at_borders;
use super::posterior::NodeSummary;
use super::{FrameMap, NO_NODE, NearestNodes, Posterior, SemanticField, Surface};
use crate::field::{FieldError, Sampling, Trainer, camera_rays, render_rays};
use crate::scene::{ColorImage, DepthMap, Frame, Pixels, Viewpoint};

/// Largest distance of a ray's end in the field from the voxel whose class it gets, in voxels. What is farther from the
/// surface was seen by no frame.
const REACH: f32 = 6.0;

/// Renders views of a labelled scene: colour and depth by the field, classes by the surface where the rays end, or by
/// the semantic field.
pub struct NovelViews<'a> {
    trainer: &'a Trainer,
    surface: &'a Surface,
    posterior: &'a Posterior,
    nearest: NearestNodes<'a>,
    semantics: Option<&'a SemanticField>,
    /// What is known of a pixel without a node.
    unknown: NodeSummary,
}

impl<'a> NovelViews<'a> {
    /// Views of a field, by a surface of its scene and the posterior of its nodes, with this number of classes.
    pub fn new(trainer: &'a Trainer, surface: &'a Surface, posterior: &'a Posterior, classes: usize) -> Self {
        Self {
            trainer,
            surface,
            posterior,
            nearest: NearestNodes::new(surface),
            semantics: None,
            unknown: NodeSummary::unknown(classes),
        }
    }

    /// The same views, in which a semantic field on the same radiance field says the classes: better than the surface
    /// where that is not measured.
    #[must_use]
    pub fn labelled_by(self, semantics: &'a SemanticField) -> Self {
        Self {
            semantics: Some(semantics),
            ..self
        }
    }

    /// The view from a place: a frame with the rendered colour and depth, named `view_NUMBER`, and its map.
    ///
    /// A pixel has the class of the voxel that is nearest to where its ray ends, and along borders the one that fits
    /// its colour and depth best, as in the maps of the frames; or the class that the semantic field renders
    /// (Semantic-NeRF, Eq. 4 and 5), but for rays that meet nothing. It is void, with the highest entropy, where the
    /// ray ends at something that no frame has seen.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn view(&self, number: usize, viewpoint: &Viewpoint) -> Result<(Frame, FrameMap), FieldError> {
        let Viewpoint {
            camera,
            camera_to_world,
        } = viewpoint;
        let rays = camera_rays(camera, camera_to_world);
        let (field, occupancy) = (self.trainer.field(), self.trainer.occupancy());
        let step = self.trainer.render_step();
        let rendered = render_rays(field, occupancy, &rays, step, true)?;
        // A cast saturates.
        let bytes = |color: glam::Vec3| (255.0 * color).round().to_array().map(|channel| channel as u8);
        let rgb = rendered.iter().flat_map(|ray| bytes(ray.color)).collect();
        let lengths: Vec<f32> = rendered.iter().map(|ray| ray.length.unwrap_or(0.0)).collect();
        let shown: Vec<u32> = rays
            .par_iter()
            .zip(&rendered)
            .map(|(ray, rendered)| {
                let node = match rendered.length {
                    Some(length) => {
                        let end = ray.origin + length * ray.direction;
                        self.nearest.nearest(end, REACH * self.surface.voxel)
                    }
                    None => self.nearest.beyond(ray.origin, ray.direction),
                };
                node.unwrap_or(NO_NODE)
            })
            .collect();
        let color = ColorImage::new(camera.width, camera.height, rgb)
            .ok_or_else(|| candle_core::Error::Msg("a view has not one colour for each pixel".to_owned()))?;
        let depth = Arc::new(DepthMap::from_ray_lengths(camera.width, &lengths));
        let pixels = Pixels {
            color: Arc::new(color),
            depth: Some(Arc::clone(&depth)),
        };
        let frame = Frame {
            stem: format!("view_{number}"),
            path: std::path::PathBuf::new(),
            camera: *camera,
            camera_to_world: *camera_to_world,
            pixels: pixels.into(),
            points: Vec::new(),
            lens: None,
        };
        let nodes = nodes_at_borders(
            &frame,
            &depth,
            &shown,
            self.surface.graph.nodes(),
            &self.posterior.labels,
        );
        let of_node = |&node: &u32| self.posterior.summary(node).unwrap_or(self.unknown);
        let mut pixels: Vec<NodeSummary> = nodes.iter().map(of_node).collect();
        if let Some(semantics) = self.semantics {
            let sampling = Sampling {
                step,
                ..Sampling::default()
            };
            let classes = semantics.classes();
            let probabilities = semantics.along_rays(field, occupancy, &rays, sampling)?;
            let rows = probabilities.chunks_exact(classes.len().max(1));
            for (((pixel, row), ray), &node) in pixels.iter_mut().zip(rows).zip(&rendered).zip(&shown) {
                if ray.length.is_some() && node != NO_NODE {
                    *pixel = NodeSummary::of(classes, row);
                }
            }
        }
        let map = FrameMap::of_view(number, [camera.width, camera.height], &pixels);
        Ok((frame, map))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine3A, Vec3};

    use super::*;
    use crate::field::Preset;
    use crate::labels::VOID;
    use crate::scene::Camera;
    use crate::scene::testing::wall;
    use crate::semantics::{CERTAIN, Node, most_likely};

    #[test]
    fn views_from_new_places_show_colour_depth_and_classes_of_the_wall() {
        let scene = Arc::new(wall(9, 64, 48));
        let mut trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
        for _ in 0..150 {
            trainer.step().unwrap();
        }
        let surface = Surface::build(&scene, &[], 4.0).unwrap();
        let nodes = surface.graph.nodes();
        // Dark is 3, bright is 7; the right half of what is bright is not sure.
        let label = |node: &Node| if node.position.x < 0.0 { 3 } else { 7 };
        let entropy = |node: &Node| if node.position.x < 1.0 { 10 } else { 900 };
        let posterior = Posterior {
            labels: nodes.iter().map(label).collect(),
            entropy: nodes.iter().map(entropy).collect(),
            confidence: vec![CERTAIN; nodes.len()],
            runners_up: vec![VOID; nodes.len()],
            ..Posterior::default()
        };
        let views = NovelViews::new(&trainer, &surface, &posterior, 2);
        let camera = Camera::with_horizontal_fov(40, 30, 60.0);
        let seen_from = |camera_to_world| Viewpoint {
            camera,
            camera_to_world,
        };
        let place = seen_from(Affine3A::from_translation(Vec3::new(0.05, 0.03, 0.3)));
        let (frame, map) = views.view(4, &place).unwrap();
        assert_eq!((frame.stem.as_str(), map.frame), ("view_4", 4));
        let (labels, entropy) = (map.labels(), map.entropy());
        let (color, depth) = (frame.color(), frame.depth().unwrap());
        let mut right = [0; 4];
        for pixel in 0..camera.pixels() {
            let on_wall =
                frame.center() + 1.7 * (camera.pixel_direction(pixel as u32 % 40, pixel as u32 / 40));
            let is_dark = on_wall.x < 0.0;
            right[0] += usize::from(labels[pixel] == if is_dark { 3 } else { 7 });
            right[1] += usize::from((color.pixel(pixel)[0] < 130) == is_dark);
            let z = depth.ray_length(pixel).unwrap_or(0.0) * frame.ray_direction(pixel).z;
            right[2] += usize::from((z - 1.7).abs() < 0.1);
            right[3] += usize::from(entropy[pixel] == if on_wall.x < 1.0 { 10 } else { 900 });
        }
        assert!(right.iter().all(|&count| count > 1140), "of 1200: {right:?}");
        assert!(map.confidence().is_some());
        let away = seen_from(Affine3A::from_rotation_y(std::f32::consts::PI));
        let (_, map) = views.view(0, &away).unwrap();
        let is_void = map.labels().iter().all(|&label| label == VOID);
        assert!(is_void, "nobody looked there");
        assert!(map.entropy().iter().all(|&entropy| entropy == 6931), "ln 2");

        // The semantic field says what the wall is, and nothing of what nobody has seen.
        let width = trainer.field().feature_width();
        let grid = trainer.capacity().semantic_grid();
        let semantics = SemanticField::new(&[3, 7], width, grid, None, 1).unwrap();
        let views = views.labelled_by(&semantics);
        let (_, by_field) = views.view(4, &place).unwrap();
        let rays = camera_rays(&camera, &place.camera_to_world);
        let sampling = Sampling {
            step: trainer.render_step(),
            ..Sampling::default()
        };
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        let rendered = semantics.along_rays(field, occupancy, &rays, sampling);
        let rendered = rendered.unwrap();
        let rendered = rendered.chunks_exact(2).map(|row| most_likely(&[3, 7], row));
        let (classes, entropy): (Vec<_>, Vec<_>) = rendered.unzip();
        let on_wall = (0..camera.pixels()).filter(|&pixel| entropy[pixel] == by_field.entropy()[pixel]);
        assert!(on_wall.count() > 1140);
        let shown = by_field.labels();
        let same = shown.iter().zip(&classes).filter(|(a, b)| a == b);
        assert!(same.count() > 1140);
        let (_, map) = views.view(0, &away).unwrap();
        assert!(map.labels().iter().all(|&label| label == VOID));
    }
}
