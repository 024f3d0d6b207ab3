//! What the same corners say under other conventions: which one a capture probably has.

use std::fmt;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::{CornerAgreement, FEWEST_CORNERS, MatchedPair, PixelErrors, WITHIN_PX, diagonal};
use crate::scene::{Camera, DepthMap, Frame, Scene};

/// Angle between two rays below which it is not clear where they meet, as a sine: half a degree.
const PARALLEL: f64 = 0.0087;
/// Largest relative difference of depth around a corner that is not at the border of a surface.
const SMOOTH: f32 = 0.03;
/// Share of the corners that another convention must bring within 2 pixels to be suggested, and how many times
/// that of the capture's own.
const CONVINCING: f64 = 0.4;
const CLEARLY_BETTER: f64 = 1.5;
/// Share within 2 pixels beyond that by chance up to which poses say nothing about the images.
const LIKE_CHANCE: f64 = 0.05;

/// How the numbers of a capture could be meant otherwise than they were read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Convention {
    pose: PoseMeaning,
    /// Whether the y and z axes of the cameras point the other way.
    flipped: bool,
    /// Focal lengths, in those that were read.
    focal: f64,
    /// Measured depth, in that which was read.
    depth: f64,
}

/// What a pose is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PoseMeaning {
    /// What it was taken for.
    AsRead,
    /// The inverse of that.
    Inverse,
    /// The rotation is the inverse, the position is right.
    Transposed,
}

impl Convention {
    /// As the capture was read.
    const AS_READ: Self = Self {
        pose: PoseMeaning::AsRead,
        flipped: false,
        focal: 1.0,
        depth: 1.0,
    };

    /// All others that are tried.
    fn others() -> Vec<Self> {
        use PoseMeaning::{AsRead, Inverse, Transposed};
        let own = Self::AS_READ;
        let poses = [
            (AsRead, true),
            (Inverse, false),
            (Inverse, true),
            (Transposed, false),
            (Transposed, true),
        ];
        let poses = poses.map(|(pose, flipped)| Self { pose, flipped, ..own });
        let focal = [0.5, 0.625, 0.8, 1.25, 1.6, 2.0].map(|focal| Self { focal, ..own });
        let depth = [0.001, 0.1, 0.2, 0.5, 2.0, 5.0, 10.0, 1000.0].map(|depth| Self { depth, ..own });
        [poses.as_slice(), &focal, &depth].concat()
    }

    /// Camera-to-world of a frame, in metres.
    fn pose(&self, scene: &Scene, frame: &Frame) -> DAffine3 {
        let mut rotation = frame.camera_to_world.matrix3.as_dmat3();
        // The scene's origin is its own choice: an inverse is that of the pose in the capture's coordinates.
        let mut centre = scene.to_capture(frame.center()) / scene.unit;
        match self.pose {
            PoseMeaning::AsRead => {}
            PoseMeaning::Inverse => {
                rotation = rotation.transpose();
                centre = -(rotation * centre);
            }
            PoseMeaning::Transposed if self.flipped => {
                // As the reader turned the axes before: those of the rotation's inverse are the world's.
                rotation = flip() * rotation.transpose();
            }
            PoseMeaning::Transposed => rotation = rotation.transpose(),
        }
        if self.flipped {
            rotation *= flip();
        }
        DAffine3::from_mat3_translation(rotation, centre)
    }

    /// Focal lengths and principal point of a camera, in pixels along x and y.
    fn intrinsics(&self, camera: &Camera) -> (DVec2, DVec2) {
        let (focal, centre) = camera.intrinsics();
        (self.focal * focal, centre)
    }

    /// The direction through a position in a frame's image, in pixels, in camera axes with z = 1.
    fn direction(&self, camera: &Camera, place: DVec2) -> DVec3 {
        let (focal, centre) = self.intrinsics(camera);
        ((place - centre) / focal).extend(1.0)
    }
}

/// Turns y and z round.
fn flip() -> DMat3 {
    DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0))
}

impl fmt::Display for Convention {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.focal != 1.0 {
            return write!(
                formatter,
                "the focal lengths were about {} times as long",
                self.focal
            );
        }
        if self.depth != 1.0 {
            return write!(formatter, "depth was {} times as far", self.depth);
        }
        let axes = "the cameras' y and z axes pointed the other way (OpenGL's axes taken for OpenCV's, or the reverse)";
        match (self.pose, self.flipped) {
            (PoseMeaning::AsRead, _) => formatter.write_str(axes),
            (PoseMeaning::Inverse, false) => formatter.write_str(
                "the poses were inverted (world-to-camera taken for camera-to-world, or the reverse)",
            ),
            (PoseMeaning::Inverse, true) => write!(formatter, "the poses were inverted and {axes}"),
            (PoseMeaning::Transposed, _) => formatter.write_str("the rotations were transposed"),
        }
    }
}

/// What is probably wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Suspicion {
    /// This convention fits better: this share of the corners is within 2 pixels.
    Better(Convention, f64),
    /// Other frames' poses fit as well.
    Chance,
    /// The poses have to do with the images, but do not fit.
    Inexact,
}

/// What is compared: the place of a corner in both frames, and how far away it is in the first or in the second.
struct Corner {
    places: [DVec2; 2],
    /// Ray length where depth was measured and is smooth, in metres.
    lengths: [Option<f64>; 2],
}

/// Corners of all pairs, to be measured under any convention.
pub(super) struct Conventions<'a> {
    scene: &'a Scene,
    frames: Vec<[&'a Frame; 2]>,
    corners: Vec<Vec<Corner>>,
    lifted: bool,
}

impl<'a> Conventions<'a> {
    /// With depth, the corners whose distance is known; without, those of frames whose cameras are apart.
    pub fn new(scene: &'a Scene, matched: &[MatchedPair]) -> Self {
        let lifted = scene.has_depth();
        let (mut frames, mut corners) = (Vec::new(), Vec::new());
        for MatchedPair { pair, matches } in matched {
            let both = [&scene.frames[pair.first], &scene.frames[pair.second]];
            let depths = both.map(|frame| frame.depth());
            let length = |side: usize, place| length(both[side], depths[side].as_deref()?, place);
            let of_pair: Vec<Corner> = matches
                .iter()
                .map(|matched| Corner {
                    places: [matched.first, matched.second],
                    lengths: [length(0, matched.first), length(1, matched.second)],
                })
                .filter(|corner| !lifted || corner.lengths.iter().any(Option::is_some))
                .collect();
            if !of_pair.is_empty() && (lifted || !pair.is_turn) {
                frames.push(both);
                corners.push(of_pair);
            }
        }
        Self {
            scene,
            frames,
            corners,
            lifted,
        }
    }

    /// How well the capture fits as it was read; `None` where too few corners say it.
    pub fn agreement(&self) -> Option<CornerAgreement> {
        let distances = self.distances(&Convention::AS_READ, 0);
        let errors = PixelErrors::of(distances.clone()).filter(|errors| errors.count >= FEWEST_CORNERS)?;
        let by_chance = self.distances(&Convention::AS_READ, self.corners.len() / 2);
        Some(CornerAgreement {
            pairs: self.corners.len(),
            lifted_by_depth: self.lifted,
            errors,
            within_2_px: within(&distances),
            within_2_px_by_chance: within(&by_chance),
        })
    }

    /// What is probably wrong with a capture that fits like this, if anything.
    pub fn suspicion(&self, found: &CornerAgreement) -> Option<Suspicion> {
        if !found.errors.is_suspicious() {
            return None;
        }
        let tried = Convention::others().into_iter().map(|other| {
            let share = within(&self.distances(&other, 0));
            (other, share)
        });
        // The first of equals: it explains as much with less.
        let best = tried.fold(None, |best: Option<(Convention, f64)>, tried| match best {
            Some(best) if best.1 >= tried.1 => Some(best),
            _ => Some(tried),
        });
        let convincing = CONVINCING.max(CLEARLY_BETTER * found.within_2_px);
        Some(match best.filter(|&(_, share)| share >= convincing) {
            Some((convention, share)) => Suspicion::Better(convention, share),
            None if found.within_2_px <= found.within_2_px_by_chance + LIKE_CHANCE => Suspicion::Chance,
            None => Suspicion::Inexact,
        })
    }

    /// How far each corner is from where it should be, in pixels, if each pair had the poses of the pair that
    /// comes `shift` later.
    fn distances(&self, convention: &Convention, shift: usize) -> Vec<f64> {
        let distances = (0..self.corners.len()).into_par_iter().flat_map_iter(|index| {
            let posed = self.frames[(index + shift) % self.frames.len()];
            let [first, second] = posed.map(|frame| convention.pose(self.scene, frame));
            let there = second.inverse() * first;
            let view = View {
                convention,
                frames: self.frames[index],
                there,
                back: there.inverse(),
            };
            self.corners[index]
                .iter()
                .map(move |corner| view.distance(corner, self.lifted))
        });
        distances.collect()
    }
}

/// Two frames as they are under a convention.
struct View<'a> {
    convention: &'a Convention,
    frames: [&'a Frame; 2],
    /// From the first camera's axes to the second's, in metres; and back.
    there: DAffine3,
    back: DAffine3,
}

impl View<'_> {
    fn distance(&self, corner: &Corner, lifted: bool) -> f64 {
        let distance = if lifted {
            self.reprojection(corner)
        } else {
            self.epipolar(corner)
        };
        let farthest = diagonal(self.frames[1]);
        distance
            .filter(|v| v.is_finite())
            .map_or(farthest, |v| v.min(farthest))
    }

    /// Distance between where a frame shows the corner and where the other frame's depth puts it; the mean, where
    /// both frames have depth. `None` behind the camera.
    fn reprojection(&self, corner: &Corner) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (from, to, motion) in [(0, 1, &self.there), (1, 0, &self.back)] {
            let Some(length) = corner.lengths[from] else {
                continue;
            };
            let (camera, place) = (&self.frames[from].camera, corner.places[from]);
            let ray = self.convention.direction(camera, place);
            // Depth on disk is along z, so that another focal length leaves that alone.
            let z = length / Convention::AS_READ.direction(camera, place).length();
            let point = motion.transform_point3(self.convention.depth * z * ray);
            if point.z <= 0.0 {
                return None;
            }
            let (focal, centre) = self.convention.intrinsics(&self.frames[to].camera);
            sum += (focal * point.truncate() / point.z + centre).distance(corner.places[to]);
            count += 1.0;
        }
        (count > 0.0).then(|| sum / count)
    }

    /// Mean distance of the corner from the epipolar lines in both images; `None` where its rays meet behind a
    /// camera.
    fn epipolar(&self, corner: &Corner) -> Option<f64> {
        let cameras = self.frames.map(|frame| &frame.camera);
        let a = self.convention.direction(cameras[0], corner.places[0]);
        let b = self.convention.direction(cameras[1], corner.places[1]);
        let (rotation, translation) = (self.there.matrix3, self.there.translation);
        // The first ray in the second camera's axes starts at the translation: where do the two meet?
        let turned = rotation * a;
        let normal = turned.cross(b);
        let sine = normal.length() / (turned.length() * b.length());
        let ahead = if sine < PARALLEL {
            turned.dot(b) > 0.0
        } else {
            -translation.cross(b).dot(normal) > 0.0 && -translation.cross(turned).dot(normal) > 0.0
        };
        if !ahead {
            return None;
        }
        // Epipolar constraint b . (t x R a) = 0; the gradients along each image's axes turn it into pixels.
        let line_in_second = translation.cross(turned);
        let line_in_first = rotation.transpose() * b.cross(translation);
        let gap = b.dot(line_in_second).abs();
        let slope = |line: DVec3, camera: &Camera| {
            let focal = self.convention.focal;
            (line.x / (focal * f64::from(camera.fx))).hypot(line.y / (focal * f64::from(camera.fy)))
        };
        Some(0.5 * (gap / slope(line_in_second, cameras[1]) + gap / slope(line_in_first, cameras[0])))
    }
}

/// Share of the distances that are at most 2 pixels; 0 of none.
fn within(distances: &[f64]) -> f64 {
    let near = distances
        .iter()
        .filter(|&&distance| distance <= WITHIN_PX)
        .count();
    near as f64 / distances.len().max(1) as f64
}

/// Ray length at a position of a frame, in metres; `None` where its depth is not known, or is that of several surfaces.
fn length(frame: &Frame, depth: &DepthMap, place: DVec2) -> Option<f64> {
    let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
    let (column, row) = (place.x as usize, place.y as usize);
    if column == 0 || row == 0 || column + 1 >= width || row + 1 >= height {
        return None;
    }
    let own = depth.ray_length(row * width + column)?;
    let around = (row - 1..=row + 1).flat_map(|y| (column - 1..=column + 1).map(move |x| y * width + x));
    let (mut nearest, mut farthest) = (own, own);
    for index in around {
        let length = depth.ray_length(index)?;
        nearest = nearest.min(length);
        farthest = farthest.max(length);
    }
    let spread = f64::from(farthest) - f64::from(nearest);
    (spread <= f64::from(SMOOTH * own)).then_some(f64::from(own))
}
