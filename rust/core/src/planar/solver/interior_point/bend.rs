use crate::planar::{Stage, StageJoint};

use super::drive::Drive;

/// A joint's law, or one of its two halves, as a bounded drive.
///
/// With free play, `clamp(shrink(y, slack), limit) = clamp(y - slack, 0, limit) + clamp(y + slack, -limit, 0)`: one
/// half for either end of the play. Each becomes symmetric by half its limit, which the other half takes back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    pub joint: usize,
    pub law: StageJoint,
    pub drive: Drive,
}

impl Bend {
    fn new(joint: usize, law: StageJoint) -> Self {
        Self { joint, law, drive: Drive::default() }
    }

    /// (impulse after the direction's change at constant rate, -change of the impulse per change of rate).
    pub fn linearised(&self, rate: f64) -> (f64, f64) {
        let (change, stiffness) = self.drive.linearised(&self.law, rate);
        (self.drive.impulse(&self.law) + change, stiffness)
    }

    /// Lets the pairs follow the joint's rate and its change.
    pub fn follow(&mut self, rate: f64, change: f64) {
        let (own, stiffness) = self.drive.linearised(&self.law, rate);
        self.drive.follow(own - stiffness * change);
    }
}

/// Whether a joint's law is more than linear.
pub(super) fn is_bent(joint: &StageJoint) -> bool {
    joint.stiffness > 0.0 && (joint.limit.is_finite() || joint.slack > 0.0)
}

/// Lists the bent laws of a stage; `energy` is the stage's.
pub(super) fn list_bends(stage: &Stage, energy: f64, bends: &mut Vec<Bend>) {
    bends.clear();
    let least = stage.links.iter().map(|link| link.inertia).fold(f64::INFINITY, f64::min);
    let fastest = FAR * (2.0 * energy / least).sqrt();
    for (j, joint) in stage.joints.iter().enumerate().filter(|(_, joint)| is_bent(joint)) {
        if joint.slack == 0.0 {
            bends.push(Bend::new(j, *joint));
            continue;
        }
        // A half needs a limit: where the drive has none, one that the stage's energy does not reach.
        let limit = joint.limit.min(joint.drive.abs() + joint.slack + joint.stiffness * fastest);
        for side in [-1.0, 1.0] {
            let drive = joint.drive + side * (joint.slack + 0.5 * limit);
            bends.push(Bend::new(j, StageJoint { drive, limit: 0.5 * limit, slack: 0.0, ..*joint }));
        }
    }
}

/// Rate beyond any that a joint reaches, in those that would take all of the stage's energy.
const FAR: f64 = 10.0;
