//! A sampled audit: how right the maps are, from places that a person judges.

use std::cmp::Reverse;
use std::sync::Arc;

use rand::rngs::SmallRng;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::labels::{ClassId, Pixel, VOID};
use crate::scene::Scene;
use crate::semantics::FrameMap;

/// Places in each frame. With so many in 5% of its frames, an audit of a capture of 180 frames is within 3 points of the
/// truth in 95 of 100 cases (`inplace-lab bench audit`).
const PLACES: usize = 60;
/// Places of one frame that are asked for in a row. Every round goes through all frames, so that an audit which ends
/// early is one of all of them.
const IN_A_ROW: usize = 10;
/// Fewer frames are never drawn from, where there are so many.
const LEAST_FRAMES: usize = 6;
/// Judged frames without which nothing is concluded: two degrees of freedom go into the regression.
const LEAST_JUDGED: usize = 4;
/// The quantile of the normal distribution that leaves 2.5% above.
const Z: f64 = 1.959_964;

/// What a person says of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The map's class is right.
    Right,
    /// The map's class is wrong.
    Wrong,
    /// It cannot be told, and does not count.
    Skipped,
}

/// A place to judge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuditPlace {
    /// Its frame, an index of [`Audit::frames`].
    pub frame: usize,
    /// The pixel of that frame.
    pub pixel: Pixel,
    /// The class that the map gave it when it was drawn; never void.
    pub class: ClassId,
    /// What the person said, if anything yet.
    pub verdict: Option<Verdict>,
}

/// A frame that places were drawn from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AuditedFrame {
    /// Its name, by which it is found again.
    pub stem: String,
    /// Pixels that had a class.
    pub labelled: u64,
    /// Mean entropy of its map, in nats.
    pub entropy: f64,
}

/// Places drawn from the maps as they were once, with what a person said of them.
///
/// Every k-th frame is drawn, from a random one on: neighbours show nearly the same. In each frame every labelled pixel is
/// equally likely to be drawn: the pixels are sorted by entropy and cut into as many parts as there are places, and one
/// is drawn from each part, so that the sure and the unsure ones have their shares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audit {
    /// The frames drawn, in the order of the capture.
    pub frames: Vec<AuditedFrame>,
    /// Mean entropy of all frames' maps, in nats, weighted by their labelled pixels.
    pub entropy: f64,
    /// The places, in the order in which they are asked for.
    pub places: Vec<AuditPlace>,
    /// [Edits of the maps](crate::labels::History::map_edits) when they were drawn.
    pub edits: usize,
    /// The seed that they were drawn with.
    pub seed: u64,
}

/// How right the maps are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Accuracy {
    /// Share of the labelled pixels whose class is right, 0..=1.
    pub share: f64,
    /// Lower end of its 95% confidence interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Number of places that it follows from.
    pub judged: usize,
}

impl Audit {
    /// Draws places from this share (0..=1) of the frames that have a map; `None` where there is nothing labelled. `edits`
    /// is kept with them, and so is `seed`, on which they depend. It looks maps up, which takes milliseconds a frame drawn.
    pub fn draw(
        scene: &Scene,
        map: &dyn Fn(usize) -> Option<Arc<FrameMap>>,
        (share, seed): (f64, u64),
        edits: usize,
    ) -> Option<Self> {
        let mut rng = SmallRng::seed_from_u64(seed);
        let summed = (0..scene.frames.len()).filter_map(|frame| {
            let map = map(frame)?;
            let summary = map.summary(None)?;
            let labelled = f64::from(summary.coverage) * (f64::from(map.width) * f64::from(map.height));
            (labelled > 0.0).then_some((frame, map, labelled, f64::from(summary.mean_entropy)))
        });
        let summed: Vec<_> = summed.collect();
        let labelled: f64 = summed.iter().map(|(_, _, labelled, _)| labelled).sum();
        let unsure: f64 = summed
            .iter()
            .map(|(_, _, labelled, entropy)| labelled * entropy)
            .sum();
        let count = (share * summed.len() as f64).ceil() as usize;
        let count = count.max(LEAST_FRAMES).min(summed.len());
        let start: f64 = rng.random();
        let (mut frames, mut rounds) = (Vec::new(), Vec::new());
        for number in 0..count {
            let step = summed.len() as f64 / count as f64;
            let at = ((start + number as f64) * step) as usize;
            let (frame, map, _, entropy) = &summed[at.min(summed.len() - 1)];
            let (drawn, labelled) = places(map, frames.len(), &mut rng);
            let in_rows = drawn.chunks(IN_A_ROW).enumerate();
            rounds.extend(in_rows.map(|(round, places)| (round, places.to_vec())));
            frames.push(AuditedFrame {
                stem: scene.frames[*frame].stem.clone(),
                labelled,
                entropy: *entropy,
            });
        }
        rounds.sort_by_key(|(round, _)| *round);
        let places: Vec<AuditPlace> = rounds.into_iter().flat_map(|(_, places)| places).collect();
        (!places.is_empty()).then_some(Self {
            frames,
            entropy: unsure / labelled,
            places,
            edits,
            seed,
        })
    }

    /// How right the maps are, with a confidence interval; `None` before places of four frames were judged.
    ///
    /// Places of one frame are alike, so a frame counts as one observation: the share of its places that are right,
    /// weighted by its labelled pixels. Frames differ most by how unsure they are, which is known of all of them: the
    /// share is that of the linear regression on the mean entropy, at the mean of all frames (regression estimator,
    /// Cochran, Sampling Techniques, 1977, chapter 7), and its variance that of the residuals between frames. The interval
    /// is Wilson's for the number of independent places that would have this variance (Korn and Graubard 1998), by
    /// Student's distribution, as there are few frames.
    pub fn accuracy(&self) -> Option<Accuracy> {
        let mut counts = vec![(0.0, 0.0); self.frames.len()];
        for place in &self.places {
            let (right, judged) = counts.get_mut(place.frame)?;
            match place.verdict {
                Some(Verdict::Right) => (*right, *judged) = (*right + 1.0, *judged + 1.0),
                Some(Verdict::Wrong) => *judged += 1.0,
                Some(Verdict::Skipped) | None => {}
            }
        }
        let judged: f64 = counts.iter().map(|(_, judged)| judged).sum();
        // Of each judged frame: its weight, share and entropy.
        let observed = self
            .frames
            .iter()
            .zip(&counts)
            .filter(|(_, (_, judged))| *judged > 0.0);
        let observed =
            observed.map(|(frame, (right, judged))| (frame.labelled as f64, right / judged, frame.entropy));
        let observed: Vec<(f64, f64, f64)> = observed.collect();
        if observed.len() < LEAST_JUDGED {
            return None;
        }
        let all: f64 = observed.iter().map(|(weight, ..)| weight).sum();
        let mean = |value: &dyn Fn(&(f64, f64, f64)) -> f64| -> f64 {
            observed.iter().map(|frame| frame.0 * value(frame)).sum::<f64>() / all
        };
        let (share, entropy) = (mean(&|frame| frame.1), mean(&|frame| frame.2));
        let spread = mean(&|frame| (frame.2 - entropy).powi(2));
        // What is less sure is not more often right.
        let slope = match spread > 0.0 {
            true => (mean(&|frame| (frame.2 - entropy) * (frame.1 - share)) / spread).min(0.0),
            false => 0.0,
        };
        let freedom = observed.len() as f64 - 2.0;
        let residuals = observed.iter().map(|(weight, own, unsure)| {
            let residual = own - share - slope * (unsure - entropy);
            (weight / all * residual).powi(2)
        });
        let variance = residuals.sum::<f64>() * observed.len() as f64 / freedom;
        let least = 0.5 / judged;
        let share = (share + slope * (self.entropy - entropy)).clamp(0.0, 1.0);
        let of_one = share.clamp(least, 1.0 - least);
        let independent = (of_one * (1.0 - of_one) / variance).min(judged) * (Z / student(freedom)).powi(2);
        let [low, high] = wilson(share, independent);
        Some(Accuracy {
            share,
            low,
            high,
            judged: judged as usize,
        })
    }
}

/// Places of a map in a random order, and the number of its labelled pixels.
fn places(map: &FrameMap, frame: usize, rng: &mut SmallRng) -> (Vec<AuditPlace>, u64) {
    let map = map.looked_up();
    let (labels, entropy) = (map.labels(), map.entropy());
    let mut pixels: Vec<usize> = (0..labels.len()).filter(|&pixel| labels[pixel] != VOID).collect();
    pixels.sort_by_key(|&pixel| Reverse(entropy[pixel]));
    let count = PLACES.min(pixels.len());
    let part = pixels.len() as f64 / count.max(1) as f64;
    let place = |number: usize| {
        let at = ((number as f64 + rng.random::<f64>()) * part) as usize;
        let pixel = pixels[at.min(pixels.len() - 1)];
        let width = map.width as usize;
        AuditPlace {
            frame,
            pixel: [pixel % width, pixel / width].map(|at| at as u32),
            class: labels[pixel],
            verdict: None,
        }
    };
    let mut places: Vec<AuditPlace> = (0..count).map(place).collect();
    places.shuffle(rng);
    (places, pixels.len() as u64)
}

/// The quantile of Student's distribution that leaves 2.5% above (Abramowitz and Stegun, 26.7.5); with two degrees of
/// freedom it is 3% too small, and closer with more.
fn student(freedom: f64) -> f64 {
    let z = Z;
    z + (z.powi(3) + z) / (4.0 * freedom)
        + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * freedom.powi(2))
        + (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / (384.0 * freedom.powi(3))
}

/// The 95% confidence interval of a share of so many independent observations (Wilson 1927).
fn wilson(share: f64, count: f64) -> [f64; 2] {
    let z2 = Z * Z / count;
    let middle = share + z2 / 2.0;
    let half = (share * (1.0 - share) * z2 + z2 * z2 / 4.0).sqrt();
    [middle - half, middle + half].map(|end| (end / (1.0 + z2)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::{stems, wall};

    const SIZE: [u32; 2] = [40, 30];

    /// Maps of frames whose left part is sure and right part unsure, wider from frame to frame; the top row is void.
    fn map(frame: usize) -> Option<Arc<FrameMap>> {
        let [width, height] = SIZE;
        let pixels = || (0..width * height).map(|pixel| [pixel % width, pixel / width]);
        let labels = pixels().map(|[_, y]| ClassId::from(y > 0)).collect();
        let entropy = pixels().map(|[x, _]| u16::from(x < frame as u32) * 6000);
        FrameMap::new(frame, 0, SIZE, labels, entropy.collect()).map(Arc::new)
    }

    #[test]
    fn every_kth_frame_has_its_places_on_labelled_pixels_sure_and_unsure_ones_by_their_shares() {
        let scene = wall(40, SIZE[0], SIZE[1]);
        let draw = |seed| Audit::draw(&scene, &map, (0.25, seed), 3).unwrap();
        let audit = draw(5);
        assert_eq!(audit, draw(5));
        assert_ne!(audit.places, draw(6).places);
        assert_eq!((audit.frames.len(), audit.places.len()), (10, 600));
        let stems = stems(&scene);
        let number = |frame: &AuditedFrame| stems.iter().position(|stem| *stem == frame.stem).unwrap();
        let numbers: Vec<usize> = audit.frames.iter().map(number).collect();
        assert!(
            numbers.windows(2).all(|pair| pair[1] - pair[0] == 4),
            "{numbers:?}"
        );
        for (index, &number) in numbers.iter().enumerate() {
            let own = audit.places.iter().filter(|place| place.frame == index);
            let (unsure, sure): (Vec<&AuditPlace>, Vec<&AuditPlace>) =
                own.partition(|place| (place.pixel[0] as usize) < number);
            let share = unsure.len() as f64 / (unsure.len() + sure.len()) as f64;
            assert!((share - number as f64 / 40.0).abs() < 0.02, "{number}: {share}");
        }
        assert!(
            audit
                .places
                .iter()
                .all(|place| place.pixel[1] > 0 && place.class == 1)
        );
        // The first round is of every frame.
        let first: Vec<usize> = audit.places[..100].iter().map(|place| place.frame).collect();
        assert!((0..10).all(|frame| first.contains(&frame)));
        assert!(Audit::draw(&scene, &|_| None, (0.25, 0), 0).is_none());
    }

    /// An audit whose frames have these shares of right places and entropies, 20 places each.
    fn judged(frames: &[(f64, f64)], entropy: f64) -> Audit {
        let frame = |&(_, entropy): &(f64, f64)| AuditedFrame {
            stem: String::new(),
            labelled: 1000,
            entropy,
        };
        let of_frame = |(frame, &(share, _)): (usize, &(f64, f64))| {
            (0..20).map(move |place| AuditPlace {
                frame,
                pixel: [0, 0],
                class: 1,
                verdict: Some(if f64::from(place) < share * 20.0 {
                    Verdict::Right
                } else {
                    Verdict::Wrong
                }),
            })
        };
        Audit {
            places: frames.iter().enumerate().flat_map(of_frame).collect(),
            frames: frames.iter().map(frame).collect(),
            entropy,
            edits: 0,
            seed: 0,
        }
    }

    #[test]
    fn the_interval_is_wilsons_for_as_many_places_as_the_differences_between_frames_leave() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} is not {b}");
        // Newcombe 1998: 81 of 263 has 0.2553 to 0.3662.
        let [low, high] = wilson(81.0 / 263.0, 263.0);
        close(low, 0.2553);
        close(high, 0.3662);
        close(student(8.0), 2.306);
        let all_right = judged(&[(1.0, 0.5); 6], 0.5).accuracy().unwrap();
        close(all_right.share, 1.0);
        assert_eq!(all_right.judged, 120);
        assert!((0.92..0.97).contains(&all_right.low) && all_right.high > 0.999);
        let alike = judged(&[(0.9, 0.5), (0.8, 0.5), (0.9, 0.5), (0.8, 0.5)], 0.5);
        let apart = judged(&[(1.0, 0.5), (0.7, 0.5), (1.0, 0.5), (0.7, 0.5)], 0.5);
        let [alike, apart] = [alike, apart].map(|audit| audit.accuracy().unwrap());
        close(alike.share, apart.share);
        assert!(apart.low < alike.low - 0.1, "{apart:?}, {alike:?}");
        assert!(judged(&[(1.0, 0.5); 3], 0.5).accuracy().is_none());
    }

    #[test]
    fn frames_that_are_surer_than_all_predict_a_lower_share() {
        let frames = [(1.0, 0.1), (0.9, 0.2), (0.8, 0.3), (0.7, 0.4)];
        let share = |entropy| judged(&frames, entropy).accuracy().unwrap().share;
        assert!((share(0.25) - 0.85).abs() < 1e-9 && (share(0.35) - 0.75).abs() < 1e-9);
        // Surer and less often right: by chance.
        let share = judged(&frames.map(|(share, entropy)| (share, 1.0 - entropy)), 0.9).accuracy();
        assert!((share.unwrap().share - 0.85).abs() < 1e-9);
    }
}
