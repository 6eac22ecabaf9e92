//! The line search: a zero of the inner function's slope along start + alpha step.

use crate::math::{Mask, Real};

use super::newton::Newton;

impl<T: Real> Newton<T> {
    /// First and generalised second derivative of the inner function by alpha, of a strongly convex,
    /// piecewise smooth function \[J\]; `inertia` is the quadratic part, [`Newton::inertia_along`].
    #[inline(always)]
    fn derivatives(&self, inertia: [T; 2], alpha: T) -> (T, T) {
        let (mut slope, mut curvature) = (inertia[0] + alpha * inertia[1], inertia[1]);
        let mut add = |(first, second): (T, T)| {
            slope += first;
            curvature += second;
        };
        let (mut omega, mut change) = (T::zero(), T::zero());
        for link in &self.links {
            add(link.friction.along(&link.start, &link.step, alpha));
            add(link.drive.along(link.start.z - omega, link.step.z - change, alpha));
            (omega, change) = (link.start.z, link.step.z);
        }
        for contact in &self.contacts {
            let link = &self.links[contact.link];
            add(contact.along(&link.start, &link.step, alpha));
        }
        (slope, curvature)
    }

    /// Slope of |u - u_ref|_M^2 / 2 at alpha = 0, and its constant rise.
    #[inline(always)]
    fn inertia_along(&self) -> [T; 2] {
        let (mut slope, mut rise) = (T::zero(), T::zero());
        for link in &self.links {
            let (u, du, reference) = (&link.start, &link.step, &link.reference);
            let (px, py, pz) = (link.mass * du.x, link.mass * du.y, link.inertia * du.z);
            slope += px * (u.x - reference.x) + py * (u.y - reference.y) + pz * (u.z - reference.z);
            rise += px * du.x + py * du.y + pz * du.z;
        }
        [slope, rise]
    }

    /// A zero of the slope on (0, 1), up to `accuracy` \[J\], in the given lanes. Where the slope at 1 is
    /// not positive it is 1.
    ///
    /// Newton's method from the end, which crosses a stiff contact or a stuck link in one step, kept within
    /// a bracket. Where it leaves the bracket it is replaced by the kink nearest to the bracket's middle,
    /// since the zero often lies in one: where a link comes to rest the slope all but jumps.
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
            link.kink = link.friction.kink(&link.start, &link.step);
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
            let away = (link.kink - middle).abs();
            let nearer = away.lt(distance);
            nearest = T::select(nearer, link.kink, nearest);
            distance = T::select(nearer, away, distance);
        }
        nearest
    }
}

/// A few evaluations suffice; the bound guards against NaN.
const MAX_EVALUATIONS: u32 = 40;
