use crate::planar::StageJoint;

use super::pair::Pair;

/// The bounded law D = clamp(b - k omega, -limit, limit) of one joint, k > 0.
///
/// With the excess rates e+, e- >= 0 it is D = b - k (omega + e+ - e-), where e+ and limit - D, e- and
/// limit + D are complementary.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ActuatorBounds {
    pub upper: Pair,
    pub lower: Pair,
}

impl ActuatorBounds {
    pub fn begin(joint: &StageJoint, rate: f64, mu: f64) -> Self {
        let most = 0.9 * joint.limit;
        let impulse = (joint.drive - joint.stiffness * rate).clamp(-most, most);
        let (above, below) = (joint.limit - impulse, joint.limit + impulse);
        Self { upper: Pair::new(mu / above, above), lower: Pair::new(mu / below, below) }
    }

    /// D, from the nearer bound.
    pub fn impulse(&self, joint: &StageJoint) -> f64 {
        if self.upper.z < self.lower.z { joint.limit - self.upper.z } else { self.lower.z - joint.limit }
    }

    /// (change of D at constant rate, -change of D per change of rate).
    pub fn linearised(&self, joint: &StageJoint, rate: f64) -> (f64, f64) {
        let Self { upper, lower } = self;
        let k = joint.stiffness;
        let softening = 1.0 + k * (upper.s / upper.z + lower.s / lower.z);
        let mismatch = joint.drive - k * (rate + upper.s - lower.s) - self.impulse(joint);
        ((mismatch - k * (upper.right / upper.z - lower.right / lower.z)) / softening, k / softening)
    }

    /// The direction that belongs to the change `change` of D.
    pub fn follow(&mut self, change: f64) {
        let Self { upper, lower } = self;
        (upper.dz, lower.dz) = (-change, change);
        upper.ds = (upper.right + upper.s * change) / upper.z;
        lower.ds = (lower.right - lower.s * change) / lower.z;
    }
}
