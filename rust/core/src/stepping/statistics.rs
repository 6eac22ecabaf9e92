use crate::math::Real;

use crate::solver::SolveStatus;

use super::energy::EnergyLedger;
use super::verdict::FallbackResult;

/// What happened over some interval of time: counters, worst figures and work of one robot.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepStatistics {
    pub steps: u32,
    /// Linear solves, or the iterations of another method.
    pub iterations: u32,
    /// Steps of second order, and parts of steps, that were retaken: forces changed abruptly, or a penetration became too
    /// deep.
    pub events: u32,
    /// Stages of accepted parts that no solver solved to tolerance.
    pub unconverged: u32,
    /// Stages handed to the fallback, those of rejected parts included.
    pub fallbacks: u32,
    /// Stages of accepted parts whose contacts contradicted each other: penetrations remained.
    pub relaxed: u32,
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
    /// Energy that motors draw, see [`EnergyLedger`]; zero without motors \[J\].
    pub electrical_work: f64,
    /// The state became implausible; the robot keeps its last plausible state.
    pub diverged: bool,
    /// A link ended a step more than 1 mm inside what it touches, and no shorter step avoided it.
    pub penetrated: bool,
}

impl StepStatistics {
    /// Resets the work; the counters stay.
    pub fn clear_work(&mut self) {
        (self.friction_work, self.actuator_work) = (0.0, 0.0);
        (self.positive_actuator_work, self.electrical_work) = (0.0, 0.0);
    }

    /// Adds the work of one lane of a stage, taken `weight` times.
    pub fn add_work<T: Real>(&mut self, energy: &EnergyLedger<T>, lane: usize, weight: f64) {
        self.friction_work += weight * energy.friction.lane(lane);
        self.actuator_work += weight * energy.actuator.lane(lane);
        self.positive_actuator_work += weight * energy.positive_actuator.lane(lane);
        self.electrical_work += weight * energy.electrical.lane(lane);
    }

    /// Counts a stage that the fallback took over after `iterations` of Newton's method.
    pub(crate) fn add_fallback(&mut self, iterations: u32, result: &FallbackResult) {
        self.fallbacks += 1;
        self.relaxed += u32::from(result.status == SolveStatus::Relaxed);
        let unconverged = result.status == SolveStatus::Unsolved;
        self.add_solve(iterations + result.solves, unconverged, result.residual, result.gap);
    }

    /// Takes over what `stages` says of how well stages were solved.
    pub(crate) fn add_quality(&mut self, stages: &Self) {
        self.unconverged += stages.unconverged;
        self.relaxed += stages.relaxed;
        self.residual = worst(self.residual, stages.residual);
        self.gap = worst(self.gap, stages.gap);
    }

    /// Counts how a stage was solved.
    pub fn add_solve(&mut self, iterations: u32, unconverged: bool, residual: f64, gap: f64) {
        self.iterations += iterations;
        self.unconverged += u32::from(unconverged);
        self.residual = worst(self.residual, residual);
        self.gap = worst(self.gap, gap);
    }
}

/// The larger; a figure that is not finite counts as the largest number, so that it shows in reports
/// and they stay finite.
fn worst(a: f64, b: f64) -> f64 {
    if b.is_finite() { a.max(b) } else { f64::MAX }
}
