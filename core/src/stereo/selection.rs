//! Which views a view is matched with, and compared with.

use glam::Vec3;

use super::view::View;

/// Views that a view takes depth from; it is compared with the first of them, and matched with fewer.
const LISTED: usize = 20;
pub const CHECKED: usize = 10;
pub const MATCHED: usize = 5;
/// Angle between two rays to a point, in radians, that places it best without changing its looks: 9 degrees, and how
/// fast others are worth less, in logarithms of their share of it.
const BEST_ANGLE: f32 = 0.157;
const ANGLE_SPREAD: f32 = 0.5;
/// Views that are nearer together than this, as a share of the distance of what they see, tell the same.
const APART: f32 = 0.04;
/// Views of a point beside which another tells half as much as the first.
const ENOUGH: f32 = 0.5;
/// Views whose score is looked at: those whose axes meet nearest together.
const CANDIDATES: usize = 96;

/// The views that show most of `points`, world positions in what view `own` sees, from other directions: the best
/// first, at most [`LISTED`].
pub fn select(views: &[View], own: usize, points: &[Vec3]) -> Vec<usize> {
    let view = &views[own];
    let mut distances: Vec<f32> = points.iter().map(|point| point.distance(view.center)).collect();
    distances.sort_by(f32::total_cmp);
    let Some(&distance) = distances.get(distances.len() / 2) else {
        return Vec::new();
    };
    // A cheap look at all, so that the time does not grow with the square of the frames.
    let far = |other: &View| {
        let at = |view: &View| view.center + distance * view.forward();
        at(view).distance(at(other)) + 0.5 * view.center.distance(other.center)
    };
    let mut others: Vec<usize> = (0..views.len()).filter(|&other| other != own).collect();
    others.sort_by(|&a, &b| far(&views[a]).total_cmp(&far(&views[b])));
    others.truncate(CANDIDATES);
    let mut rest: Vec<(usize, f32, Vec<f32>)> = others
        .into_iter()
        .map(|other| {
            let worths: Vec<f32> = points
                .iter()
                .map(|&point| worth(view, &views[other], point))
                .collect();
            (other, 1.0, worths)
        })
        .filter(|(_, _, worths)| worths.iter().any(|&worth| worth > 0.0))
        .collect();
    let mut chosen = Vec::new();
    let mut shown = vec![0.0; points.len()];
    while chosen.len() < LISTED {
        let gain = |(_, new, worths): &(usize, f32, Vec<f32>)| {
            let gains = worths
                .iter()
                .zip(&shown)
                .map(|(worth, shown)| worth / (ENOUGH + shown));
            new * gains.sum::<f32>()
        };
        let gains = rest.iter().map(gain).enumerate();
        let Some((place, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let (best, _, worths) = rest.swap_remove(place);
        for (shown, worth) in shown.iter_mut().zip(worths) {
            *shown += worth;
        }
        for (other, new, _) in &mut rest {
            let apart = views[*other].center.distance(views[best].center) / distance;
            *new *= 1.0 - (-(apart / APART).powi(2)).exp() + 1e-3;
        }
        chosen.push(best);
    }
    chosen
}

/// How well another view shows a point.
fn worth(view: &View, other: &View, point: Vec3) -> f32 {
    let shown = other.camera.project(other.local(point));
    if shown.is_none_or(|(x, y)| !other.camera.contains(x, y)) {
        return 0.0;
    }
    let (own, others) = (point - view.center, point - other.center);
    let angle = own.angle_between(others).max(1e-5);
    let size = own.length() / others.length();
    (-0.5 * ((angle / BEST_ANGLE).ln() / ANGLE_SPREAD).powi(2)).exp() * size.min(1.0 / size)
}
