//! The motor of a joint axis in a stage: a torque-speed line, an inertia and a friction.
//!
//! A motor that turns with the joint gives up to `min(limit, stall - fall phi')` upwards and `min(limit, stall + fall
//! phi')` downwards, not below zero: less and less the faster it drives, up to its limit where it brakes. Within these
//! bounds it gives what its PD law asks for. All of that falls with the rate, so the torque is minus the gradient of a
//! convex function. The rotor's inertia J adds `J (phi'_A - phi')` over a stage, with the rate phi'_A that it would keep
//! without any torque, the damping of the gear `-c d phi'`, and its friction `-phi' in N_[-b, b](P)`: all are convex too.
//! A stage keeps its one solution.

use serde::{Deserialize, Serialize};

use crate::math::{Real, laned};

use super::Saved;

/// The motor of one axis in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct MotorRow<T = f64> {
    /// c times the stall torque \[N m s\].
    #[serde(with = "crate::rows::limit")]
    pub stall: T,
    /// Decrease of the largest impulse per rate, [`Self::stall`] over the no-load speed \[N m s^2\].
    pub fall: T,
    /// Largest impulse of the gear's friction \[N m s\].
    pub friction: T,
    /// J \[kg m^2\].
    pub inertia: T,
    /// phi'_A \[rad/s\].
    pub reference: T,
    /// c times the damping of the gear \[N m s^2\].
    pub damping: T,
}

laned! {
    MotorRow { stall, fall, friction, inertia, reference, damping };
}

impl<T: Real> MotorRow<T> {
    /// Of an axis without motor, or whose joint is broken.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        let stall = T::splat(f64::INFINITY);
        Self { stall, fall: zero, friction: zero, inertia: zero, reference: zero, damping: zero }
    }

    /// What an ideal DC motor draws over a stage while it gives an impulse: work and the heat `c torque^2 omega_0 / stall
    /// torque`, nothing where it would give energy back \[J\].
    #[inline(always)]
    pub fn drawn(&self, impulse: T, rate: T) -> T {
        let zero = T::zero();
        let heat = T::select(zero.lt(self.fall), impulse * impulse / self.fall, zero);
        (impulse * rate + heat).max(zero)
    }

    /// Work of the gear's friction, which has this impulse, and damping; never positive \[J\].
    #[inline(always)]
    pub fn gear_work(&self, friction: T, rate: T) -> T {
        ((friction - self.damping * rate) * rate).min(T::zero())
    }

    /// Impulse and stiffness of a drive with the given ones at a rate, kept within the line.
    #[inline(always)]
    pub fn limit(&self, rate: T, (impulse, stiffness): (T, T)) -> (T, T) {
        let (zero, loss) = (T::zero(), self.fall * rate);
        let (upper, lower) = (self.stall - loss, self.stall + loss);
        let (most, least) = (upper.max(zero), -(lower.max(zero)));
        let (above, below) = (most.lt(impulse), impulse.lt(least));
        let falls = (above & zero.lt(upper)) | (below & zero.lt(lower));
        let on_line = T::select(falls, self.fall, zero);
        (impulse.min(most).max(least), T::select(above | below, on_line, stiffness))
    }

    /// Impulse of inertia and damping at a rate, and its decrease per rate.
    #[inline(always)]
    pub fn passive(&self, rate: T) -> (T, T) {
        (self.inertia * (self.reference - rate) - self.damping * rate, self.inertia + self.damping)
    }
}
