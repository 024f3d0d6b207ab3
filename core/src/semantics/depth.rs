//! The ray length of every pixel: measured where it is, else the field's.

use super::Node;
use crate::scene::{ColorImage, Frame, Pixels};

/// Ray lengths that the field renders for a frame at 1/`stride` of its resolution.
#[derive(Clone, Debug)]
pub struct FieldDepth {
    /// Pixels of the frame per sample, along each axis.
    pub stride: u32,
    /// Samples along x.
    pub width: u32,
    /// Row-major ray lengths in metres; infinite where the ray meets nothing.
    pub lengths: Vec<f32>,
}

/// Ray length of the pixel of a frame with this row-major index, in metres: infinite where the ray meets nothing,
/// not a number where it is unknown (as yet) and outside the image on disk.
pub fn pixel_length(frame: &Frame, pixels: &Pixels, field: Option<&FieldDepth>, index: usize) -> f32 {
    let measured = pixels.depth.as_ref().and_then(|depth| depth.ray_length(index));
    match (measured, field) {
        (Some(length), _) => length,
        (None, _) if !pixels.color.is_valid(index) => f32::NAN,
        (None, Some(field)) => field.at(frame, &pixels.color, index),
        (None, None) => f32::NAN,
    }
}

impl FieldDepth {
    /// Ray lengths to a surface instead of the field: its nodes are drawn as squares of the size of their voxels, the
    /// nearest in front. Not a number where there is no node; infinite where there is one of the shell, whose voxels
    /// are `shell` metres wide. Nodes that are seen from behind are left out.
    pub(super) fn of_surface(frame: &Frame, nodes: &[Node], shell: f32, stride: u32) -> Self {
        let width = frame.camera.width.div_ceil(stride);
        let height = frame.camera.height.div_ceil(stride);
        let mut lengths = vec![f32::NAN; (width * height) as usize];
        let focal = frame.camera.fx.max(frame.camera.fy) / stride as f32;
        for node in nodes {
            let Some((x, y, length)) = frame.project(node.position) else {
                continue;
            };
            if node.normal.dot(node.position - frame.center()) > 0.0 {
                continue;
            }
            let half = 0.5 * (node.voxel * focal / length.max(1e-3)).max(1.0);
            let span = |middle: f32, size: u32| {
                let middle = middle / stride as f32;
                (middle - half).max(0.0) as u32..((middle + half).ceil() as u32).min(size)
            };
            let is_shell = node.voxel == shell;
            let length = if is_shell { f32::INFINITY } else { length };
            for row in span(y, height) {
                for column in span(x, width) {
                    let there = &mut lengths[(row * width + column) as usize];
                    // `min` ignores what is not a number.
                    *there = length.min(*there);
                }
            }
        }
        Self {
            stride,
            width,
            lengths,
        }
    }

    /// Between the four samples around a pixel: bilinear on one surface, else the sample whose colour is
    /// the most like the pixel's.
    pub(super) fn at(&self, frame: &Frame, image: &ColorImage, index: usize) -> f32 {
        let camera = &frame.camera;
        let height = self.lengths.len() as u32 / self.width;
        let stride = self.stride as f32;
        let x = ((index as u32 % camera.width) as f32 + 0.5) / stride - 0.5;
        let y = ((index as u32 / camera.width) as f32 + 0.5) / stride - 0.5;
        let (x0, y0) = (x.max(0.0) as u32, y.max(0.0) as u32);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(height - 1));
        let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
        let lengths = corners.map(|(x, y)| self.lengths[(y * self.width + x) as usize]);
        let nearest = lengths.iter().copied().fold(f32::INFINITY, f32::min);
        let farthest = lengths.iter().copied().fold(0.0, f32::max);
        if nearest.is_infinite() {
            // Between infinite ends there is no number.
            let meets_nothing = lengths.contains(&f32::INFINITY);
            return if meets_nothing { f32::INFINITY } else { f32::NAN };
        }
        let all_known = !lengths.iter().any(|length| length.is_nan());
        if all_known && farthest <= 1.08 * nearest {
            let (fx, fy) = ((x - x0 as f32).clamp(0.0, 1.0), (y - y0 as f32).clamp(0.0, 1.0));
            let upper = lengths[0] + fx * (lengths[1] - lengths[0]);
            let lower = lengths[2] + fx * (lengths[3] - lengths[2]);
            return upper + fy * (lower - upper);
        }
        let own = image.color(index);
        let color_gap = |&(x, y): &(u32, u32)| {
            let sample = (y * self.width + x) as usize;
            (image.color(camera.middle_of_reduced(self.stride, sample)) - own).length_squared()
        };
        let gaps = corners.map(|corner| color_gap(&corner));
        let known = (0..4).filter(|&corner| !lengths[corner].is_nan());
        let best = known.min_by(|&a, &b| gaps[a].total_cmp(&gaps[b])).unwrap_or(0);
        lengths[best]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::wall;
    use crate::semantics::Surface;

    #[test]
    fn the_surface_of_other_frames_gives_the_lengths_that_a_frame_would_have_measured() {
        let scene = wall(3, 64, 48);
        let surface = Surface::build(&scene, &[], 4.0).unwrap();
        let frame = &scene.frames[1];
        let measured = frame.depth().unwrap();
        let found = FieldDepth::of_surface(frame, surface.graph.nodes(), 99.0, 4);
        assert_eq!((found.width, found.lengths.len()), (16, 16 * 12));
        for (sample, length) in found.lengths.iter().enumerate() {
            let (column, row) = (sample % 16, sample / 16);
            let expected = measured.ray_length((4 * row + 2) * 64 + 4 * column + 2).unwrap();
            // The nearer of two squares that meet in a sample hides the other.
            assert!(
                (length - expected).abs() < 2.0 * surface.voxel,
                "{sample}: {length} instead of {expected}"
            );
        }
        // What lies on the shell is infinitely far, and nothing is seen from behind.
        let voxel = surface.voxel;
        let shell = FieldDepth::of_surface(frame, surface.graph.nodes(), voxel, 4);
        assert!(shell.lengths.iter().all(|length| length.is_infinite()));
        let mut behind = frame.clone();
        behind.camera_to_world = glam::Affine3A::from_rotation_translation(
            glam::Quat::from_rotation_y(std::f32::consts::PI),
            glam::Vec3::new(0.0, 0.0, 4.0),
        );
        let nothing = FieldDepth::of_surface(&behind, surface.graph.nodes(), 99.0, 4);
        assert!(nothing.lengths[6 * 16 + 8].is_nan());
    }

    #[test]
    fn where_all_samples_meet_nothing_so_do_the_pixels_between() {
        let mut frame = wall(1, 16, 8).frames.remove(0);
        frame.set_depth(None);
        let near = |index: u32| if index % 4 < 2 { 2.0 } else { f32::INFINITY };
        let field = FieldDepth {
            stride: 4,
            width: 4,
            lengths: (0..8).map(near).collect(),
        };
        let pixels = frame.pixels().unwrap();
        for pixel in 0..frame.camera.pixels() {
            let length = pixel_length(&frame, &pixels, Some(&field), pixel);
            match pixel % 16 {
                0..6 => assert_eq!(length, 2.0, "pixel {pixel}"),
                10.. => assert_eq!(length, f32::INFINITY, "pixel {pixel}"),
                // Between the two it is one of them, never a mixture.
                _ => assert!(length == 2.0 || length.is_infinite(), "pixel {pixel}: {length}"),
            }
        }
    }
}
