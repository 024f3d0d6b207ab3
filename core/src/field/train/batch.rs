//! The pixels of a training step.

use glam::Vec3;
use rand::seq::IndexedRandom;
use rand::{Rng, rngs::SmallRng};

use super::super::Ray;
use crate::scene::Scene;

/// One ray in this number goes through a sparse point, where the capture has sparse points.
const SPARSE_EVERY: usize = 3;
/// One ray in this number goes through a point that stereo found, in the first steps, so many. They give the field its shape
/// sooner than colours do; more or later ones would hold it where they are wrong. A multiple of the number above, so that no
/// ray is due for both.
const STEREO_EVERY: usize = 9;
const STEREO_STEPS: u64 = 1000;
/// Share of the rays that come in threes, evenly spaced on a line across the image, where no depth is
/// measured.
const SHARE_OF_TRIPLES: f32 = 0.2;
/// Largest distance of the outer pixels of three from the middle one, in widths of the image.
const REACH: f32 = 0.19;

/// Rays of some pixels of the training frames.
#[derive(Debug, Default)]
pub struct Batch {
    /// The rays. The first `3 * triples` are in threes: all first pixels, all middle, all last.
    pub rays: Vec<Ray>,
    /// Colours of their pixels, `[rays, 3]`.
    pub colors: Vec<f32>,
    /// Their frames.
    pub frames: Vec<u32>,
    /// Number of threes.
    pub triples: usize,
    /// Ray length over z-depth of the rays in threes, `[3, triples]`.
    pub slants: Vec<f32>,
}

/// Draws batches from the frames of a scene.
#[derive(Debug)]
pub struct PixelSource {
    frames: Vec<usize>,
    /// Sparse points of the capture: (frame, index of the point).
    sparse: Vec<(usize, usize)>,
    /// Those that stereo found.
    stereo: Vec<(usize, usize)>,
    triples: bool,
}

impl PixelSource {
    /// Draws from these frames; in threes where `triples` says so.
    pub fn new(scene: &Scene, frames: Vec<usize>, triples: bool) -> Self {
        let points_of =
            |&frame: &usize| (0..scene.frames[frame].points.len()).map(move |point| (frame, point));
        let by_stereo = |&(frame, point): &(usize, usize)| scene.frames[frame].points[point].by_stereo;
        let (stereo, sparse) = frames.iter().flat_map(points_of).partition(by_stereo);
        Self {
            sparse,
            stereo,
            frames,
            triples,
        }
    }

    /// About `count` random rays for a step after so many others; pixels that the image does not show are left out.
    pub fn draw(&self, scene: &Scene, steps: u64, count: usize, rng: &mut SmallRng) -> Batch {
        let mut batch = Batch::default();
        if self.triples {
            self.draw_triples(
                scene,
                (SHARE_OF_TRIPLES * count as f32 / 3.0) as usize,
                rng,
                &mut batch,
            );
        }
        for number in batch.rays.len()..count {
            let points: &[_] = if number % SPARSE_EVERY == 0 {
                &self.sparse
            } else if number % STEREO_EVERY == 1 && steps < STEREO_STEPS {
                &self.stereo
            } else {
                &[]
            };
            let (frame, index, length) = if let Some(&(frame, point)) = points.choose(rng) {
                let point = scene.frames[frame].points[point];
                (frame, point.pixel as usize, Some(point.length))
            } else {
                let frame = self.frames[rng.random_range(0..self.frames.len())];
                let index = rng.random_range(0..scene.frames[frame].camera.pixels());
                (frame, index, None)
            };
            if scene.frames[frame].is_valid(index) {
                batch.push(scene, frame, index, length);
            }
        }
        batch
    }

    fn draw_triples(&self, scene: &Scene, count: usize, rng: &mut SmallRng, batch: &mut Batch) {
        let drawn: Vec<(usize, [usize; 3])> = (0..count)
            .filter_map(|_| {
                let frame = self.frames[rng.random_range(0..self.frames.len())];
                let camera = &scene.frames[frame].camera;
                let middle = [
                    rng.random_range(0..camera.width as i32),
                    rng.random_range(0..camera.height as i32),
                ];
                let radius = 1.0 + REACH * camera.width as f32 * rng.random::<f32>().powi(2);
                let angle = rng.random_range(0.0..std::f32::consts::PI);
                let step = [radius * angle.cos(), radius * angle.sin()].map(|v| v.round() as i32);
                let pixel = |sign: i32| {
                    let [x, y] = [0, 1].map(|axis| middle[axis] + sign * step[axis]);
                    let inside =
                        (0..camera.width as i32).contains(&x) && (0..camera.height as i32).contains(&y);
                    let index = inside.then(|| y as usize * camera.width as usize + x as usize)?;
                    scene.frames[frame].is_valid(index).then_some(index)
                };
                Some((frame, [pixel(-1)?, pixel(0)?, pixel(1)?]))
            })
            .collect();
        batch.triples = drawn.len();
        for place in 0..3 {
            for (frame, pixels) in &drawn {
                batch.push(scene, *frame, pixels[place], None);
                let own = &scene.frames[*frame];
                let forward = Vec3::from(own.camera_to_world.matrix3.z_axis);
                let cosine = own.ray_direction(pixels[place]).dot(forward);
                batch.slants.push(1.0 / cosine.max(1e-3));
            }
        }
    }
}

impl Batch {
    fn push(&mut self, scene: &Scene, frame: usize, index: usize, length: Option<f32>) {
        let ray = Ray::through(&scene.frames[frame], index);
        self.rays.push(Ray {
            length: length.or(ray.length),
            ..ray
        });
        let color = scene.frames[frame].color_of(index);
        self.colors.extend(color.to_array());
        self.frames.push(frame as u32);
    }

    /// The colour of a ray's pixel.
    pub fn color(&self, ray: usize) -> Vec3 {
        Vec3::from_slice(&self.colors[3 * ray..])
    }

    /// Rays whose length is known.
    pub fn measured(&self) -> usize {
        self.rays.iter().filter(|ray| ray.length.is_some()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SparsePoint;
    use crate::scene::testing::wall;
    use rand::SeedableRng;

    #[test]
    fn only_pixels_in_threes_lie_on_a_line_along_which_inverse_depth_is_even() {
        let scene = wall(4, 40, 30);
        let source = PixelSource::new(&scene, vec![0, 2], true);
        let batch = source.draw(&scene, 0, 600, &mut SmallRng::seed_from_u64(1));
        assert!(batch.triples > 20 && batch.rays.len() == 600 && batch.frames.len() == 600);
        assert!(batch.frames.iter().all(|frame| [0, 2].contains(frame)));
        for k in 0..batch.triples {
            // The wall is a plane: its inverse z-depth is linear in the image.
            let inverse = [0, 1, 2].map(|place| {
                let ray = place * batch.triples + k;
                batch.slants[ray] / batch.rays[ray].length.unwrap()
            });
            assert!((inverse[0] + inverse[2] - 2.0 * inverse[1]).abs() < 1e-3);
        }
        let alone = PixelSource::new(&scene, vec![1], false);
        let batch = alone.draw(&scene, 0, 100, &mut SmallRng::seed_from_u64(1));
        assert_eq!((batch.triples, batch.rays.len(), batch.measured()), (0, 100, 100));
    }

    #[test]
    fn points_of_stereo_count_at_first_and_those_of_a_structure_from_motion_always() {
        let mut scene = wall(2, 40, 30);
        for (frame, by_stereo) in scene.frames.iter_mut().zip([true, false]) {
            frame.set_depth(None);
            frame.points = vec![SparsePoint {
                pixel: 7,
                length: 2.0,
                error: 0.0,
                by_stereo,
            }];
        }
        let source = PixelSource::new(&scene, vec![0, 1], false);
        let frames = |steps| {
            let batch = source.draw(&scene, steps, 300, &mut SmallRng::seed_from_u64(1));
            let known = batch
                .rays
                .iter()
                .zip(&batch.frames)
                .filter(|(ray, _)| ray.length.is_some());
            known.map(|(_, &frame)| frame).collect::<Vec<u32>>()
        };
        let first = frames(STEREO_STEPS - 1);
        let of_frame = |frame| first.iter().filter(|&&own| own == frame).count();
        assert_eq!([of_frame(0), of_frame(1)], [34, 100]);
        assert_eq!(frames(STEREO_STEPS), [1; 100]);
    }
}
