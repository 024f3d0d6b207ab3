//! Views of a labelled scene from any pose.

use glam::Affine3A;
use rayon::prelude::*;

use super::borders::nodes_at_borders;
use super::{ENTROPY_STEPS_PER_NAT, FrameMap, NO_NODE, NearestNodes, Posterior, Surface};
use crate::field::{FieldError, Trainer, camera_rays, render_rays};
use crate::scene::{Camera, ColorImage, DepthMap, Frame, FramePixels};

/// Largest distance of a ray's end in the field from the voxel whose class it gets, in voxels. What is farther from the
/// surface was seen by no frame.
const REACH: f32 = 6.0;

/// Renders views of a labelled scene: colour and depth by the field, classes by the surface where the rays end.
pub struct NovelViews<'a> {
    trainer: &'a Trainer,
    surface: &'a Surface,
    posterior: &'a Posterior,
    nearest: NearestNodes<'a>,
    /// Entropy of pixels without a node, as in [`FrameMap::entropy`].
    unknown: u16,
}

impl<'a> NovelViews<'a> {
    /// Views of a field, by a surface of its scene and the posterior of its nodes, with this number of classes.
    pub fn new(trainer: &'a Trainer, surface: &'a Surface, posterior: &'a Posterior, classes: usize) -> Self {
        Self {
            trainer,
            surface,
            posterior,
            nearest: NearestNodes::new(surface),
            unknown: ((classes.max(1) as f32).ln() * ENTROPY_STEPS_PER_NAT).round() as u16,
        }
    }

    /// The view of a camera with this pose (camera-to-world, relative to the scene's origin, in metres): a frame with
    /// the rendered colour and depth, named `view_NUMBER`, and its map.
    ///
    /// A pixel has the class of the voxel that is nearest to where its ray ends, and along borders the one that fits
    /// its colour and depth best, as in the maps of the frames. It is void, with the highest entropy, where the ray
    /// ends at something that no frame has seen.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn view(
        &self,
        number: usize,
        camera: &Camera,
        camera_to_world: &Affine3A,
    ) -> Result<(Frame, FrameMap), FieldError> {
        let rays = camera_rays(camera, camera_to_world);
        let (field, occupancy) = (self.trainer.field(), self.trainer.occupancy());
        let rendered = render_rays(field, occupancy, &rays, self.trainer.render_step(), true)?;
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
        let frame = Frame {
            stem: format!("view_{number}"),
            path: std::path::PathBuf::new(),
            camera: *camera,
            camera_to_world: *camera_to_world,
            pixels: FramePixels::new(color, Some(DepthMap::from_ray_lengths(camera.width, &lengths))),
            points: Vec::new(),
            lens: None,
        };
        let nodes = nodes_at_borders(&frame, &shown, self.surface.graph.nodes(), &self.posterior.labels);
        let size = [camera.width, camera.height];
        let map = FrameMap::of_view(number, size, &nodes, self.posterior, self.unknown);
        Ok((frame, map))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::field::Preset;
    use crate::labels::VOID;
    use crate::scene::testing::wall;
    use crate::semantics::CERTAIN;

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
        let posterior = Posterior {
            labels: nodes
                .iter()
                .map(|node| if node.position.x < 0.0 { 3 } else { 7 })
                .collect(),
            entropy: nodes
                .iter()
                .map(|node| if node.position.x < 1.0 { 10 } else { 900 })
                .collect(),
            confidence: vec![CERTAIN; nodes.len()],
            runners_up: vec![VOID; nodes.len()],
            ..Posterior::default()
        };
        let views = NovelViews::new(&trainer, &surface, &posterior, 2);
        let camera = Camera::with_horizontal_fov(40, 30, 60.0);
        let pose = Affine3A::from_translation(Vec3::new(0.05, 0.03, 0.3));
        let (frame, map) = views.view(4, &camera, &pose).unwrap();
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
        let away = Affine3A::from_rotation_y(std::f32::consts::PI);
        let (_, map) = views.view(0, &camera, &away).unwrap();
        assert!(
            map.labels().iter().all(|&label| label == VOID),
            "nobody looked there"
        );
        assert!(map.entropy().iter().all(|&entropy| entropy == 6931), "ln 2");
    }
}
