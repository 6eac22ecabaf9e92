//! Work of friction and actuators over a stage.

use crate::math::Real;

/// Work of friction and of the actuators over a stage \[J\].
#[derive(Debug, Clone, Copy)]
pub struct EnergyLedger<T> {
    /// Never positive.
    pub friction: T,
    pub actuator: T,
    /// Without the energy that actuators absorb.
    pub positive_actuator: T,
}

impl<T: Real> EnergyLedger<T> {
    pub fn zero() -> Self {
        Self { friction: T::zero(), actuator: T::zero(), positive_actuator: T::zero() }
    }

    /// Copies other work in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        self.friction = T::select(lanes, other.friction, self.friction);
        self.actuator = T::select(lanes, other.actuator, self.actuator);
        self.positive_actuator = T::select(lanes, other.positive_actuator, self.positive_actuator);
    }
}
