//! Poses and depths that put corners where they are seen: Levenberg and Marquardt's method with a robust loss.
//!
//! A corner has one unknown, its inverse z-depth in its own keyframe (Civera et al. 2008). It is found anew for all poses
//! that are tried and leaves the equations by its Schur complement, so that those of the poses remain. They are kept star by
//! star and solved by conjugate gradients, in time and memory that grow with the keyframes alone.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::tracks::{Sighting, Star, Track, direction, project};
use crate::scene::Camera;
use crate::scene::pixel_errors::median;

/// Unknowns of a pose: how it is turned about the camera's centre, and shifted, along the world's axes.
const UNKNOWNS: usize = 6;
/// Times that the scale of the robust loss is chosen, and that scale, in median errors of the corners.
const ROUNDS: usize = 3;
const SCALE: f64 = 2.0;
/// Most steps with a scale, and the relative fall of the cost below which there is no other.
const MOST_STEPS: usize = 6;
const LEAST_FALL: f64 = 1e-3;
/// Share of the equations' diagonal that is added to it at first, and how much less or more after a step that was good or
/// not.
const DAMPING: f64 = 1e-3;
const DAMPED: f64 = 10.0;
/// A pose that moves what its camera sees by a pixel costs as much as so many corners that are off by one: next to nothing
/// unless the corners do not tell.
const PRIOR: f64 = 1.0;
/// Steps of Gauss and Newton's method that find the depth of a corner.
const DEPTH_STEPS: usize = 4;
/// Where conjugate gradients end, relative to where they begin, and after how many steps at most.
const TOLERANCE: f64 = 1e-2;
const MOST_ITERATIONS: usize = 100;
/// What a corner costs that is behind the camera, as one that is so many pixels off.
const BEHIND: f64 = 1e3;
/// Keeps quotients finite.
const TINY: f64 = 1e-12;

/// An adjustment of poses under way.
pub struct Adjustment {
    cameras: Vec<Camera>,
    /// The capture's own poses, camera-to-world.
    own: Vec<DAffine3>,
    /// Those that fit better.
    pub poses: Vec<DAffine3>,
    stars: Vec<Star>,
    /// How far a camera is turned, in radians, or shifted, in metres, to move what it sees by about a pixel: the units of
    /// the unknowns.
    units: [f64; 2],
}

/// The equations of the poses of a star: `hessian * step = -gradient`, row-major.
struct Equations {
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    cost: f64,
}

/// How far a corner is from where it is seen.
struct Residual {
    /// In pixels.
    error: DVec2,
    /// Gradients of its x and y by the direction, in world axes, in which the camera sees the corner.
    axes: [DVec3; 2],
    /// Its derivative by the corner's inverse depth.
    by_inverse: DVec2,
}

impl Adjustment {
    /// Of keyframes' cameras, their poses, camera-to-world, and a star for each of them.
    pub fn new(cameras: Vec<Camera>, own: Vec<DAffine3>, stars: Vec<Star>) -> Self {
        let focal = median(cameras.iter().map(|camera| f64::from(camera.fx))).unwrap_or(1.0);
        let mut adjustment = Self {
            cameras,
            poses: own.clone(),
            own,
            stars,
            units: [1.0 / focal; 2],
        };
        let inverse = adjustment.of_tracks(f64::INFINITY, |_, _, inverse, found| found.push(inverse));
        if let Some(inverse) = median(inverse.into_iter().filter(|&inverse| inverse > 0.0)) {
            adjustment.units[1] = 1.0 / (inverse * focal);
        }
        adjustment
    }

    /// Moves the poses to where the corners fit, unless `go_on` says `false` before.
    pub fn adjust(&mut self, go_on: &(dyn Fn() -> bool + Sync)) {
        for _ in 0..ROUNDS {
            let Some(error) = median(self.errors(f64::INFINITY, false).into_iter()) else {
                return;
            };
            let scale = SCALE * error;
            let mut damping = DAMPING;
            let (mut equations, mut cost) = self.equations(scale, &self.poses);
            for _ in 0..MOST_STEPS {
                if !go_on() {
                    return;
                }
                let poses = self.moved(&self.step(&equations, damping));
                let (next, next_cost) = self.equations(scale, &poses);
                if next_cost < cost {
                    let fall = 1.0 - next_cost / cost;
                    (self.poses, equations, cost) = (poses, next, next_cost);
                    damping /= DAMPED;
                    if fall < LEAST_FALL {
                        break;
                    }
                } else {
                    damping *= DAMPED;
                }
            }
        }
    }

    /// Distances of the held-out sightings from where the others of their corners put them, in pixels.
    pub fn held_out_errors(&self) -> Vec<f64> {
        let error = median(self.errors(f64::INFINITY, false).into_iter());
        error.map_or(Vec::new(), |error| self.errors(SCALE * error, true))
    }

    /// How far each keyframe's pose has moved what it sees, in pixels: the median over its corners, 0 without any.
    pub fn moved_pixels(&self) -> Vec<f64> {
        let moved = |star: &Star| {
            let number = star.views[0];
            let (own, pose, camera) = (&self.own[number], &self.poses[number], &self.cameras[number]);
            let shift = pose.translation - own.translation;
            let moved = star.tracks.iter().filter_map(|track| {
                let inverse = self.inverse_depth(star, track, f64::INFINITY, &self.poses)?;
                let before = own.matrix3.transpose() * (pose.matrix3 * track.ray + inverse * shift);
                Some(project(camera, before)?.distance(project(camera, track.ray)?))
            });
            median(moved).unwrap_or(0.0)
        };
        self.stars.par_iter().map(moved).collect()
    }

    /// Distances of the sightings that have a say, or of the held-out ones, in pixels.
    fn errors(&self, scale: f64, held_out: bool) -> Vec<f64> {
        self.of_tracks(scale, |star, track, inverse, errors| {
            for sighting in &track.sightings {
                if sighting.is_held_out == held_out {
                    let residual = self.residual(star, track, sighting, inverse, &self.poses);
                    errors.push(residual.map_or(f64::INFINITY, |residual| residual.error.length()));
                }
            }
        })
    }

    /// What `look` collects of all tracks and their inverse depths.
    fn of_tracks(&self, scale: f64, look: impl Fn(&Star, &Track, f64, &mut Vec<f64>) + Sync) -> Vec<f64> {
        let of_star = |star: &Star| {
            let mut collected = Vec::new();
            for track in &star.tracks {
                if let Some(inverse) = self.inverse_depth(star, track, scale, &self.poses) {
                    look(star, track, inverse, &mut collected);
                }
            }
            collected
        };
        let of_stars: Vec<Vec<f64>> = self.stars.par_iter().map(of_star).collect();
        of_stars.concat()
    }

    /// The inverse z-depth of a corner in its keyframe, per metre; `None` where fewer than two sightings have a say.
    fn inverse_depth(&self, star: &Star, track: &Track, scale: f64, poses: &[DAffine3]) -> Option<f64> {
        if used(track).count() < 2 {
            return None;
        }
        // Where the rays meet, by least squares of their cross products.
        let anchor = &poses[star.views[0]];
        let (mut above, mut below) = (0.0, 0.0);
        for sighting in used(track) {
            let number = star.views[sighting.view];
            let pose = &poses[number];
            let seen = pose.matrix3 * direction(&self.cameras[number], sighting.place);
            let far = seen.cross(anchor.matrix3 * track.ray);
            let near = seen.cross(anchor.translation - pose.translation);
            above -= far.dot(near);
            below += near.length_squared();
        }
        let mut inverse = above / below.max(TINY);
        for _ in 0..DEPTH_STEPS {
            let (mut gradient, mut curvature) = (0.0, 0.0);
            for sighting in used(track) {
                if let Some(residual) = self.residual(star, track, sighting, inverse, poses) {
                    let weight = weight(residual.error, scale);
                    gradient += weight * residual.by_inverse.dot(residual.error);
                    curvature += weight * residual.by_inverse.length_squared();
                }
            }
            inverse -= gradient / curvature.max(TINY);
        }
        inverse.is_finite().then_some(inverse)
    }

    /// Of a sighting of a corner at this inverse depth; `None` behind the camera.
    fn residual(
        &self,
        star: &Star,
        track: &Track,
        sighting: &Sighting,
        inverse: f64,
        poses: &[DAffine3],
    ) -> Option<Residual> {
        let (anchor, number) = (&poses[star.views[0]], star.views[sighting.view]);
        let (pose, camera) = (&poses[number], &self.cameras[number]);
        let shift = anchor.translation - pose.translation;
        let local = pose.matrix3.transpose() * (anchor.matrix3 * track.ray + inverse * shift);
        let error = project(camera, local)? - sighting.place;
        let [x, y] = [f64::from(camera.fx), f64::from(camera.fy)];
        let axes = [
            DVec3::new(x, 0.0, -x * local.x / local.z) / local.z,
            DVec3::new(0.0, y, -y * local.y / local.z) / local.z,
        ];
        let axes = axes.map(|axis| pose.matrix3 * axis);
        Some(Residual {
            error,
            by_inverse: DVec2::new(axes[0].dot(shift), axes[1].dot(shift)),
            axes,
        })
    }

    /// The equations of all stars at these poses, and the cost, the prior's included.
    fn equations(&self, scale: f64, poses: &[DAffine3]) -> (Vec<Equations>, f64) {
        let stars = self.stars.par_iter();
        let equations: Vec<Equations> = stars.map(|star| self.equations_of(star, scale, poses)).collect();
        let moved = (0..poses.len()).map(|number| {
            let moved = self.offset(number, &poses[number]);
            dot(&moved, &moved)
        });
        let cost = PRIOR * moved.sum::<f64>() + equations.iter().map(|own| own.cost).sum::<f64>();
        (equations, cost)
    }

    fn equations_of(&self, star: &Star, scale: f64, poses: &[DAffine3]) -> Equations {
        let side = UNKNOWNS * star.views.len();
        let mut equations = Equations {
            hessian: vec![0.0; side * side],
            gradient: vec![0.0; side],
            cost: 0.0,
        };
        let [turn, shift] = self.units;
        let anchor = &poses[star.views[0]];
        // The hessian between the unknowns of each view and the inverse depth of a corner.
        let mut mixed = vec![[0.0; UNKNOWNS]; star.views.len()];
        for track in &star.tracks {
            let Some(inverse) = self.inverse_depth(star, track, scale, poses) else {
                continue;
            };
            let ray = anchor.matrix3 * track.ray;
            let (mut gradient, mut curvature) = (0.0, 0.0);
            for sighting in used(track) {
                let Some(residual) = self.residual(star, track, sighting, inverse, poses) else {
                    equations.cost += loss(BEHIND, scale);
                    continue;
                };
                equations.cost += loss(residual.error.length(), scale);
                let weight = weight(residual.error, scale);
                let pose = &poses[star.views[sighting.view]];
                let seen = ray + inverse * (anchor.translation - pose.translation);
                for axis in 0..2 {
                    let (by, by_inverse) = (residual.axes[axis], residual.by_inverse[axis]);
                    let rows = [
                        (0, joined(turn * ray.cross(by), shift * inverse * by)),
                        (
                            sighting.view,
                            joined(turn * by.cross(seen), -shift * inverse * by),
                        ),
                    ];
                    for (view, row) in &rows {
                        add(equations.gradient_of(*view), row, weight * residual.error[axis]);
                        add(&mut mixed[*view], row, weight * by_inverse);
                        for (other, column) in &rows {
                            equations.add([*view, *other], row, column, weight);
                        }
                    }
                    gradient += weight * by_inverse * residual.error[axis];
                    curvature += weight * by_inverse * by_inverse;
                }
            }
            let views = || std::iter::once(0).chain(used(track).map(|sighting| sighting.view));
            let curvature = curvature.max(TINY);
            for view in views() {
                add(equations.gradient_of(view), &mixed[view], -gradient / curvature);
                for other in views() {
                    equations.add([view, other], &mixed[view], &mixed[other], -1.0 / curvature);
                }
            }
            views().for_each(|view| mixed[view].fill(0.0));
        }
        equations
    }

    /// How far a pose is from the capture's own, in units of the unknowns.
    fn offset(&self, number: usize, pose: &DAffine3) -> [f64; UNKNOWNS] {
        let own = &self.own[number];
        let turn = DQuat::from_mat3(&(pose.matrix3 * own.matrix3.transpose())).to_scaled_axis();
        let shift = pose.translation - own.translation;
        joined(turn / self.units[0], shift / self.units[1])
    }

    /// The step that solves the equations of all stars and the prior, with so much damping: by conjugate gradients with the
    /// diagonal as preconditioner.
    fn step(&self, equations: &[Equations], damping: f64) -> Vec<f64> {
        let count = UNKNOWNS * self.poses.len();
        let (mut residual, mut diagonal) = (vec![0.0; count], vec![PRIOR; count]);
        for (number, pose) in self.poses.iter().enumerate() {
            let offset = self.offset(number, pose);
            add(&mut residual[UNKNOWNS * number..], &offset, -PRIOR);
        }
        for (star, equations) in self.stars.iter().zip(equations) {
            for (own, view) in star.views.iter().enumerate() {
                for unknown in 0..UNKNOWNS {
                    let [at, place] = [view, &own].map(|view| UNKNOWNS * view + unknown);
                    residual[at] -= equations.gradient[place];
                    diagonal[at] += equations.hessian[place * (equations.gradient.len() + 1)];
                }
            }
        }
        let scaled =
            |values: &[f64]| -> Vec<f64> { values.iter().zip(&diagonal).map(|(v, d)| v / d).collect() };
        let mut step = vec![0.0; count];
        let mut direction = scaled(&residual);
        let mut gain = dot(&residual, &direction);
        let enough = TOLERANCE * TOLERANCE * gain;
        for _ in 0..MOST_ITERATIONS {
            if gain <= enough {
                break;
            }
            let mut product = self.times(equations, &direction);
            for ((product, direction), diagonal) in product.iter_mut().zip(&direction).zip(&diagonal) {
                *product += (PRIOR + damping * diagonal) * direction;
            }
            let length = gain / dot(&direction, &product);
            add(&mut step, &direction, length);
            add(&mut residual, &product, -length);
            let mut next = scaled(&residual);
            let next_gain = dot(&residual, &next);
            add(&mut next, &direction, next_gain / gain);
            (direction, gain) = (next, next_gain);
        }
        step
    }

    /// The product of all stars' hessians with these unknowns.
    fn times(&self, equations: &[Equations], unknowns: &[f64]) -> Vec<f64> {
        let of_star = |(star, equations): (&Star, &Equations)| -> Vec<f64> {
            let own = star
                .views
                .iter()
                .map(|view| &unknowns[UNKNOWNS * view..][..UNKNOWNS]);
            let own = own.collect::<Vec<_>>().concat();
            let rows = equations.hessian.chunks_exact(own.len());
            rows.map(|row| dot(row, &own)).collect()
        };
        let stars = self.stars.par_iter().zip(equations);
        let products: Vec<Vec<f64>> = stars.map(of_star).collect();
        let mut sums = vec![0.0; unknowns.len()];
        for (star, product) in self.stars.iter().zip(products) {
            for (view, product) in star.views.iter().zip(product.chunks_exact(UNKNOWNS)) {
                add(&mut sums[UNKNOWNS * view..], product, 1.0);
            }
        }
        sums
    }

    /// The poses after a step.
    fn moved(&self, step: &[f64]) -> Vec<DAffine3> {
        let steps = step.chunks_exact(UNKNOWNS);
        let moved = self.poses.iter().zip(steps).map(|(pose, step)| {
            let [turn, shift] = [&step[..3], &step[3..]].map(DVec3::from_slice);
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(self.units[0] * turn));
            DAffine3::from_mat3_translation(turn * pose.matrix3, pose.translation + self.units[1] * shift)
        });
        moved.collect()
    }
}

impl Equations {
    /// The gradient by the unknowns of a view.
    fn gradient_of(&mut self, view: usize) -> &mut [f64] {
        &mut self.gradient[UNKNOWNS * view..]
    }

    /// Adds `factor * row * column'` to the hessian between two views.
    fn add(&mut self, views: [usize; 2], row: &[f64; UNKNOWNS], column: &[f64; UNKNOWNS], factor: f64) {
        let side = self.gradient.len();
        let [top, left] = views.map(|view| UNKNOWNS * view);
        for (line, value) in row.iter().enumerate() {
            let sums = &mut self.hessian[(top + line) * side + left..];
            add(sums, column, factor * value);
        }
    }
}

/// The sightings that have a say.
fn used(track: &Track) -> impl Iterator<Item = &Sighting> {
    track.sightings.iter().filter(|sighting| !sighting.is_held_out)
}

/// Cauchy's loss of an error.
fn loss(error: f64, scale: f64) -> f64 {
    scale * scale * (error / scale).powi(2).ln_1p()
}

/// The weight by which squares of errors have the gradient of that loss.
fn weight(error: DVec2, scale: f64) -> f64 {
    1.0 / (1.0 + error.length_squared() / (scale * scale))
}

fn joined(turn: DVec3, shift: DVec3) -> [f64; UNKNOWNS] {
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds `factor * more` to the first values.
fn add(sums: &mut [f64], more: &[f64], factor: f64) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += factor * more;
    }
}
