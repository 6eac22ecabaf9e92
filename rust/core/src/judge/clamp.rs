use crate::math::Real;

/// Violation |D - clamp(wanted)| of a limited actuator's law \[N m s\].
#[inline(always)]
pub fn clamp<T: Real>(impulse: T, wanted: T, limit: T) -> T {
    clamp_between(impulse, wanted, -limit, limit)
}

/// The same with a limit to either side.
#[inline(always)]
pub(super) fn clamp_between<T: Real>(impulse: T, wanted: T, least: T, most: T) -> T {
    (impulse - wanted.min(most).max(least)).abs()
}
