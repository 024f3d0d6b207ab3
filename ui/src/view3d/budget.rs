//! How many splats are drawn in one frame of the window, so that it keeps its pace on any renderer.

/// Splats that are always drawn, and those begun with.
const FEWEST: usize = 30_000;
const FIRST: usize = 60_000;
/// Seconds of a frame above which fewer splats are drawn, and below which more.
const SLOW: f32 = 0.030;
const QUICK: f32 = 0.020;
/// Frames farther apart than this did not follow each other.
const PAUSE: f32 = 2.0;

/// Learns from the time between frames how many splats fit into one.
#[derive(Clone, Copy, Debug)]
pub struct SplatBudget {
    budget: usize,
    /// Whether splats were drawn in the frame before the last one.
    was_drawing: bool,
}

impl Default for SplatBudget {
    fn default() -> Self {
        Self {
            budget: FIRST,
            was_drawing: false,
        }
    }
}

impl SplatBudget {
    /// Splats to draw in this frame; `drawn` in the last one, which began `seconds` ago. Only frames that follow each
    /// other say something: the first after a rest has waited for a reason to be drawn.
    pub fn next(&mut self, drawn: usize, seconds: f32) -> usize {
        let drawing = drawn > 0;
        if drawing && self.was_drawing && seconds < PAUSE {
            // Only a full frame says that more would fit.
            if seconds > SLOW {
                let fitting = drawn as f32 * (SLOW / seconds).max(0.5);
                self.budget = (fitting as usize).max(FEWEST);
            } else if seconds < QUICK && drawn >= self.budget {
                self.budget += self.budget / 4;
            }
        }
        self.was_drawing = drawing;
        self.budget
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The budget after many frames on a renderer that draws so many splats a second.
    fn settled(splats_a_second: f32) -> usize {
        let mut learnt = SplatBudget::default();
        let mut budget = learnt.next(0, 0.0);
        for _ in 0..60 {
            budget = learnt.next(budget, 0.008 + budget as f32 / splats_a_second);
        }
        budget
    }

    #[test]
    fn a_fast_renderer_draws_everything_and_a_slow_one_keeps_its_pace() {
        assert!(settled(1e9) > 1_000_000);
        let slow = settled(2e6);
        assert!((0.015..0.035).contains(&(0.008 + slow as f32 / 2e6)), "{slow}");
        assert_eq!(settled(1e5), FEWEST);
    }

    #[test]
    fn a_rest_between_frames_says_nothing() {
        let mut budget = SplatBudget::default();
        for _ in 0..10 {
            assert_eq!(budget.next(FIRST, 5.0), FIRST);
            assert_eq!(budget.next(0, 0.5), FIRST);
        }
    }
}
