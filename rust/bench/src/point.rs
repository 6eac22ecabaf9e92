//! One point of a work-precision plot, in the plane or in space.

use serde::Serialize;
use snake_core::stepper::IntegratorConfig;

use crate::clock::{Spent, median};
use crate::reference::Distance;

#[derive(Debug, Serialize)]
pub struct Point<'a> {
    pub scene: &'a str,
    pub curve: &'a str,
    pub integrator: IntegratorConfig,
    /// It is what a user of the model gets who asks for nothing.
    pub default: bool,
    /// Distance from the reference at the end \[m\]; none if the run did not end in its time, or diverged.
    pub error: Option<Distance>,
    /// Simulated seconds per CPU second of one thread: one robot alone, and a fleet.
    pub speed_alone: f64,
    pub speed_fleet: Option<f64>,
    /// The same by wall clock.
    pub wall_alone: f64,
    pub wall_fleet: Option<f64>,
    /// Repetitions that the medians are of.
    pub repetitions: [usize; 2],
    pub simulated: f64,
    pub steps: u32,
    pub iterations: u32,
    pub misses: u32,
    pub fallbacks: u32,
    pub events: u32,
    pub diverged: bool,
}

/// Simulated seconds per second, by the median of the repetitions.
pub fn speed(simulated: f64, repetitions: &[Spent], time: fn(&Spent) -> f64) -> f64 {
    simulated / median(&repetitions.iter().map(time).collect::<Vec<_>>())
}
