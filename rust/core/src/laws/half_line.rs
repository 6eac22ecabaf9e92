use crate::math::Real;

use super::ConvexSet;

/// Unilateral contact, C_H = {lambda >= 0} (T 3.56)-(T 3.59).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfLine;

impl HalfLine {
    /// prox_C(x).
    #[inline(always)]
    pub fn project<T: Real>(self, x: T) -> T {
        x.max(T::zero())
    }

    /// Whether prox_C is on its identity branch at `x`: the contact is closed.
    #[inline(always)]
    pub fn is_closed<T: Real>(self, x: T) -> T::Mask {
        T::zero().lt(x)
    }

    /// Impulse and stiffness of the branch that the mask `closed` selects, whichever branch `x` lies on, where `x`
    /// falls by `penalty` per velocity.
    #[inline(always)]
    pub fn evaluate<T: Real>(self, x: T, penalty: T, closed: T::Mask) -> (T, T) {
        (T::select(closed, x, T::zero()), T::select(closed, penalty, T::zero()))
    }

    /// First and second derivative by alpha of the convex function whose negative gradient by the velocity is
    /// `P = prox_C(x)`, where `x` falls by `penalty` per velocity and the velocity changes at `rate`.
    #[inline(always)]
    pub fn along<T: Real>(self, x: T, penalty: T, rate: T) -> (T, T) {
        let penalty = T::select(self.is_closed(x), penalty, T::zero());
        (-self.project(x) * rate, penalty * rate * rate)
    }

    /// The alpha at which that function bends, where the contact opens or closes.
    #[inline(always)]
    pub fn kink<T: Real>(self, x: T, penalty: T, rate: T) -> T {
        x / (penalty * rate)
    }
}

impl ConvexSet for HalfLine {
    type Point = f64;
    type Scalar = f64;

    fn project(&self, x: f64) -> f64 {
        HalfLine::project(*self, x)
    }

    fn support(&self, v: f64) -> f64 {
        if v <= 0.0 { 0.0 } else { f64::INFINITY }
    }
}
