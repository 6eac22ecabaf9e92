//! The exact line search: a zero of the slope of a convex function along a ray.

use crate::math::{Kernel, Mask, Real};

/// A strongly convex, piecewise smooth function \[J\] along a step, alpha = 0 at its start and 1 at its end.
/// Implementations must be `#[inline(always)]`, so that they are compiled for the instruction set of the search.
pub trait Ray<T: Real> {
    /// First and generalised second derivative by alpha.
    fn derivatives(&self, alpha: T) -> (T, T);

    /// Passes `nearest` alphas at which the slope bends or nearly jumps; those that it leaves out cost evaluations.
    #[inline(always)]
    fn visit_kinks(&self, _nearest: &mut NearestKink<T>) {}
}

/// Adds the first and second derivative of one law to those of the sum.
#[inline(always)]
pub fn add<T: Real>(sum: &mut (T, T), (first, second): (T, T)) {
    sum.0 += first;
    sum.1 += second;
}

/// How much of the step to take in the given lanes, and in which of them less than all of it: where the slope at its
/// end exceeds `accuracy` \[J\], up to where it is zero within `accuracy`.
///
/// Newton's method from the end, which crosses a stiff contact or a stuck link in one step, kept within a bracket.
/// Where it leaves the bracket it is replaced by the kink nearest to the bracket's middle, since the zero often lies in
/// one: where a contact comes to rest the slope nearly jumps.
#[inline(always)]
pub fn step_length<T: Real>(function: &impl Ray<T>, accuracy: T, lanes: T::Mask) -> (T, T::Mask) {
    let (mut low, mut high) = (T::zero(), T::splat(1.0));
    let mut alpha = high;
    let (mut here, mut curvature) = function.derivatives(alpha);
    let overshoots = lanes & accuracy.lt(here);
    let mut searching = overshoots;
    for _ in 0..MAX_EVALUATIONS {
        let beyond = T::zero().lt(here);
        low = T::select(beyond, low, alpha);
        high = T::select(beyond, alpha, high);
        searching = searching & low.lt(high);
        if !searching.any() {
            break;
        }
        let newton = alpha - here / curvature;
        let inside = low.lt(newton) & newton.lt(high);
        let next = if (searching & !inside).any() {
            T::select(inside, newton, kink_between(function, low, high))
        } else {
            newton
        };
        alpha = T::select(searching, next, alpha);
        (here, curvature) = function.derivatives(alpha);
        searching = searching & accuracy.lt(here.abs());
    }
    (alpha, overshoots)
}

/// [`step_length`] of what `function` makes, as a function of its own: apart from the code of steps that do not
/// overshoot.
pub struct Search<F, T: Real> {
    pub function: F,
    pub accuracy: T,
    pub lanes: T::Mask,
}

impl<T: Real, R: Ray<T>, F: FnOnce() -> R> Kernel for Search<F, T> {
    type Output = (T, T::Mask);

    #[inline(always)]
    fn run(self) -> (T, T::Mask) {
        step_length(&(self.function)(), self.accuracy, self.lanes)
    }
}

/// The kink nearest to the middle of the bracket, or the middle if no kink lies inside.
#[inline(always)]
fn kink_between<T: Real>(function: &impl Ray<T>, low: T, high: T) -> T {
    let middle = T::splat(0.5) * (low + high);
    let distance = T::splat(0.5) * (high - low);
    let mut nearest = NearestKink { middle, kink: middle, distance: distance - T::splat(1e-3) * distance };
    function.visit_kinks(&mut nearest);
    nearest.kink
}

/// The kink nearest to the middle of a bracket among those seen so far.
#[derive(Debug, Clone, Copy)]
pub struct NearestKink<T> {
    middle: T,
    kink: T,
    distance: T,
}

impl<T: Real> NearestKink<T> {
    /// Considers one more kink; NaN is ignored.
    #[inline(always)]
    pub fn consider(&mut self, kink: T) {
        let away = (kink - self.middle).abs();
        let nearer = away.lt(self.distance);
        self.kink = T::select(nearer, kink, self.kink);
        self.distance = T::select(nearer, away, self.distance);
    }
}

/// A few evaluations suffice; the bound guards against NaN.
const MAX_EVALUATIONS: u32 = 40;
