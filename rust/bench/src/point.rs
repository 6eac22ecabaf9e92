//! One point of a work-precision plot, of the planar or the 3D model.

use serde::Serialize;
use snake_core::stepping::StepStatistics;
use snake_thesis::IntegratorConfig;

use crate::clock::{Spent, median};
use crate::reference::Distance;

#[derive(Debug, Serialize)]
pub struct Point<'a> {
    pub scene: &'a str,
    pub curve: &'a str,
    pub integrator: IntegratorConfig,
    /// Whether it is the default configuration of the model.
    pub default: bool,
    /// Distance from the reference \[m\]; none if the run did not end in its time, or diverged.
    pub error: Option<Distance>,
    /// Simulated seconds per CPU second of one thread: a single robot, and a fleet.
    pub speed_alone: f64,
    pub speed_fleet: Option<f64>,
    /// The same by wall clock.
    pub wall_alone: f64,
    pub wall_fleet: Option<f64>,
    /// Repetitions that the medians are of.
    pub repetitions: [usize; 2],
    pub simulated: f64,
    #[serde(flatten)]
    pub work: Work,
}

/// Work of the run whose error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Work {
    pub steps: u32,
    pub iterations: u32,
    pub misses: u32,
    pub fallbacks: u32,
    pub events: u32,
    pub diverged: bool,
}

impl Work {
    pub fn add(&mut self, report: &StepStatistics) {
        self.steps += report.steps;
        self.iterations += report.iterations;
        self.misses += report.unconverged;
        self.fallbacks += report.fallbacks;
        self.events += report.events;
        self.diverged |= report.diverged;
    }
}

/// Simulated seconds per second, by the median of the repetitions.
pub fn speed(simulated: f64, repetitions: &[Spent], time: fn(&Spent) -> f64) -> f64 {
    simulated / median(&repetitions.iter().map(time).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_of_a_run_is_that_of_its_pieces_together() {
        let piece =
            StepStatistics { steps: 1, iterations: 2, unconverged: 3, fallbacks: 4, events: 5, ..Default::default() };
        let mut work = Work::default();
        for diverged in [false, true, false] {
            work.add(&StepStatistics { diverged, ..piece });
        }
        assert_eq!(work, Work { steps: 3, iterations: 6, misses: 9, fallbacks: 12, events: 15, diverged: true });
    }
}
