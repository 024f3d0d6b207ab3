//! What a budget of wall time is spent on: opening the scene, training, and writing the files.

use inplace_core::scene::Scene;

/// What writing takes: seconds in any case, for each frame, whose files have to reach the disk, and for each million
/// pixels. Two cores with other work need about half as much.
const WRITE_SECONDS: f64 = 0.5;
const WRITE_SECONDS_PER_FRAME: f64 = 0.01;
const WRITE_SECONDS_PER_MEGAPIXEL: f64 = 0.1;
/// Share of the budget kept for the last look at the surface.
const LAST_LOOK: f64 = 0.12;
/// How much longer the last look at the surface may take than the one before.
const LOOK_MARGIN: f64 = 1.3;

/// Wall time from the start to the last file, and what of it is kept for later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Budget {
    /// All of it, in seconds.
    seconds: f64,
    /// What follows training takes so much of it, in seconds.
    last_look: f64,
    /// What writing takes, about, in seconds.
    writing: f64,
}

impl Budget {
    /// Of so many seconds for a scene.
    pub(super) fn of(seconds: f64, scene: &Scene) -> Self {
        let pixels = scene.frames.iter().map(|frame| frame.camera.pixels()).sum();
        Self::new(seconds, scene.frames.len(), pixels)
    }

    /// Of so many seconds for this many frames and pixels of all of them.
    fn new(seconds: f64, frames: usize, pixels: usize) -> Self {
        Self {
            seconds,
            last_look: LAST_LOOK * seconds,
            writing: WRITE_SECONDS
                + WRITE_SECONDS_PER_FRAME * frames as f64
                + WRITE_SECONDS_PER_MEGAPIXEL * pixels as f64 / 1e6,
        }
    }

    /// Takes what a look at the surface took before, in seconds, where that is more than is kept for the last one.
    pub(super) fn looked(&mut self, seconds: f64) {
        self.last_look = self.last_look.max(LOOK_MARGIN * seconds);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn training_ends_early_enough_for_the_last_look_and_the_files() {
        let budget = Budget::new(60.0, 100, 50_000_000);
        assert!((budget.write_at() - (60.0 - 6.5)).abs() < 1e-9);
        assert!((budget.settle_at() - (60.0 - 6.5 - 7.2)).abs() < 1e-9);
        assert_eq!(budget.problem(30.0, 47.0, 100), None);
        assert_eq!(
            budget.problem(10.0, 55.0, 100).unwrap(),
            "the budget of 60 s will hardly be kept: opening the scene took 10.0 s and finding its surface 45.0 s, and \
             writing its 100 frames takes about 6.5 s"
        );
        // With no time left both are now, and nothing is negative.
        let short = Budget::new(2.0, 100, 50_000_000);
        assert_eq!((short.write_at(), short.settle_at()), (0.0, 0.0));
    }

    #[test]
    fn a_look_that_took_long_begins_early() {
        let mut budget = Budget::new(60.0, 0, 0);
        let before = budget.settle_at();
        budget.looked(4.0);
        assert_eq!(budget.settle_at(), before);
        budget.looked(20.0);
        assert!((budget.settle_at() - (budget.write_at() - 26.0)).abs() < 1e-9);
    }

    #[test]
    fn what_took_longer_is_told_by_its_parts_and_nothing_else_is() {
        let budget = Budget::new(10.0, 0, 0);
        assert_eq!(budget.exceeded(10.0, 6.0, 3.0), None);
        assert_eq!(
            budget.exceeded(14.0, 6.0, 7.0).unwrap(),
            "the budget of 10 s was exceeded: of 14.0 s, opening the scene took 6.0 s, training and making the maps \
             1.0 s and writing the files 7.0 s"
        );
    }
}
