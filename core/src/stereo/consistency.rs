//! Whether the depths of several views agree on one surface (Merrell et al. 2007).

use super::view::{View, Warp};

/// What counts as the same place: as a share of the depth, and in pixels of the view that is checked.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    pub depth: f32,
    pub pixels: f32,
}

/// What other views say of a pixel's depth.
#[derive(Clone, Copy, Default)]
pub struct Verdict {
    /// Views that see the same surface there.
    pub agree: u8,
    /// Views that see through it.
    pub violate: u8,
    /// Mean inverse depth of the pixel and of those that agree.
    pub mean: f32,
}

impl Verdict {
    /// Whether at least so many views agree, and more than see through it.
    pub fn is_sure(&self, least: u8) -> bool {
        self.agree >= least && self.agree > self.violate
    }
}

/// Compares a view's inverse z-depths with those of others; 0 is unknown.
pub fn verdicts(
    view: &View,
    inverse: &[f32],
    others: &[(&View, &[f32])],
    tolerance: Tolerance,
    mut wanted: impl FnMut(usize) -> bool,
) -> Vec<Verdict> {
    let warps: Vec<[Warp; 2]> = others
        .iter()
        .map(|(other, _)| [Warp::new(view, other), Warp::new(other, view)])
        .collect();
    let mut verdicts = vec![Verdict::default(); inverse.len()];
    for (index, verdict) in verdicts.iter_mut().enumerate() {
        let own = inverse[index];
        if own <= 0.0 || !wanted(index) {
            continue;
        }
        let (x, y) = view.camera.center_of(index);
        let mut sum = own;
        for ((other, theirs), [there, back]) in others.iter().zip(&warps) {
            let Some((at, expected)) = there.pixel((x, y), own, &other.camera) else {
                continue;
            };
            let seen = theirs[at];
            if seen <= 0.0 {
                continue;
            }
            let ratio = seen / expected;
            if (ratio - 1.0).abs() < tolerance.depth {
                let Some((u, v, inverse)) = back.apply(other.camera.center_of(at), seen) else {
                    continue;
                };
                if (u - x).powi(2) + (v - y).powi(2) < tolerance.pixels.powi(2) {
                    verdict.agree += 1;
                    sum += inverse;
                }
            } else if ratio < 1.0 {
                verdict.violate += 1;
            }
        }
        verdict.mean = sum / f32::from(verdict.agree + 1);
    }
    verdicts
}
