use nalgebra::Vector2;

use crate::math::Real;

use super::energy::Works;

/// What happened over some interval of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    pub steps: u32,
    /// Linear solves (`implicit`) or sweeps of Algorithm 3.1 (`thesis`).
    pub iterations: u32,
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly.
    pub events: u32,
    /// Stages that no solver brought to their tolerance.
    pub misses: u32,
    /// Stages that the fallback had to solve.
    pub fallbacks: u32,
    /// Those of them whose contacts contradicted each other: penetrations stayed.
    pub eased: u32,
    /// Worst certified residual of a stage \[m/s\].
    pub residual: f64,
    /// Worst duality gap of a stage \[J\].
    pub gap: f64,
    /// Work of the ground friction on the robot, never positive \[J\].
    pub friction_work: f64,
    /// Net work of the actuators \[J\].
    pub actuator_work: f64,
    /// Work of the actuators without what they absorb, joint by joint \[J\].
    pub positive_actuator_work: f64,
    /// Impulse of the pegs on each link, world frame \[N s\]; over an interval's length it is (T 7.6).
    pub contact_impulse: Vec<Vector2<f64>>,
}

impl Tally {
    pub fn new(links: usize) -> Self {
        Self { contact_impulse: vec![Vector2::zeros(); links], ..Self::default() }
    }

    /// Back to zero without giving memory back.
    pub fn clear(&mut self) {
        let mut contact_impulse = std::mem::take(&mut self.contact_impulse);
        contact_impulse.fill(Vector2::zeros());
        *self = Self { contact_impulse, ..Self::default() };
    }

    /// Works and impulses back to zero; the counters stay.
    pub fn clear_works(&mut self) {
        (self.friction_work, self.actuator_work, self.positive_actuator_work) = (0.0, 0.0, 0.0);
        self.contact_impulse.fill(Vector2::zeros());
    }

    /// Adds the works of one lane of a stage, taken `weight` times.
    pub(crate) fn add_works<T: Real>(&mut self, works: &Works<T>, lane: usize, weight: f64) {
        self.friction_work += weight * works.friction.lane(lane);
        self.actuator_work += weight * works.actuator.lane(lane);
        self.positive_actuator_work += weight * works.positive_actuator.lane(lane);
    }

    /// Takes note of a stage that the fallback solved.
    pub(crate) fn add_fallback(&mut self, solves: u32, eased: bool, open: bool, residual: f64, gap: f64) {
        self.fallbacks += 1;
        self.eased += u32::from(eased);
        self.add_solve(solves, open, residual, gap);
    }

    /// Takes note of how a stage was solved.
    pub fn add_solve(&mut self, iterations: u32, missed: bool, residual: f64, gap: f64) {
        self.iterations += iterations;
        self.misses += u32::from(missed);
        self.residual = worst(self.residual, residual);
        self.gap = worst(self.gap, gap);
    }
}

/// The larger; a figure that is not finite counts as the largest number, so that it shows in reports
/// and they stay finite.
fn worst(a: f64, b: f64) -> f64 {
    if b.is_finite() { a.max(b) } else { f64::MAX }
}

/// What happened during one call of `advance`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepReport {
    pub steps: u32,
    pub iterations: u32,
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly.
    pub events: u32,
    /// Stages that ended before their tolerance was met.
    pub misses: u32,
    /// Stages that the fallback had to solve.
    pub fallbacks: u32,
    /// Those of them whose contacts contradicted each other: penetrations stayed.
    pub eased: u32,
    /// Worst certified residual \[m/s\].
    pub residual: f64,
    /// Worst duality gap \[J\].
    pub gap: f64,
    /// \[J\], never positive.
    pub friction_work: f64,
    /// \[J\].
    pub actuator_work: f64,
    /// \[J\].
    pub positive_actuator_work: f64,
    /// The state became absurd; the simulation stays at its last good state.
    pub diverged: bool,
}

impl StepReport {
    pub fn new(tally: &Tally, diverged: bool) -> Self {
        Self {
            steps: tally.steps,
            iterations: tally.iterations,
            events: tally.events,
            misses: tally.misses,
            fallbacks: tally.fallbacks,
            eased: tally.eased,
            residual: tally.residual,
            gap: tally.gap,
            friction_work: tally.friction_work,
            actuator_work: tally.actuator_work,
            positive_actuator_work: tally.positive_actuator_work,
            diverged,
        }
    }
}
