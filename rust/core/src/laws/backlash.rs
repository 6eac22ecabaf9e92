use crate::math::Real;

use super::{ConvexSet, Interval, LimitedActuator};

/// A limited actuator behind a gear with backlash: `clamp(y - prox_S(y))` with `y = offset - stiffness omega` and the
/// dead zone S = [-slack, slack].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash<T = f64> {
    pub actuator: LimitedActuator<T>,
    /// Half the dead zone, as an impulse; zero without backlash \[N m s\].
    pub slack: T,
}

impl<T: Real> Backlash<T> {
    /// No actuator.
    #[inline(always)]
    pub fn none() -> Self {
        Self { actuator: LimitedActuator::none(), slack: T::zero() }
    }

    /// Impulse and stiffness at a rate.
    #[inline(always)]
    pub fn evaluate(&self, rate: T) -> (T, T) {
        let (wanted, engaged) = self.unlimited(rate);
        let limit = self.limit();
        self.on_branch(wanted, engaged, limit.contains(wanted), wanted)
    }

    /// The same on the branch, within or at the limit, on which the law gave the impulse `last`.
    #[inline(always)]
    pub fn evaluate_last_branch(&self, rate: T, last: T) -> (T, T) {
        let (wanted, engaged) = self.unlimited(rate);
        let within = last.abs().lt(T::splat(BELOW_LIMIT) * self.actuator.limit);
        self.on_branch(wanted, engaged, within, last)
    }

    /// First and second derivative by alpha of the law's convex function at `rate + alpha change`.
    #[inline(always)]
    pub fn along(&self, rate: T, change: T, alpha: T) -> (T, T) {
        let (wanted, engaged) = self.unlimited(rate + alpha * change);
        let limit = self.limit();
        let stiffness = T::select(engaged & limit.contains(wanted), self.actuator.stiffness, T::zero());
        (-limit.project(wanted) * change, stiffness * change * change)
    }

    /// Impulse and stiffness: `wanted` in the lanes `within` the limit, elsewhere the limit on the side of `side`.
    #[inline(always)]
    fn on_branch(&self, wanted: T, engaged: T::Mask, within: T::Mask, side: T) -> (T, T) {
        let value = T::select(within, wanted, self.limit().project(side));
        (value, T::select(within & engaged, self.actuator.stiffness, T::zero()))
    }

    /// The impulse without limit, and whether the gear is engaged.
    #[inline(always)]
    fn unlimited(&self, rate: T) -> (T, T::Mask) {
        let tight = self.actuator.unlimited(rate);
        let wanted = tight - Interval { limit: self.slack }.project(tight);
        (wanted, self.slack.le(tight.abs()))
    }

    #[inline(always)]
    fn limit(&self) -> Interval<T> {
        Interval { limit: self.actuator.limit }
    }
}

/// Share of the limit up to which a last impulse was within it: forces carry round-off from stage to stage.
const BELOW_LIMIT: f64 = 1.0 - 1e-9;
