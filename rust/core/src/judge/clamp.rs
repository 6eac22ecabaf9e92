use crate::math::Real;

/// Violation |D - clamp(wanted)| of a limited actuator's law \[N m s\].
#[inline(always)]
pub fn clamp<T: Real>(impulse: T, wanted: T, limit: T) -> T {
    let law = wanted.min(limit).max(-limit);
    (impulse - law).abs()
}

/// The same behind a gear whose dead zone takes up to `slack` off the magnitude of `tight`.
#[inline(always)]
pub(crate) fn clamp_with_backlash<T: Real>(impulse: T, tight: T, slack: T, limit: T) -> T {
    let zero = T::zero();
    clamp(impulse, (tight - slack).max(zero) + (tight + slack).min(zero), limit)
}
