//! The line search: a zero of the convex function's slope along start + alpha step.

use crate::math::{Mask, Real};

use super::newton::Newton;

impl<T: Real> Newton<T> {
    /// First and generalised second derivative of the function by alpha, of a strongly convex,
    /// piecewise smooth function \[J\]; `inertia` is the quadratic part, [`Newton::inertia_along`].
    #[inline(always)]
    fn derivatives(&self, inertia: [T; 2], alpha: T) -> (T, T) {
        let (mut slope, mut curvature) = (inertia[0] + alpha * inertia[1], inertia[1]);
        for link in &self.links {
            let ray = &link.ray;
            for (i, end) in link.ends.iter().enumerate() {
                add(&mut slope, &mut curvature, end.normal.along(ray.closing[i], ray.closing_change[i], alpha));
                add(&mut slope, &mut curvature, end.friction.along(&ray.slip[i], &ray.slip_change[i], alpha));
            }
            add(&mut slope, &mut curvature, link.rolling.along(&ray.rolling, &ray.rolling_change, alpha));
            for axis in 0..2 {
                let drive = link.drives[axis].along(link.start_rates[axis], link.step_rates[axis], alpha);
                add(&mut slope, &mut curvature, drive);
            }
        }
        for peg in &self.pegs {
            let link = &self.links[peg.link];
            let contact = peg.contact.along(peg.direction.dot(&link.start), peg.direction.dot(&link.step), alpha);
            add(&mut slope, &mut curvature, contact);
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

    /// How much of the step to take in the given lanes, and in which of them less than all of it: where the slope at its
    /// end exceeds `accuracy` \[J\], up to where it is zero within `accuracy`.
    ///
    /// Newton's method from the end, which crosses a stiff contact or a stuck link in one step, kept within
    /// a bracket. Where it leaves the bracket it is replaced by the kink nearest to the bracket's middle,
    /// since the zero often lies in one: where a contact comes to rest the slope all but jumps.
    #[inline(always)]
    pub(super) fn step_length(&self, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
        let inertia = self.inertia_along();
        let (mut low, mut high) = (T::zero(), T::splat(1.0));
        let mut alpha = high;
        let (mut here, mut curvature) = self.derivatives(inertia, alpha);
        let overshoots = lanes & accuracy.lt(here);
        let mut searching = overshoots;
        for _ in 1..MAX_EVALUATIONS {
            let beyond = T::zero().lt(here);
            low = T::select(beyond, low, alpha);
            high = T::select(beyond, alpha, high);
            searching = searching & low.lt(high);
            if !searching.any() {
                break;
            }
            let newton = alpha - here / curvature;
            let inside = low.lt(newton) & newton.lt(high);
            let next = if (searching & !inside).any() { self.kink_between(low, high) } else { newton };
            alpha = T::select(searching, T::select(inside, newton, next), alpha);
            (here, curvature) = self.derivatives(inertia, alpha);
            searching = searching & accuracy.lt(here.abs());
        }
        (alpha, overshoots)
    }

    /// The kink nearest to the middle of the bracket, or the middle if no kink lies inside.
    #[inline(always)]
    fn kink_between(&self, low: T, high: T) -> T {
        let middle = T::splat(0.5) * (low + high);
        let (mut nearest, mut distance) = (middle, T::splat(0.5) * (high - low));
        let margin = T::splat(1e-3) * distance;
        distance -= margin;
        for link in &self.links {
            for (i, end) in link.ends.iter().enumerate() {
                let kink = end.friction.kink(&link.ray.slip[i], &link.ray.slip_change[i]);
                let away = (kink - middle).abs();
                let nearer = away.lt(distance);
                nearest = T::select(nearer, kink, nearest);
                distance = T::select(nearer, away, distance);
            }
        }
        nearest
    }
}

#[inline(always)]
fn add<T: Real>(slope: &mut T, curvature: &mut T, (first, second): (T, T)) {
    *slope += first;
    *curvature += second;
}

/// A few evaluations suffice; the bound guards against NaN.
const MAX_EVALUATIONS: u32 = 40;
