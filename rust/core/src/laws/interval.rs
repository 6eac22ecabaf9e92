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
    /// Whether `x` lies in the interval; NaN does not.
    #[inline(always)]
    pub fn contains(&self, x: T) -> T::Mask {
        x.abs().le(self.limit)
    }
}
