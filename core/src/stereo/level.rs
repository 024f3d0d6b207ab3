//! All views at one size: matched, compared with one another, and filled.

use rayon::prelude::*;

use super::aggregation;
use super::consistency::{Tolerance, Verdict, verdicts};
use super::exploration::Setup;
use super::filling::{self, Seed, fill};
use super::selection::{CHECKED, MATCHED};
use super::sweep;
use super::view::{View, Warp};
use super::{StereoDepth, StereoError, Work, strides};
use crate::scene::Scene;

/// How far apart hypotheses are in the median view that is matched with, in pixels, and how many there may be. The
/// smallest images are matched before it is known how near the scene comes.
const LABEL_STEP: f32 = 1.0;
const LABELS: std::ops::RangeInclusive<usize> = 32..=128;

/// When a matched depth is sure: this many views agree, and more than see through it.
const MATCHED_TOLERANCE: Tolerance = Tolerance {
    depth: 0.015,
    pixels: 1.0,
};
const AGREE: u8 = 3;
/// When a filled depth is voted for: this many views agree, and twice as many as see through it.
const FILLED_TOLERANCE: Tolerance = Tolerance {
    depth: 0.03,
    pixels: f32::INFINITY,
};
const AGREE_FILLED: u8 = 4;
/// Weights of seeds beside one that was matched in the view itself: what one other view is sure of, what several are,
/// and what was voted for.
const BORROWED: f32 = 0.1;
const BORROWED_OFTEN: f32 = 0.3;
const VOTED: f32 = 0.05;
/// The farthest depth in units of the nearest.
const FARTHEST: f32 = 1000.0;

/// Views that a thread takes at least at a time, so that it keeps its buffers.
const AT_A_TIME: usize = 4;

/// All views at one size.
pub struct Level {
    pub views: Vec<View>,
}

#[derive(Default)]
struct Workspace {
    sweep: sweep::Workspace,
    aggregation: aggregation::Workspace,
    costs: Vec<u8>,
}

impl Level {
    /// The frames at the resolution that is matched, and reduced by these factors.
    ///
    /// # Errors
    /// A file that can no longer be read, or a caller that wants no more.
    pub fn read<const N: usize>(
        scene: &Scene,
        frames: &[usize],
        factors: [u32; N],
        work: &Work,
    ) -> Result<[Self; N], StereoError> {
        let views = |(&frame, stride): (&usize, u32)| {
            work.advance(0)?;
            let frame = &scene.frames[frame];
            let pixels = frame.pixels()?;
            Ok(factors.map(|factor| View::new(frame, &pixels.color, factor * stride)))
        };
        let read = frames
            .par_iter()
            .zip(strides(scene, frames))
            .map(views)
            .collect::<Result<Vec<_>, StereoError>>()?;
        let mut levels = [(); N].map(|()| Self {
            views: Vec::with_capacity(read.len()),
        });
        for view in read {
            for (level, view) in levels.iter_mut().zip(view) {
                level.views.push(view);
            }
        }
        Ok(levels)
    }

    /// Inverse depths by matching; each view is so many parts of the work.
    ///
    /// # Errors
    /// The caller wants no more.
    pub fn matched(&self, setup: &Setup, parts: usize, work: &Work) -> Result<Vec<Vec<f32>>, StereoError> {
        let one = |workspace: &mut Workspace, number: usize| {
            let matched = self.match_view(number, setup, workspace);
            work.advance(parts)?;
            Ok(matched)
        };
        let views = (0..self.views.len()).into_par_iter().with_min_len(AT_A_TIME);
        views.map_init(Workspace::default, one).collect()
    }

    fn match_view(&self, number: usize, setup: &Setup, workspace: &mut Workspace) -> Vec<f32> {
        let view = &self.views[number];
        let sources = setup.neighbours[number].iter().take(MATCHED);
        let sources: Vec<&View> = sources.map(|&other| &self.views[other]).collect();
        let labels = label_count(view, &sources, setup.nearest);
        let step = 1.0 / (setup.nearest * (labels - 1) as f32);
        let Workspace {
            sweep,
            aggregation,
            costs,
        } = workspace;
        sweep::costs(view, &sources, step, labels, sweep, costs);
        aggregation::inverse_depths(view, costs, step, labels, aggregation)
    }

    /// What the other views say of each pixel that is wanted, by view and index.
    pub fn checked<T: Send>(
        &self,
        setup: &Setup,
        inverse: &[Vec<f32>],
        tolerance: Tolerance,
        wanted: impl Fn(usize, usize) -> bool + Sync,
        conclude: impl Fn(f32, Verdict) -> T + Sync,
    ) -> Vec<Vec<T>> {
        let check = |number: usize| {
            let others = setup.neighbours[number].iter().take(CHECKED);
            let others: Vec<(&View, &[f32])> = others
                .map(|&other| (&self.views[other], inverse[other].as_slice()))
                .collect();
            let own = &inverse[number];
            let found = verdicts(&self.views[number], own, &others, tolerance, |index| {
                wanted(number, index)
            });
            own.iter()
                .zip(found)
                .map(|(&own, verdict)| conclude(own, verdict))
                .collect()
        };
        (0..self.views.len()).into_par_iter().map(check).collect()
    }

    /// The depth of these frames, the views, by what was matched: kept where views agree, and filled in between. Filling a
    /// view, which is done twice, is so many parts of the work.
    ///
    /// # Errors
    /// The caller wants no more.
    pub fn depth(
        &self,
        frames: &[usize],
        setup: &Setup,
        matched: Vec<Vec<f32>>,
        parts: usize,
        work: &Work,
    ) -> Result<Vec<StereoDepth>, StereoError> {
        let mut seeds = self.seeds(setup, &matched);
        drop(matched);
        let inverse = self.completed(setup, &mut seeds, parts, work)?;
        let views = frames.iter().zip(&self.views).zip(inverse.iter().zip(&seeds));
        let depth = views.map(|((&frame, view), (inverse, seeds))| {
            let is_confident = seeds.iter().map(Seed::is_confident).collect();
            StereoDepth::new(frame, view, inverse, is_confident)
        });
        Ok(depth.collect())
    }

    /// What views are sure of: each of its own depth, and of that of others that show the same place.
    fn seeds(&self, setup: &Setup, matched: &[Vec<f32>]) -> Vec<Vec<Seed>> {
        let is_valid = |view: usize, index: usize| self.views[view].is_valid(index);
        let sure = self.checked(setup, matched, MATCHED_TOLERANCE, is_valid, |_, verdict| {
            let is_sure = verdict.is_sure(AGREE);
            Seed {
                weight: f32::from(is_sure),
                inverse: verdict.mean,
            }
        });
        let of_view = |number: usize| {
            let borrowed = self.borrowed(setup, &sure, number);
            let own = sure[number].iter().zip(borrowed);
            own.map(|(&own, borrowed)| if own.weight > 0.0 { own } else { borrowed })
                .collect()
        };
        (0..self.views.len()).into_par_iter().map(of_view).collect()
    }

    /// What the other views are sure of where a view's pixels are: the nearest of several.
    fn borrowed(&self, setup: &Setup, sure: &[Vec<Seed>], number: usize) -> Vec<Seed> {
        let view = &self.views[number];
        // The nearest, and the sum and the number of those beside it.
        let mut found = vec![(0.0_f32, 0.0_f32, 0_u32); view.camera.pixels()];
        for &other in &setup.neighbours[number] {
            let from = &self.views[other];
            let warp = Warp::new(from, view);
            for (index, seed) in sure[other]
                .iter()
                .enumerate()
                .filter(|(_, seed)| seed.weight > 0.0)
            {
                let place = from.camera.center_of(index);
                let Some((at, inverse)) = warp.pixel(place, seed.inverse, &view.camera) else {
                    continue;
                };
                let (nearest, sum, count) = &mut found[at];
                if inverse > *nearest * (1.0 + FILLED_TOLERANCE.depth) {
                    (*nearest, *sum, *count) = (inverse, inverse, 1);
                } else if inverse > *nearest * (1.0 - FILLED_TOLERANCE.depth) {
                    *sum += inverse;
                    *count += 1;
                }
            }
        }
        let seed = |(_, sum, count)| match count {
            0 => Seed::default(),
            count => Seed {
                weight: if count == 1 { BORROWED } else { BORROWED_OFTEN },
                inverse: sum / count as f32,
            },
        };
        found.into_iter().map(seed).collect()
    }

    /// Fills what views are not sure of, and again with what they agree on then.
    ///
    /// # Errors
    /// The caller wants no more.
    fn completed(
        &self,
        setup: &Setup,
        seeds: &mut [Vec<Seed>],
        parts: usize,
        work: &Work,
    ) -> Result<Vec<Vec<f32>>, StereoError> {
        let filled = self.filled(setup, seeds, parts, work)?;
        let is_filled = |view: usize, index: usize| !seeds[view][index].is_confident();
        let votes = self.checked(setup, &filled, FILLED_TOLERANCE, is_filled, |_, verdict| {
            let is_voted = verdict.agree >= AGREE_FILLED && verdict.agree >= 2 * verdict.violate;
            Seed {
                weight: if is_voted { VOTED } else { 0.0 },
                inverse: verdict.mean,
            }
        });
        drop(filled);
        for (seed, vote) in seeds.iter_mut().flatten().zip(votes.into_iter().flatten()) {
            if vote.weight > seed.weight {
                *seed = vote;
            }
        }
        self.filled(setup, seeds, parts, work)
    }

    /// Inverse depth everywhere: that of the seeds where they were matched, and planes between them.
    fn filled(
        &self,
        setup: &Setup,
        seeds: &[Vec<Seed>],
        parts: usize,
        work: &Work,
    ) -> Result<Vec<Vec<f32>>, StereoError> {
        let farthest = 1.0 / (FARTHEST * setup.nearest);
        let one = |workspace: &mut filling::Workspace, number: usize| {
            let mut filled = fill(&self.views[number], &seeds[number], farthest, workspace);
            for (filled, seed) in filled.iter_mut().zip(&seeds[number]) {
                if seed.is_confident() {
                    *filled = seed.inverse;
                }
            }
            work.advance(parts)?;
            Ok(filled)
        };
        let views = (0..self.views.len()).into_par_iter().with_min_len(AT_A_TIME);
        views.map_init(filling::Workspace::default, one).collect()
    }
}

/// So many hypotheses that neighbours are about [`LABEL_STEP`] apart; a multiple of 32.
fn label_count(view: &View, sources: &[&View], nearest: f32) -> usize {
    let (x, y) = (0.5 * view.camera.width as f32, 0.5 * view.camera.height as f32);
    let shift = |source: &&View| {
        let warp = Warp::new(view, source);
        let place = |inverse: f32| warp.apply((x, y), inverse);
        // Twice as near, the middle of a view is often out of sight.
        let (far, near) = (place(0.0)?, place(0.5 / nearest)?);
        Some(2.0 * (far.0 - near.0).hypot(far.1 - near.1))
    };
    let mut shifts: Vec<f32> = sources.iter().filter_map(shift).collect();
    shifts.sort_by(f32::total_cmp);
    let shift = shifts.get(shifts.len() / 2).copied().unwrap_or(0.0);
    let labels = (shift / LABEL_STEP) as usize;
    labels.clamp(*LABELS.start(), *LABELS.end()).next_multiple_of(32)
}
