use crate::math::Real;

use super::{ConvexSet, Interval};

/// A PD actuator with a torque limit at the end of a stage: the impulse `clamp(offset - stiffness omega)` at the joint
/// rate omega, a single-valued law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedActuator<T = f64> {
    /// Impulse at rest without limit \[N m s\].
    pub offset: T,
    /// Decrease of the impulse per rate \[N m s^2\].
    pub stiffness: T,
    /// Largest impulse \[N m s\].
    pub limit: T,
}

impl<T: Real> LimitedActuator<T> {
    /// No actuator.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        Self { offset: zero, stiffness: zero, limit: zero }
    }

    /// The impulse without limit.
    #[inline(always)]
    pub fn unlimited(&self, rate: T) -> T {
        self.offset - self.stiffness * rate
    }

    /// Impulse and stiffness at a rate.
    #[inline(always)]
    pub fn evaluate(&self, rate: T) -> (T, T) {
        let (interval, wanted) = (Interval { limit: self.limit }, self.unlimited(rate));
        (interval.project(wanted), T::select(interval.contains(wanted), self.stiffness, T::zero()))
    }

    /// First and second derivative by alpha of the law's convex function at `rate + alpha change`.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (value, stiffness) = self.evaluate(rate + alpha * change);
        (-value * change, stiffness * change * change)
    }

    /// The alpha at which the impulse is zero, midway between the bends of that function at both limits, which in a stiff law
    /// are close to each other. Not a number where the limit is zero.
    #[inline(always)]
    pub fn kink(&self, rate: T, change: T) -> T {
        let kink = self.unlimited(rate) / (self.stiffness * change);
        T::select(T::zero().lt(self.limit), kink, T::splat(f64::NAN))
    }
}
