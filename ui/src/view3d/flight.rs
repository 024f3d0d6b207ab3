//! A smooth movement of the camera to another place.

use inplace_model::space::OrbitCamera;

use super::overlay::Mark;

/// Seconds that it takes.
const SECONDS: f64 = 0.6;

/// A flight under way.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Where it begins.
    pub from: OrbitCamera,
    /// Where it ends.
    pub to: OrbitCamera,
    /// When it begins, in seconds.
    pub start: f64,
    /// Where to go at its end.
    pub then: Option<Mark>,
}

impl Flight {
    /// Where the camera is at a time.
    pub fn camera(&self, now: f64) -> OrbitCamera {
        let share = ((now - self.start) / SECONDS).clamp(0.0, 1.0) as f32;
        // Gently off and on.
        let eased = share * share * (3.0 - 2.0 * share);
        if share >= 1.0 {
            self.to
        } else {
            self.from.towards(&self.to, eased)
        }
    }

    /// Whether it is over.
    pub fn has_ended(&self, now: f64) -> bool {
        now - self.start >= SECONDS
    }
}
