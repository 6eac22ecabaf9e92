use nalgebra::Vector2;

use crate::math::Real;

use super::norm;

/// How far an impulse and a slip velocity are from obeying Coulomb's law.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DiscViolation<T> {
    /// Distance of the impulse from its projection, as an impulse \[N s\].
    pub law: T,
    /// Fenchel's defect `support(-gamma) + P . gamma`, nonnegative for an admissible impulse \[J\].
    pub gap: T,
}

/// Violation of `-gamma in N_C(P)` for the ellipse with semi-axes `a` \[N s\] under a link of mass `mass`
/// (T 3.63 != D4).
///
/// The projection is taken in coordinates in which the ellipse is the unit disc: P = A p, gamma^ = A gamma; along a
/// zero axis any impulse is a violation.
#[inline(always)]
pub(crate) fn disc<T: Real>(a: &Vector2<T>, slip: &Vector2<T>, impulse: &Vector2<T>, mass: T) -> DiscViolation<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let inverse_or_zero = |axis: T| T::select(zero.lt(axis), one / axis, zero);
    let scaled = Vector2::new(a.x * slip.x, a.y * slip.y);
    let inverse = Vector2::new(inverse_or_zero(a.x), inverse_or_zero(a.y));
    let p = Vector2::new(impulse.x * inverse.x, impulse.y * inverse.y);
    let x_is_largest = a.y.le(a.x);
    let (largest, inverse) = (T::select(x_is_largest, a.x, a.y), T::select(x_is_largest, inverse.x, inverse.y));
    let rate = mass * inverse * inverse;
    let x = Vector2::new(p.x - rate * scaled.x, p.y - rate * scaled.y);
    let shrink = one / norm(x.x, x.y).max(one);
    let violation = norm(p.x - x.x * shrink, p.y - x.y * shrink) * largest;
    let outside = (impulse.x - p.x * a.x).abs() + (impulse.y - p.y * a.y).abs();
    let gap = norm(scaled.x, scaled.y) + impulse.x * slip.x + impulse.y * slip.y;
    DiscViolation { law: violation + outside, gap }
}
