//! Work of friction and actuators over a stage.

use crate::math::Real;
use crate::rows::MotorRow;

/// Work of friction and of the actuators over a stage \[J\].
#[derive(Debug, Clone, Copy)]
pub struct EnergyLedger<T> {
    /// Never positive.
    pub friction: T,
    pub actuator: T,
    /// Without the energy that actuators absorb.
    pub positive_actuator: T,
    /// What motors draw, heat included; none where they would give energy back.
    pub electrical: T,
}

impl<T: Real> EnergyLedger<T> {
    pub fn zero() -> Self {
        let zero = T::zero();
        Self { friction: zero, actuator: zero, positive_actuator: zero, electrical: zero }
    }

    /// Copies other work in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        self.friction = T::select(lanes, other.friction, self.friction);
        self.actuator = T::select(lanes, other.actuator, self.actuator);
        self.positive_actuator = T::select(lanes, other.positive_actuator, self.positive_actuator);
        self.electrical = T::select(lanes, other.electrical, self.electrical);
    }

    /// Adds the work of the actuator of a joint axis, and what its motor draws if it has one.
    #[inline(always)]
    pub fn add_drive(&mut self, impulse: T, rate: T, motor: Option<&MotorRow<T>>) {
        let work = impulse * rate;
        self.actuator += work;
        self.positive_actuator += work.max(T::zero());
        if let Some(motor) = motor {
            self.electrical += motor.drawn(impulse, rate);
        }
    }
}
