//! Which frame shows a place of the surface best.

use glam::Vec3;

use super::{Node, Surface};
use crate::labels::Pixel;
use crate::scene::{Frame, Scene};

/// Largest distance of a pixel that shows a node from the node's projection, in voxels: a pixel shows the voxel that
/// its ray meets, and a node is the mean of the points in it.
const REACH: f32 = 1.0;
/// The same in pixels.
const FARTHEST: f32 = 24.0;
/// Score of a view at a grazing angle, and of one at the border of the image, relative to the best.
const GRAZING: f32 = 0.2;
const BORDER: f32 = 0.3;

/// The keyframe that shows a node of the surface best, and a pixel there that shows it: a stroke on that pixel labels
/// that node. `None` where no frame shows it.
///
/// The score of a view is c f / d: d is the distance from the camera; c falls with the square of the distance from the
/// middle of the image, from 1 to 0.3 at its corners; f rises with the cosine between the normal and the direction to
/// the camera, from 0.2 to 1, and is their mean where the node has no normal. The first of equally good frames is
/// taken.
pub fn best_view(scene: &Scene, surface: &Surface, node: u32) -> Option<(usize, Pixel)> {
    let shown = surface.graph.nodes().get(node as usize)?;
    let seen = |frame: usize| {
        let (pixel, worth) = view(&scene.frames[frame], surface, frame, node, shown)?;
        Some((worth, frame, pixel))
    };
    let frames = scene.frames.len().min(surface.pixels.len());
    (0..frames)
        .filter_map(seen)
        .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
        .map(|(_, frame, pixel)| (frame, pixel))
}

/// The pixel of a frame that shows a node, nearest to its projection, and the score of this view.
fn view(frame: &Frame, surface: &Surface, number: usize, node: u32, shown: &Node) -> Option<(Pixel, f32)> {
    let (x, y, length) = frame.project(shown.position)?;
    let camera = &frame.camera;
    let reach = (REACH * shown.voxel * camera.fx.max(camera.fy) / length.max(1e-3)).min(FARTHEST);
    let pixels = &surface.pixels[number];
    let span = |middle: f32, size: u32| {
        let last = size.saturating_sub(1) as f32;
        let first = (middle - reach).clamp(0.0, last) as u32;
        first..=(middle + reach).clamp(0.0, last) as u32
    };
    let gap = |&[column, row]: &Pixel| (column as f32 + 0.5 - x).powi(2) + (row as f32 + 0.5 - y).powi(2);
    let pixel = span(y, camera.height)
        .flat_map(|row| span(x, camera.width).map(move |column| [column, row]))
        .filter(|&[column, row]| pixels.node((row * camera.width + column) as usize) == Some(node))
        .min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
    let half = [0.5 * camera.width as f32, 0.5 * camera.height as f32];
    let off_centre = 0.5 * (((x - half[0]) / half[0]).powi(2) + ((y - half[1]) / half[1]).powi(2));
    let central = 1.0 - (1.0 - BORDER) * off_centre.min(1.0);
    let cosine = if shown.normal == Vec3::ZERO {
        0.5
    } else {
        let towards = (frame.center() - shown.position).normalize_or_zero();
        shown.normal.dot(towards).max(0.0)
    };
    let facing = GRAZING + (1.0 - GRAZING) * cosine;
    Some((pixel, central * facing / length.max(1e-3)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Affine3A;

    use super::super::{NO_NODE, NodeMap};
    use super::*;
    use crate::scene::DepthMap;
    use crate::scene::testing::wall;

    fn built(scene: &Scene) -> Surface {
        Surface::build(scene, &[], 4.0).unwrap()
    }

    fn node_at(surface: &Surface, frame: usize, [column, row]: Pixel, width: u32) -> u32 {
        surface.pixels[frame]
            .node((row * width + column) as usize)
            .unwrap()
    }

    #[test]
    fn the_pixel_found_shows_the_node_in_the_frame_where_it_is_most_central() {
        let scene = wall(5, 64, 48);
        let surface = built(&scene);
        // Cameras side by side, the first at the left: what lies in the middle of its image is the first one's.
        for frame in 0..5 {
            let node = node_at(&surface, frame, [32, 24], 64);
            let (best, pixel) = best_view(&scene, &surface, node).unwrap();
            assert_eq!(node_at(&surface, best, pixel, 64), node);
            assert!(best.abs_diff(frame) <= 1, "{frame}: {best} at {pixel:?}");
            assert!(pixel[0].abs_diff(32) <= 4 && pixel[1].abs_diff(24) <= 4);
        }
        let nothing = Arc::new(NodeMap::pack(64, &[NO_NODE; 64 * 48]));
        let hidden = Surface {
            pixels: std::iter::repeat_n(nothing, 5).collect(),
            ..surface
        };
        assert_eq!(best_view(&scene, &hidden, 0), None, "behind something");
        assert_eq!(best_view(&scene, &hidden, u32::MAX), None, "no such node");
    }

    #[test]
    fn the_nearer_of_two_frames_is_better() {
        let mut scene = wall(2, 64, 48);
        scene.frames[0].camera_to_world = Affine3A::from_translation(Vec3::ZERO);
        scene.frames[1].camera_to_world = Affine3A::from_translation(Vec3::new(0.0, 0.0, 1.0));
        let camera = scene.frames[1].camera;
        let near = DepthMap::from_z_depths(&camera, vec![1.0; camera.pixels()]);
        scene.frames[1].set_depth(Some(near));
        let surface = built(&scene);
        let node = node_at(&surface, 0, [32, 24], 64);
        assert_eq!(best_view(&scene, &surface, node).unwrap().0, 1);
    }
}
