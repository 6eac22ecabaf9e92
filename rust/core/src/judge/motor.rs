use crate::math::Real;
use crate::rows::MotorRow;

use super::clamp::{clamp, clamp_between};

/// Violation of the law of a drive whose motor, if it has one, turns at `rate`: within its largest impulse `limit`, less
/// the faster it drives, it gives `tight` but for what a dead zone takes off its magnitude \[N m s\].
#[inline(always)]
pub(crate) fn drive<T: Real>(impulse: T, tight: T, slack: T, limit: T, motor: Option<(&MotorRow<T>, T)>) -> T {
    let zero = T::zero();
    let wanted = (tight - slack).max(zero) + (tight + slack).min(zero);
    let Some((motor, rate)) = motor else { return clamp_between(impulse, wanted, -limit, limit) };
    let most = |rate: T| limit.min((motor.stall - motor.fall * rate).max(zero));
    clamp_between(impulse, wanted, -most(-rate), most(rate))
}

/// What a motor gives beside its drive at a rate, with the friction `gear` \[N m s\].
#[inline(always)]
pub(crate) fn motor_impulse<T: Real>(motor: &MotorRow<T>, gear: T, rate: T) -> T {
    let MotorRow { inertia, reference, damping, .. } = *motor;
    gear + inertia * reference - (inertia + damping) * rate
}

/// Violation of the law of friction against turning, `-rate in N_[-b, b](P)`, of a link of this mass and half length or in
/// the gear behind it, as a velocity \[m/s\].
#[inline(always)]
pub(crate) fn turning<T: Real>(bound: T, friction: T, rate: T, mass: T, half_length: T) -> T {
    let lever = mass * half_length;
    clamp(friction, friction - lever * (rate * half_length), bound) / lever
}
