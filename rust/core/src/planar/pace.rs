//! How long the steps of the adaptive scheme are.

use serde::{Deserialize, Serialize};

/// Length of the next step and what the last one left: all that step control remembers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Length of the next step \[s\].
    step: f64,
    /// Error of the last step over what was allowed.
    last: f64,
}

impl Default for Pace {
    /// That of a robot just placed: its joints meet a reference in motion within a fraction of a millisecond.
    fn default() -> Self {
        Self { step: FIRST_STEP, last: 1.0 }
    }
}

/// Error of a step just tried, over what was allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trial {
    /// A step of second order.
    Smooth(f64),
    /// An Euler step that takes an impact.
    Impact(f64),
}

impl Trial {
    /// Whether the step stands; at the shortest step there is no choice.
    pub fn stands(self, h: f64) -> bool {
        let (Trial::Smooth(error) | Trial::Impact(error)) = self;
        error <= 1.0 || h <= SHORTEST
    }
}

impl Pace {
    /// Length of a step when `left` is left of the interval, which the last step ends exactly: two equal
    /// steps rather than a long and a tiny one.
    pub fn fit(&self, left: f64, longest: f64) -> f64 {
        let step = self.step.min(longest);
        match step / left {
            0.999..=f64::INFINITY => left,
            0.5..0.999 => 0.5 * left,
            _ => step,
        }
    }

    /// Learns from a step of length `h`. The error of a smooth step over what is allowed goes with h^2: a PI
    /// controller. An impact is a jump in velocity somewhere in the step: its error goes with h.
    pub fn learn(&mut self, h: f64, trial: Trial) {
        let (factor, last) = match trial {
            Trial::Smooth(error) if trial.stands(h) => {
                let error = error.max(TINY);
                (proportional(error, 0.35) * self.last.clamp(0.1, 2.0).powf(0.1), error)
            }
            Trial::Smooth(error) => (proportional(error, 0.4).clamp(0.15, 0.8), 1.0),
            Trial::Impact(_) if trial.stands(h) => (1.5, 1.0),
            Trial::Impact(error) => (proportional(error, 1.0).clamp(0.2, 0.6), 1.0),
        };
        let next = (h * factor.clamp(0.15, FASTEST_GROWTH)).max(SHORTEST);
        // A step cut short by the end of the interval is no reason to go on with short ones.
        self.step = if trial.stands(h) && h < self.step { next.max(self.step) } else { next };
        self.last = last;
    }
}

fn proportional(error: f64, exponent: f64) -> f64 {
    // An error that is not a number is a large one.
    if error.is_finite() { SAFETY * error.powf(-exponent) } else { 0.0 }
}

const SAFETY: f64 = 0.9;
const FASTEST_GROWTH: f64 = 4.0;
/// Step after the robot is placed \[s\].
const FIRST_STEP: f64 = 1e-5;
/// Steps are never shorter \[s\]: below, round-off in the gaps outweighs what a step moves.
const SHORTEST: f64 = 1e-8;
/// Errors below this fraction of what is allowed are all the same.
const TINY: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_step_ends_the_interval_exactly_and_is_no_sliver() {
        let pace = Pace { step: 0.03, last: 1.0 };
        assert_eq!(pace.fit(0.1, 0.05), 0.03);
        assert_eq!(pace.fit(0.04, 0.05), 0.02);
        assert_eq!(pace.fit(0.02, 0.05), 0.02);
        assert_eq!(pace.fit(0.1, 0.01), 0.01);
    }

    #[test]
    fn steps_grow_when_errors_are_small_and_shrink_when_large() {
        let after = |trial| {
            let mut pace = Pace { step: 1e-3, last: 1.0 };
            pace.learn(1e-3, trial);
            pace.step
        };
        assert_eq!(after(Trial::Smooth(0.0)), 4e-3);
        assert!((0.8e-3..1e-3).contains(&after(Trial::Smooth(1.0))));
        assert!(after(Trial::Smooth(10.0)) < 0.5e-3);
        assert!(after(Trial::Impact(1.1)) <= 0.6e-3 && after(Trial::Impact(1e9)) == 0.2e-3);
        assert!(after(Trial::Smooth(f64::NAN)) < 0.2e-3, "what is not a number counts as an error without bound");
    }

    #[test]
    fn a_step_cut_short_by_the_interval_does_not_shorten_the_next() {
        let mut pace = Pace { step: 0.03, last: 1.0 };
        pace.learn(0.001, Trial::Smooth(1e-3));
        assert_eq!(pace.step, 0.03);
    }

    #[test]
    fn the_shortest_step_stands_whatever_its_error() {
        assert!(Trial::Impact(5.0).stands(SHORTEST) && !Trial::Impact(5.0).stands(1e-3));
    }
}
