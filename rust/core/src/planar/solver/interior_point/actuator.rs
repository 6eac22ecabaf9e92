use crate::planar::{Stage, StageJoint};

use super::actuator_bounds::ActuatorBounds;

/// The law of a joint's actuator, or one of its two halves, as a bounded linear law.
///
/// With backlash, `clamp(shrink(y, slack), limit) = clamp(y - slack, 0, limit) + clamp(y + slack, -limit, 0)`: one
/// half for either end of the play. Each becomes symmetric by half its limit, which the other half takes back.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoundedActuator {
    pub joint: usize,
    pub law: StageJoint,
    pub bounds: ActuatorBounds,
}

impl BoundedActuator {
    fn new(joint: usize, law: StageJoint) -> Self {
        Self { joint, law, bounds: ActuatorBounds::default() }
    }

    /// (impulse after the direction's change at constant rate, -change of the impulse per change of rate).
    pub fn linearised(&self, rate: f64) -> (f64, f64) {
        let (change, stiffness) = self.bounds.linearised(&self.law, rate);
        (self.bounds.impulse(&self.law) + change, stiffness)
    }

    /// Updates the pairs to the joint's rate and its change.
    pub fn follow(&mut self, rate: f64, change: f64) {
        let (own, stiffness) = self.bounds.linearised(&self.law, rate);
        self.bounds.follow(own - stiffness * change);
    }
}

/// Whether a joint's law is not linear.
pub(super) fn is_bounded(joint: &StageJoint) -> bool {
    joint.stiffness > 0.0 && (joint.limit.is_finite() || joint.slack > 0.0)
}

/// Lists the bounded actuators of a stage; `energy` is the stage's.
pub(super) fn list_bounded_actuators(stage: &Stage, energy: f64, actuators: &mut Vec<BoundedActuator>) {
    actuators.clear();
    let least = stage.links.iter().map(|link| link.inertia).fold(f64::INFINITY, f64::min);
    let fastest = FAR * (2.0 * energy / least).sqrt();
    for (j, joint) in stage.joints.iter().enumerate().filter(|(_, joint)| is_bounded(joint)) {
        if joint.slack == 0.0 {
            actuators.push(BoundedActuator::new(j, *joint));
            continue;
        }
        // A half needs a limit: where the actuator has none, one that the stage's energy does not reach.
        let limit = joint.limit.min(joint.drive.abs() + joint.slack + joint.stiffness * fastest);
        for side in [-1.0, 1.0] {
            let drive = joint.drive + side * (joint.slack + 0.5 * limit);
            actuators.push(BoundedActuator::new(j, StageJoint { drive, limit: 0.5 * limit, slack: 0.0, ..*joint }));
        }
    }
}

/// Bound on the rate of a joint, in rates that would take all of the stage's energy.
const FAR: f64 = 10.0;
