use nalgebra::Vector3;

use crate::planar::{Stage, StageJoint};
use crate::rows::MotorRow;
use crate::solver::ActuatorTerm;

use super::actuator_bounds::ActuatorBounds;

/// What turns: a joint, or a link on the ground.
#[derive(Debug, Clone, Copy)]
pub(super) enum Turning {
    Joint(usize),
    Spin(usize),
}

impl Turning {
    /// Its rate under these twists.
    pub fn rate(self, twist: &[Vector3<f64>]) -> f64 {
        match self {
            Self::Joint(j) => twist[j + 1].z - twist[j].z,
            Self::Spin(i) => twist[i].z,
        }
    }
}

/// A bounded linear law of the rate of a joint, or of the spin of a link.
///
/// The law of an actuator falls from one bound to the other in straight pieces: one without backlash and motor, one at
/// either end of the play, one on each line of a motor. It is the sum of the bounded linear laws of the pieces, each
/// symmetric about its middle, and of the mean of both ends. The friction of a gear is one more, whose piece is steep, and
/// so is that of the ground against spin.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundedActuator {
    pub of: Turning,
    pub law: StageJoint,
    /// Added to the law \[N m s\].
    mean: f64,
    pub bounds: ActuatorBounds,
}

impl BoundedActuator {
    fn new(of: Turning, law: StageJoint, mean: f64) -> Self {
        Self { of, law, mean, bounds: ActuatorBounds::default() }
    }

    /// (impulse after the direction's change at constant rate, -change of the impulse per change of rate).
    pub fn linearised(&self, rate: f64) -> (f64, f64) {
        let (change, stiffness) = self.bounds.linearised(&self.law, rate);
        (self.mean + self.bounds.impulse(&self.law) + change, stiffness)
    }

    /// Updates the pairs to the rate and its change.
    pub fn follow(&mut self, rate: f64, change: f64) {
        let (own, stiffness) = self.bounds.linearised(&self.law, rate);
        self.bounds.follow(own - stiffness * change);
    }
}

/// Whether the law of a joint's actuator is not linear.
pub(super) fn is_bounded(stage: &Stage, joint: usize) -> bool {
    let StageJoint { stiffness, limit, slack, .. } = stage.joints[joint];
    falls(stage.motors.get(joint)) || (stiffness > 0.0 && (limit.is_finite() || slack > 0.0))
}

/// The impulse of a joint's actuator at a rate.
pub(super) fn actuator_impulse(joint: &StageJoint, motor: Option<&MotorRow>, rate: f64) -> f64 {
    let drive = ActuatorTerm::new(joint, 0.0).at(rate);
    motor.map_or(drive, |motor| motor.limit(rate, drive)).0
}

/// Friction of at most `bound` against the spin of a link of this inertia, or in the gear behind it.
pub(super) fn turning_friction(bound: f64, inertia: f64) -> StageJoint {
    StageJoint { drive: 0.0, stiffness: STIFFEST_GEAR * inertia, limit: bound, slack: 0.0 }
}

/// Lists the bounded actuators of a stage; `energy` is the stage's.
pub(super) fn list_bounded_actuators(stage: &Stage, energy: f64, actuators: &mut Vec<BoundedActuator>) {
    actuators.clear();
    let least = stage.links.iter().map(|link| link.inertia).fold(f64::INFINITY, f64::min);
    let fastest = FAR * (2.0 * energy / least).sqrt();
    for (i, (&bound, link)) in
        stage.link_spins().iter().zip(&stage.links).enumerate().filter(|(_, (bound, _))| **bound > 0.0)
    {
        actuators.push(BoundedActuator::new(Turning::Spin(i), turning_friction(bound, link.inertia), 0.0));
    }
    for (j, joint) in stage.joints.iter().enumerate() {
        let motor = stage.motors.get(j);
        if let Some(motor) = motor.filter(|motor| motor.friction > 0.0) {
            let law = turning_friction(motor.friction, stage.links[j].inertia);
            actuators.push(BoundedActuator::new(Turning::Joint(j), law, 0.0));
        }
        if !is_bounded(stage, j) {
            continue;
        }
        if joint.slack == 0.0 && !falls(motor) {
            actuators.push(BoundedActuator::new(Turning::Joint(j), *joint, 0.0));
            continue;
        }
        // Pieces need ends: where the actuator has no limit, one that the stage's energy does not reach.
        let limit = joint.limit.min(joint.drive.abs() + joint.slack + joint.stiffness * fastest);
        list_pieces(j, &StageJoint { limit, ..*joint }, motor.filter(|motor| falls(Some(motor))), actuators);
    }
}

fn falls(motor: Option<&MotorRow>) -> bool {
    motor.is_some_and(|motor| motor.fall > 0.0)
}

/// Lists the straight pieces of one law.
fn list_pieces(j: usize, joint: &StageJoint, motor: Option<&MotorRow>, actuators: &mut Vec<BoundedActuator>) {
    let StageJoint { drive, stiffness, limit, slack } = *joint;
    // Rates at which the law may bend.
    let mut rates: Vec<f64> = [-limit - slack, -slack, slack, limit + slack].map(|y| (drive - y) / stiffness).to_vec();
    if let Some(&MotorRow { stall, fall, .. }) = motor {
        let line = [(stall - limit) / fall, stall / fall];
        rates.extend(line.into_iter().chain(line.map(|rate| -rate)));
        rates.extend([drive - slack - stall, drive + slack + stall].map(|excess| excess / (stiffness - fall)));
    }
    rates.retain(|rate| rate.is_finite());
    rates.sort_unstable_by(f64::total_cmp);
    let impulse = |rate: f64| actuator_impulse(joint, motor, rate);
    let mut mean =
        rates.first().zip(rates.last()).map_or(0.0, |(first, last)| 0.5 * (impulse(*first) + impulse(*last)));
    for ends in rates.windows(2) {
        let (width, drop) = (ends[1] - ends[0], impulse(ends[0]) - impulse(ends[1]));
        if width > 0.0 && drop > 0.0 {
            let slope = drop / width;
            let middle = 0.5 * (ends[0] + ends[1]);
            let law = StageJoint { drive: slope * middle, stiffness: slope, limit: 0.5 * drop, slack: 0.0 };
            actuators.push(BoundedActuator::new(Turning::Joint(j), law, std::mem::take(&mut mean)));
        }
    }
}

/// Bound on the rate of a joint, in rates that would take all of the stage's energy.
const FAR: f64 = 10.0;

/// Stiffness of friction that sticks, in inertias of the link, or of that before the gear.
const STIFFEST_GEAR: f64 = 1e9;
