use crate::math::Real;

use super::ConvexSet;

/// A bounded scalar, C = [-limit, limit]: the torque an actuator can give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval<T = f64> {
    pub limit: T,
}

impl<T: Real> ConvexSet for Interval<T> {
    type Point = T;
    type Scalar = T;

    #[inline(always)]
    fn project(&self, x: T) -> T {
        x.min(self.limit).max(-self.limit)
    }

    #[inline(always)]
    fn support(&self, v: T) -> T {
        self.limit * v.abs()
    }
}

impl<T: Real> Interval<T> {
    /// Whether the last friction lay clearly inside this bound, so that the contact stuck.
    #[inline(always)]
    pub fn stuck(&self, last: T) -> T::Mask {
        last.abs().lt(T::splat(STUCK) * self.limit)
    }

    /// Whether `x` lies in the interval; NaN does not.
    #[inline(always)]
    pub fn contains(&self, x: T) -> T::Mask {
        x.abs().le(self.limit)
    }
}

/// Share of the bound below which friction was that of sticking. Friction of a contact is known as a vector and projected on a
/// direction that has turned since; other friction carries round-off.
const STUCK: f64 = 1.0 - 1e-3;
