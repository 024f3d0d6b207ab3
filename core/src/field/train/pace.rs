//! How large the field grows, how long it is taught, and when it has gone wrong: told by the held-out error.

/// Steps between looks at the held-out error.
pub const CHECK_EVERY: u64 = 250;
/// Learning rates fall to this share until the end.
const FINAL_RATE: f32 = 0.1;
/// Steps between doublings of the table, and the rise of the held-out PSNR since the last one, in dB, that
/// the next one asks for.
const GROW_EVERY: u64 = 750;
const GROWTH_GAIN: f32 = 0.25;
/// Steps without a rise of the held-out PSNR by so many dB after which teaching comes to its end.
const PATIENCE: u64 = 2000;
const RISE: f32 = 0.1;
/// Steps in which the learning rates come down then.
const COOL_DOWN: u64 = 500;
/// A held-out PSNR so many dB below the best is a collapse.
const COLLAPSE: f32 = 3.0;

/// What to do after a look at the held-out error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All is well.
    GoOn,
    /// The table should be doubled.
    Grow,
    /// The field has collapsed: back to the last good state.
    Undo,
}

/// Follows the held-out error of one training.
#[derive(Clone, Debug)]
pub struct Pace {
    /// Steps at which it ends at the latest.
    end: u64,
    /// Doublings that are still allowed.
    doublings: u32,
    /// Steps and PSNR at the last doubling, or at the first look.
    grown: Option<(u64, f32)>,
    /// The best PSNR, and the steps at the last rise that counts.
    best: Option<(u64, f32)>,
    /// Steps at which the rates began to come down, and their share then.
    cooling: Option<(u64, f32)>,
}

impl Pace {
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

    /// What the held-out PSNR in dB says after so many steps.
    pub fn judge(&mut self, steps: u64, psnr: f32) -> Verdict {
        let (risen_at, best) = *self.best.get_or_insert((steps, psnr));
        if psnr.is_nan() || psnr < best - COLLAPSE {
            return Verdict::Undo;
        }
        if psnr >= best + RISE {
            self.best = Some((steps, psnr));
        } else if steps >= risen_at + PATIENCE && self.cooling.is_none() {
            self.cooling = Some((steps, self.rate(steps)));
        }
        let (grown_at, before) = *self.grown.get_or_insert((steps, psnr));
        if self.doublings == 0 || steps < grown_at + GROW_EVERY {
            return Verdict::GoOn;
        }
        if psnr < before + GROWTH_GAIN || self.cooling.is_some() {
            self.doublings = 0;
            return Verdict::GoOn;
        }
        self.doublings -= 1;
        self.grown = Some((steps, psnr));
        Verdict::Grow
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

    /// Whether teaching has come to its end.
    pub fn is_over(&self, steps: u64) -> bool {
        steps >= self.end || self.cooling.is_some_and(|(from, _)| steps >= from + COOL_DOWN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Verdicts other than to go on, with their steps, over a course of PSNRs.
    fn course(pace: &mut Pace, psnr: impl Fn(u64) -> f32) -> Vec<(u64, Verdict)> {
        let mut verdicts = Vec::new();
        let mut steps = CHECK_EVERY;
        while !pace.is_over(steps) {
            match pace.judge(steps, psnr(steps)) {
                Verdict::GoOn => {}
                verdict => verdicts.push((steps, verdict)),
            }
            steps += CHECK_EVERY;
        }
        verdicts.push((steps, Verdict::GoOn));
        verdicts
    }

    #[test]
    fn it_grows_while_the_error_falls_and_ends_when_it_no_longer_does() {
        let mut pace = Pace::new(10_000, 5);
        let verdicts = course(&mut pace, |steps| 20.0 + (steps.min(2000) as f32) / 500.0);
        let grown = [1000, 1750, 2500].map(|steps| (steps, Verdict::Grow));
        assert_eq!(verdicts[..3], grown, "{verdicts:?}");
        assert_eq!(verdicts[3..], [(4500, Verdict::GoOn)]);
        assert!((pace.rate(4500) - FINAL_RATE).abs() < 1e-4);
    }

    #[test]
    fn a_steady_rise_is_taught_to_the_end_and_grows_no_more_than_allowed() {
        let mut pace = Pace::new(6000, 2);
        let verdicts = course(&mut pace, |steps| steps as f32 / 1000.0);
        assert_eq!(verdicts.len(), 3);
        assert_eq!(verdicts[2], (6000, Verdict::GoOn));
    }

    #[test]
    fn a_collapse_is_undone_and_noise_is_not() {
        let mut pace = Pace::new(10_000, 0);
        assert_eq!(pace.judge(250, 24.0), Verdict::GoOn);
        assert_eq!(pace.judge(500, 23.0), Verdict::GoOn);
        assert_eq!(pace.judge(750, 17.0), Verdict::Undo);
        assert_eq!(pace.judge(1000, f32::NAN), Verdict::Undo);
        assert_eq!(pace.judge(1250, 25.0), Verdict::GoOn);
    }
}
