//! How large the field grows, how long it trains and when it has collapsed, all by the held-out error.

/// Steps between measurements of the held-out error.
pub const CHECK_EVERY: u64 = 250;
/// Share of the learning rates at the end.
const FINAL_RATE: f32 = 0.1;
/// Fewest steps between doublings of the table, and smallest rise of the held-out PSNR since the last doubling, in dB,
/// for the next one.
const GROW_EVERY: u64 = 750;
const GROWTH_GAIN: f32 = 0.25;
/// Steps without a rise of the held-out PSNR by this many dB after which training comes to its end.
const PATIENCE: u64 = 2000;
const RISE: f32 = 0.1;
/// Steps over which the learning rates come down then.
const COOL_DOWN: u64 = 500;
/// A held-out PSNR this many dB below the best is a collapse.
const COLLAPSE: f32 = 3.0;

/// What to do after a measurement of the held-out error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adjustment {
    /// All is well.
    GoOn,
    /// The table should be doubled.
    Grow,
    /// The field has collapsed: back to the last checkpoint.
    Undo,
}

/// Follows the held-out error of one training.
#[derive(Clone, Debug)]
pub struct Schedule {
    /// Steps at which it ends at the latest.
    end: u64,
    /// Doublings that are still allowed.
    doublings: u32,
    /// Steps and PSNR at the last doubling, or at the first measurement.
    grown: Option<(u64, f32)>,
    /// The best PSNR, and the steps at the last rise that counts.
    best: Option<(u64, f32)>,
    /// Steps at which the rates began to come down, and their share then.
    cooling: Option<(u64, f32)>,
}

impl Schedule {
    /// Ends after `end` steps at the latest; the table may double `doublings` times.
    pub fn new(end: u64, doublings: u32) -> Self {
        Self {
            end,
            doublings,
            grown: None,
            best: None,
            cooling: None,
        }
    }

    /// The adjustment that follows from the held-out PSNR, in dB, after this number of steps.
    pub fn judge(&mut self, steps: u64, psnr: f32) -> Adjustment {
        if psnr.is_nan() || self.best.is_some_and(|(_, best)| psnr < best - COLLAPSE) {
            return Adjustment::Undo;
        }
        let (risen_at, best) = *self.best.get_or_insert((steps, psnr));
        if psnr >= best + RISE {
            self.best = Some((steps, psnr));
        } else if steps >= risen_at + PATIENCE && self.cooling.is_none() {
            self.cooling = Some((steps, self.rate(steps)));
        }
        let (grown_at, before) = *self.grown.get_or_insert((steps, psnr));
        if self.doublings == 0 || steps < grown_at + GROW_EVERY {
            return Adjustment::GoOn;
        }
        if psnr < before + GROWTH_GAIN || self.cooling.is_some() {
            self.doublings = 0;
            return Adjustment::GoOn;
        }
        self.doublings -= 1;
        self.grown = Some((steps, psnr));
        Adjustment::Grow
    }

    /// Share of the full learning rates.
    pub fn rate(&self, steps: u64) -> f32 {
        let share = |from: u64, steps: u64, length: u64| {
            (steps.saturating_sub(from) as f32 / length.max(1) as f32).min(1.0)
        };
        match self.cooling {
            Some((from, rate)) => rate * (FINAL_RATE / rate).powf(share(from, steps, COOL_DOWN)),
            None => FINAL_RATE.powf(share(0, steps, self.end)),
        }
    }

    /// Steps at which the rates began to come down before the end, and their share then, for saving.
    pub fn cooling(&self) -> Option<(u64, f32)> {
        self.cooling
    }

    /// Goes on with rates that came down before; what cannot be is left out.
    pub fn restore(&mut self, (from, rate): (u64, f32)) {
        self.cooling = (rate > 0.0 && rate <= 1.0).then_some((from, rate));
    }

    /// Whether training has ended.
    pub fn is_over(&self, steps: u64) -> bool {
        steps >= self.end
            || self
                .cooling
                .is_some_and(|(from, _)| steps >= from.saturating_add(COOL_DOWN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All adjustments but `GoOn`, with their steps, over a course of PSNRs; at last the steps at the end.
    fn course(schedule: &mut Schedule, psnr: impl Fn(u64) -> f32) -> Vec<(u64, Adjustment)> {
        let mut adjustments = Vec::new();
        let mut steps = CHECK_EVERY;
        while !schedule.is_over(steps) {
            match schedule.judge(steps, psnr(steps)) {
                Adjustment::GoOn => {}
                adjustment => adjustments.push((steps, adjustment)),
            }
            steps += CHECK_EVERY;
        }
        adjustments.push((steps, Adjustment::GoOn));
        adjustments
    }

    #[test]
    fn it_grows_while_the_error_falls_and_ends_when_it_no_longer_does_or_no_longer_may() {
        let mut schedule = Schedule::new(10_000, 5);
        let adjustments = course(&mut schedule, |steps| 20.0 + (steps.min(2000) as f32) / 500.0);
        let grown = [1000, 1750, 2500].map(|steps| (steps, Adjustment::Grow));
        assert_eq!(adjustments, [&grown[..], &[(4500, Adjustment::GoOn)]].concat());
        assert!((schedule.rate(4500) - FINAL_RATE).abs() < 1e-4);
        let steady = course(&mut Schedule::new(6000, 2), |steps| steps as f32 / 1000.0);
        assert_eq!((steady.len(), steady[2]), (3, (6000, Adjustment::GoOn)));
    }

    #[test]
    fn a_collapse_is_undone_and_noise_is_not() {
        let mut schedule = Schedule::new(10_000, 0);
        let psnr = [f32::NAN, 24.0, 23.0, 17.0, f32::NAN, 25.0];
        let adjustments = (1..).zip(psnr);
        let adjustments = adjustments.map(|(check, psnr)| schedule.judge(check * CHECK_EVERY, psnr));
        let (go_on, undo) = (Adjustment::GoOn, Adjustment::Undo);
        assert!(adjustments.eq([undo, go_on, go_on, undo, undo, go_on]));
    }
}
