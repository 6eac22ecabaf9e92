use nalgebra::Vector2;

use crate::math::Real;
use crate::planar::Closing;

use super::rescue::Rescued;
use super::works::Works;

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

    /// Takes note of a stage that took the fallback after `iterations` of Newton's method.
    pub fn add_rescue(&mut self, iterations: u32, rescued: &Rescued) {
        let Rescued { solves, closing, certificate } = rescued;
        self.fallbacks += 1;
        self.eased += u32::from(*closing == Closing::Eased);
        self.add_solve(iterations + solves, *closing == Closing::Open, certificate.residual(), certificate.gap);
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
