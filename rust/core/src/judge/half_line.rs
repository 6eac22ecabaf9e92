use crate::math::Real;

/// Violation of Signorini's law `0 <= P _|_ gamma >= 0` (T 3.56): |P - max(P - m gamma, 0)| for an impulse on a link of
/// mass m whose contact opens at gamma \[N s\].
#[inline(always)]
pub(crate) fn half_line<T: Real>(impulse: T, opening: T, mass: T) -> T {
    let nearest = (impulse - mass * opening).max(T::zero());
    (impulse - nearest).abs()
}
