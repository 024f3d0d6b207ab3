//! How long a field trains until it is good enough.

use serde::Serialize;

use inplace_core::field::HeldOut;

/// What a target is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Median error of the ray length on held-out frames, in metres.
    DepthErrorM,
    /// The same as a share of the ray length.
    DepthErrorRel,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    PsnrDb,
}

/// The targets, from easy to hard for each quantity.
pub const TARGETS: [(Quantity, f32); 11] = [
    (Quantity::DepthErrorM, 0.10),
    (Quantity::DepthErrorM, 0.05),
    (Quantity::DepthErrorM, 0.02),
    (Quantity::DepthErrorM, 0.01),
    (Quantity::DepthErrorRel, 0.05),
    (Quantity::DepthErrorRel, 0.025),
    (Quantity::DepthErrorRel, 0.015),
    (Quantity::PsnrDb, 25.0),
    (Quantity::PsnrDb, 27.0),
    (Quantity::PsnrDb, 29.0),
    (Quantity::PsnrDb, 30.0),
];

/// When a run first reached a target.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reached {
    /// The scene.
    pub scene: String,
    /// Name of what was trained.
    pub preset: String,
    /// Whether the field was given measured depth.
    pub depth: bool,
    /// Seed of the run.
    pub seed: u64,
    /// What was to be reached.
    pub quantity: Quantity,
    /// The target: at most this error, at least this PSNR.
    pub target: f32,
    /// Seconds of training until the first look that met it; `None` when none did.
    pub seconds: Option<f64>,
}

/// Looks at a field as it trains.
#[derive(Debug, Default)]
pub(super) struct Progress {
    last_look: f64,
    seconds: [Option<f64>; TARGETS.len()],
}

impl Progress {
    /// Whether it is time to look again: every half second at first, then ever less often.
    pub(super) fn is_due(&self, seconds: f64) -> bool {
        seconds >= (self.last_look + 0.5).max(1.1 * self.last_look)
    }

    /// Notes what a look found after so many seconds of training.
    pub(super) fn note(&mut self, seconds: f64, held_out: &HeldOut) {
        self.last_look = seconds;
        for (first, (quantity, target)) in self.seconds.iter_mut().zip(TARGETS) {
            let met = match quantity {
                Quantity::DepthErrorM => held_out.depth_error.is_some_and(|error| error <= target),
                Quantity::DepthErrorRel => held_out.relative_depth_error.is_some_and(|error| error <= target),
                Quantity::PsnrDb => held_out.psnr >= target,
            };
            if met && first.is_none() {
                *first = Some(seconds);
            }
        }
    }

    pub(super) fn finish(self, scene: &str, preset: &str, depth: bool, seed: u64) -> Vec<Reached> {
        let targets = TARGETS.into_iter().zip(self.seconds);
        targets
            .map(|((quantity, target), seconds)| Reached {
                scene: scene.to_owned(),
                preset: preset.to_owned(),
                depth,
                seed,
                quantity,
                target,
                seconds,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_reached_once_and_easy_ones_first() {
        let mut progress = Progress::default();
        assert!(!progress.is_due(0.4) && progress.is_due(0.5));
        let look = |psnr, depth_error| HeldOut {
            psnr,
            depth_error: Some(depth_error),
            relative_depth_error: None,
            within_tenth: None,
        };
        progress.note(1.0, &look(26.0, 0.04));
        progress.note(2.0, &look(24.0, 0.02));
        assert!(!progress.is_due(2.4) && progress.is_due(2.5));
        progress.note(20.0, &look(30.0, 0.06));
        assert!(!progress.is_due(21.9) && progress.is_due(22.1));
        let reached = progress.finish("demo", "auto", true, 3);
        let expected = [
            (Quantity::DepthErrorM, vec![Some(1.0), Some(1.0), Some(2.0), None]),
            (Quantity::DepthErrorRel, vec![None; 3]),
            (
                Quantity::PsnrDb,
                vec![Some(1.0), Some(20.0), Some(20.0), Some(20.0)],
            ),
        ];
        for (quantity, seconds) in expected {
            let own = reached.iter().filter(|one| one.quantity == quantity);
            assert_eq!(
                own.map(|one| one.seconds).collect::<Vec<_>>(),
                seconds,
                "{quantity:?}"
            );
        }
    }
}
