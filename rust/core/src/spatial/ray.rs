//! The line search: a zero of the convex function's slope along start + alpha step.

use crate::math::{Mask, Real};

use super::link_term::rolling_velocity;
use super::newton::Newton;
use super::screw::Screw;

impl<T: Real> Newton<T> {
    /// First and generalised second derivative of the function by alpha, of a strongly convex,
    /// piecewise smooth function \[J\]; `inertia` is the quadratic part, [`Newton::inertia_along`].
    #[inline(always)]
    fn derivatives(&self, inertia: [T; 2], alpha: T) -> (T, T) {
        let (mut slope, mut curvature) = (inertia[0] + alpha * inertia[1], inertia[1]);
        let mut add = |(first, second): (T, T)| {
            slope += first;
            curvature += second;
        };
        for link in &self.links {
            let tangent = &link.link.tangent;
            for end in &link.ends {
                let (slip, closing) = end.velocity(&link.start, tangent);
                let (slip_rate, closing_rate) = end.velocity(&link.step, tangent);
                add(end.normal.along(closing, closing_rate, alpha));
                add(end.friction.along(&slip, &slip_rate, alpha));
            }
            let rolling = |x: &Screw<T>| rolling_velocity(&link.link, x);
            add(link.rolling.along(&rolling(&link.start), &rolling(&link.step), alpha));
            for axis in 0..2 {
                add(link.drives[axis].along(link.start_rates[axis], link.step_rates[axis], alpha));
            }
        }
        for peg in &self.pegs {
            let link = &self.links[peg.link];
            add(peg.contact.along(peg.direction.dot(&link.start), peg.direction.dot(&link.step), alpha));
        }
        (slope, curvature)
    }

    /// Slope of |x - M^-1 p|_M^2 / 2 at alpha = 0, and its constant rise.
    #[inline(always)]
    fn inertia_along(&self) -> [T; 2] {
        let (mut slope, mut rise) = (T::zero(), T::zero());
        for link in &self.links {
            let change = link.link.momentum_of(&link.step);
            slope += change.dot(&link.start) - link.link.momentum.dot(&link.step);
            rise += change.dot(&link.step);
        }
        [slope, rise]
    }

    /// A zero of the slope on (0, 1), up to `accuracy` \[J\], in the given lanes. Where the slope at 1 is
    /// not positive it is 1.
    ///
    /// Newton's method from the end, which crosses a stiff contact or a stuck link in one step, kept within
    /// a bracket. Where it leaves the bracket it is replaced by the kink nearest to the bracket's middle,
    /// since the zero often lies in one: where a contact comes to rest the slope all but jumps.
    #[inline(always)]
    pub(super) fn zero_of_slope(&mut self, accuracy: T, lanes: T::Mask) -> T {
        let inertia = self.inertia_along();
        self.find_kinks();
        let (mut low, mut high) = (T::zero(), T::splat(1.0));
        let (mut alpha, mut searching) = (high, lanes);
        for _ in 0..MAX_EVALUATIONS {
            let (here, curvature) = self.derivatives(inertia, alpha);
            searching = searching & accuracy.lt(here.abs());
            let beyond = T::zero().lt(here);
            low = T::select(beyond, low, alpha);
            high = T::select(beyond, alpha, high);
            searching = searching & low.lt(high);
            if !searching.any() {
                break;
            }
            let newton = alpha - here / curvature;
            let inside = low.lt(newton) & newton.lt(high);
            let next = T::select(inside, newton, self.kink_between(low, high));
            alpha = T::select(searching, next, alpha);
        }
        alpha
    }

    #[inline(always)]
    fn find_kinks(&mut self) {
        for link in &mut self.links {
            let tangent = &link.link.tangent;
            for (kink, end) in link.kinks.iter_mut().zip(&link.ends) {
                let (slip, _) = end.velocity(&link.start, tangent);
                let (rate, _) = end.velocity(&link.step, tangent);
                *kink = end.friction.kink(&slip, &rate);
            }
        }
    }

    /// The kink nearest to the middle of the bracket, or the middle if no kink lies inside.
    #[inline(always)]
    fn kink_between(&self, low: T, high: T) -> T {
        let middle = T::splat(0.5) * (low + high);
        let (mut nearest, mut distance) = (middle, T::splat(0.5) * (high - low));
        let margin = T::splat(1e-3) * distance;
        distance -= margin;
        for link in &self.links {
            for kink in link.kinks {
                let away = (kink - middle).abs();
                let nearer = away.lt(distance);
                nearest = T::select(nearer, kink, nearest);
                distance = T::select(nearer, away, distance);
            }
        }
        nearest
    }
}

/// A few evaluations suffice; the bound guards against NaN.
const MAX_EVALUATIONS: u32 = 40;
