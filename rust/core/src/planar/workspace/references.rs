//! References of the joints, in lanes.

use crate::gait::{Jet, JointTarget, WaveJets};
use crate::math::Real;

/// What the joints follow at the end of a stage.
pub struct References<T> {
    /// The wave that they follow, where they follow one.
    pub wave: WaveJets<T>,
    pub target: Vec<Jet<T>>,
    /// Of one robot.
    pub targets: Vec<JointTarget>,
}

impl<T: Real> References<T> {
    pub fn new(joints: usize) -> Self {
        let zero = T::zero();
        Self {
            wave: WaveJets::still(),
            target: vec![Jet { value: zero, rate: zero, acceleration: zero }; joints],
            targets: vec![JointTarget::default(); joints],
        }
    }
}
