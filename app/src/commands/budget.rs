//! What a budget of wall time is spent on: opening the scene, training, and writing the files.

use inplace_core::scene::Scene;

/// Seconds that writing takes in any case, and for each million pixels as long as nothing is known of this scene.
const WRITE_SECONDS: f64 = 0.5;
const WRITE_SECONDS_PER_MEGAPIXEL: f64 = 0.12;
/// How much longer writing may take than a sample of the frames says: frames differ, and disks are not rehearsed.
const MARGIN: f64 = 1.15;
/// How much longer the last look at the surface may take than the one before.
const LOOK_MARGIN: f64 = 1.3;
/// Least frames of a sample, and frames of it for each thread that writes.
const SAMPLE: usize = 8;
const SAMPLE_PER_THREAD: usize = 4;

/// Wall time from the start to the last file, and what of it is kept for later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Budget {
    /// All of it, in seconds.
    seconds: f64,
    /// What follows training takes so much of it, in seconds.
    last_look: f64,
    /// What writing takes, as far as it is known, in seconds.
    writing: f64,
}

/// Frames that cost about the same to write, and how long it took to make the files of some of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rehearsed {
    /// Number of the frames.
    pub(super) frames: usize,
    /// How many of them were tried.
    pub(super) tried: usize,
    /// Seconds that those took.
    pub(super) seconds: f64,
}

impl Rehearsed {
    /// Of batches of so many frames, by the median of the seconds that they took: what else the machine did meanwhile, and
    /// what only the first costs, does not count.
    pub(super) fn of_batches(frames: usize, batch: usize, mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let median = seconds.get(seconds.len() / 2);
        Self {
            frames,
            tried: median.map_or(0, |_| batch),
            seconds: median.copied().unwrap_or(0.0),
        }
    }
}

impl Budget {
    /// Of so many seconds for this scene, a share of which is kept for what follows training.
    pub(super) fn new(seconds: f64, last_look: f64, scene: &Scene) -> Self {
        let pixels: usize = scene.frames.iter().map(|frame| frame.camera.pixels()).sum();
        Self::of_pixels(seconds, last_look, pixels)
    }

    fn of_pixels(seconds: f64, last_look: f64, pixels: usize) -> Self {
        Self {
            seconds,
            last_look: last_look * seconds,
            writing: WRITE_SECONDS + WRITE_SECONDS_PER_MEGAPIXEL * pixels as f64 / 1e6,
        }
    }

    /// Takes what a look at the surface took before, in seconds, where that is more than is kept for the last one.
    pub(super) fn looked(&mut self, seconds: f64) {
        self.last_look = self.last_look.max(LOOK_MARGIN * seconds);
    }

    /// Takes what writing costs from frames of each kind whose files were made already.
    pub(super) fn rehearsed(&mut self, kinds: &[Rehearsed]) {
        let tried = kinds.iter().filter(|kind| kind.tried > 0);
        let seconds = tried.map(|kind| kind.seconds * kind.frames as f64 / kind.tried as f64);
        self.writing = WRITE_SECONDS + MARGIN * seconds.sum::<f64>();
    }

    /// When to write whatever there is, in seconds since the start.
    pub(super) fn write_at(&self) -> f64 {
        (self.seconds - self.writing).max(0.0)
    }

    /// When to train no more, in seconds since the start.
    pub(super) fn settle_at(&self) -> f64 {
        (self.write_at() - self.last_look).max(0.0)
    }

    /// Why it will hardly be kept, a sentence, where opening the scene, which took so many seconds, finding its surface, until the
    /// first maps were there so many seconds after the start, and writing these frames alone take longer.
    pub(super) fn problem(&self, opening: f64, first_maps: f64, frames: usize) -> Option<String> {
        (first_maps + self.writing > self.seconds).then(|| {
            format!(
                "the budget of {} s will hardly be kept: opening the scene took {opening:.1} s and finding its surface {:.1} s, and \
                 writing its {frames} frames takes about {:.1} s",
                self.seconds,
                first_maps - opening,
                self.writing
            )
        })
    }

    /// Why it was exceeded, a sentence, where all took longer.
    pub(super) fn exceeded(&self, total: f64, opening: f64, writing: f64) -> Option<String> {
        (total > self.seconds).then(|| {
            format!(
                "the budget of {} s was exceeded: of {total:.1} s, opening the scene took {opening:.1} s, training and making \
                 the maps {:.1} s and writing the files {writing:.1} s",
                self.seconds,
                (total - opening - writing).max(0.0)
            )
        })
    }
}

/// Some of these frames, evenly spread, whose files are made to learn how long `threads` threads take for all.
pub(super) fn sample(frames: &[usize], threads: usize) -> Vec<usize> {
    let count = frames.len().min(SAMPLE.max(SAMPLE_PER_THREAD * threads));
    (0..count).map(|at| frames[at * frames.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rehearsed(frames: usize, tried: usize, seconds: f64) -> Rehearsed {
        Rehearsed {
            frames,
            tried,
            seconds,
        }
    }

    #[test]
    fn training_ends_early_enough_for_the_last_look_and_the_files() {
        let budget = Budget::of_pixels(60.0, 0.125, 100_000_000);
        assert!((budget.write_at() - (60.0 - 12.5)).abs() < 1e-9);
        assert!((budget.settle_at() - (60.0 - 12.5 - 7.5)).abs() < 1e-9);
        assert_eq!(budget.problem(30.0, 47.0, 300), None);
        // With no time left both are now, and nothing is negative.
        let short = Budget::of_pixels(2.0, 0.125, 100_000_000);
        assert_eq!((short.write_at(), short.settle_at()), (0.0, 0.0));
    }

    #[test]
    fn a_look_that_took_long_begins_early() {
        let mut budget = Budget::of_pixels(60.0, 0.1, 0);
        let before = budget.settle_at();
        budget.looked(4.0);
        assert_eq!(budget.settle_at(), before);
        budget.looked(20.0);
        assert!((budget.settle_at() - (budget.write_at() - 26.0)).abs() < 1e-9);
    }

    #[test]
    fn a_rehearsal_counts_for_all_frames_of_its_kind_in_place_of_the_estimate() {
        let mut budget = Budget::of_pixels(150.0, 0.1, 1_000_000_000);
        let kinds = [
            rehearsed(1000, 8, 0.16),
            rehearsed(3000, 10, 0.3),
            rehearsed(0, 0, 0.0),
        ];
        budget.rehearsed(&kinds);
        // 20 s for the first kind, 90 s for the second.
        let writing = 0.5 + 1.15 * 110.0;
        assert!((budget.write_at() - (150.0 - writing)).abs() < 1e-9);
        assert!((budget.settle_at() - (150.0 - writing - 15.0)).abs() < 1e-9);
        assert_eq!(budget.problem(15.0, 20.0, 4000), None);
        let sentence = budget.problem(10.0, 40.0, 4000).unwrap();
        for part in [
            "150 s will hardly be kept",
            "took 10.0 s",
            "surface 30.0 s",
            "4000 frames",
            "127.0 s",
        ] {
            assert!(sentence.contains(part), "{part} is not in: {sentence}");
        }
    }

    #[test]
    fn a_disturbed_batch_of_a_rehearsal_does_not_count() {
        assert_eq!(
            Rehearsed::of_batches(90, 2, vec![7.0, 0.25, 0.5, 0.3]),
            rehearsed(90, 2, 0.5)
        );
        assert_eq!(Rehearsed::of_batches(0, 1, Vec::new()), rehearsed(0, 0, 0.0));
    }

    #[test]
    fn what_took_longer_is_told_by_its_parts_and_nothing_else_is() {
        let budget = Budget::of_pixels(10.0, 0.1, 0);
        assert_eq!(budget.exceeded(10.0, 6.0, 3.0), None);
        let sentence = budget.exceeded(14.0, 6.0, 7.0).unwrap();
        for part in [
            "10 s was exceeded",
            "14.0 s",
            "took 6.0 s",
            "maps 1.0 s",
            "files 7.0 s",
        ] {
            assert!(sentence.contains(part), "{part} is not in: {sentence}");
        }
    }

    #[test]
    fn a_sample_is_spread_over_all_frames_and_no_larger() {
        let frames: Vec<usize> = (100..1100).collect();
        assert_eq!(sample(&frames, 2), [100, 225, 350, 475, 600, 725, 850, 975]);
        assert_eq!(sample(&frames, 16).len(), 64);
        assert_eq!(sample(&[3, 5, 9], 2), [3, 5, 9]);
        assert!(sample(&[], 2).is_empty());
    }
}
