//! The augmented Lagrangian iteration: method of multipliers outside, semismooth Newton inside.
//!
//! See `README.md` in this folder for the derivation and the algorithm box.

use crate::math::{Mask, Real};

use super::Outcome;

/// Which branch of a set-valued law is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawForm {
    /// The branch on which the last impulse lay, whatever the present velocity.
    LastBranch,
    /// The branch of the present velocity: the law itself.
    Present,
}

/// A stage whose laws are in proximal form around multipliers: the inner problem of the iteration, with its workspace.
///
/// Every method acts on all lanes; implementations must be `#[inline(always)]`, so that they are compiled for the
/// instruction set of the solve.
pub trait StageProblem<T: Real> {
    const TUNING: Tuning;

    /// Forces and stiffnesses of all laws at the present velocities.
    fn evaluate(&mut self, form: LawForm);

    /// One Newton step in the lanes `active`, shortened by the ray search where it overshoots and `damped` is true;
    /// laws are evaluated at its end.
    fn newton_step(&mut self, active: T::Mask, damped: bool) -> NewtonStep<T>;

    /// How far the velocities are from obeying the laws because the multipliers are not yet the impulses \[m/s\].
    fn multiplier_error(&self) -> T;

    /// The impulses become the multipliers in the given lanes.
    fn recentre(&mut self, lanes: T::Mask);

    /// Multiplies all penalties.
    fn stiffen(&mut self, factor: T);
}

/// A step that has been taken.
#[derive(Debug, Clone, Copy)]
pub struct NewtonStep<T> {
    /// Length of the undamped step as a velocity \[m/s\].
    pub length: T,
    /// Bound on the distance of the step's end to the minimum of the inner problem \[m/s\].
    pub distance: T,
    /// Whether the laws at its end are others than those it was made for, so that its length tells nothing about its end.
    pub changed: bool,
}

/// Tuned constants of the iteration. All are dimensionless; none changes the solution, only the work to find it.
#[derive(Debug, Clone, Copy)]
pub struct Tuning {
    /// Penalty r of sticking and of closed contacts, over the mass of the link.
    pub penalty: f64,
    /// Distance from the inner minimum, over the tolerance, within which the multipliers are checked.
    pub close: f64,
    /// Multipliers move when the distance to the inner minimum is below this times their error: the step after a short
    /// Newton step is quadratically shorter.
    pub inner_accuracy: f64,
    /// Linear solves after which a stage counts as hard.
    pub patience: f64,
    /// `inner_accuracy` of a hard stage: its inner problems are solved well before the multipliers move.
    pub strict_accuracy: f64,
    /// In a hard stage penalties rise tenfold where an outer step leaves more than this share of the error.
    pub slow_gain: f64,
    /// Penalties rise no further beyond this multiple: round-off in the velocities would show in the impulses.
    pub max_stiffening: f64,
    /// A step is damped if the slope at its end exceeds this share of the descent at its start.
    pub overshoot: f64,
}

impl Tuning {
    /// Constants that all models share.
    pub const COMMON: Self = Self {
        penalty: 1e6,
        close: 1e3,
        inner_accuracy: 10.0,
        patience: 20.0,
        strict_accuracy: 0.1,
        slow_gain: 0.25,
        max_stiffening: 50.0,
        overshoot: 0.1,
    };
}

/// Iterates in `lanes` until the velocities are within about `tolerance` \[m/s\], or `max_iterations` linear solves
/// have been made. A lane that has converged keeps its velocities and impulses while others continue.
#[inline(always)]
pub fn solve<T: Real, P: StageProblem<T>>(
    problem: &mut P,
    tolerance: f64,
    max_iterations: u32,
    lanes: T::Mask,
) -> Outcome<T> {
    let (tuning, tolerance) = (P::TUNING, T::splat(tolerance));
    let mut outcome = Outcome { iterations: T::zero(), converged: T::Mask::of(|_| false) };
    let mut active = lanes;
    let mut last_error = T::splat(f64::INFINITY);
    let mut stiffening = T::splat(1.0);
    // Last impulses predict better than velocities which contacts stay closed and which actuators stay at their limit,
    // and Newton's method converges from any start: the first step is taken in full wherever it leads.
    problem.evaluate(LawForm::LastBranch);
    for iteration in 0..max_iterations {
        outcome.iterations += T::select(active, T::splat(1.0), T::zero());
        let NewtonStep { length, distance, changed } = problem.newton_step(active, iteration > 0);
        let hard = T::splat(tuning.patience).lt(outcome.iterations);
        let distance = if changed { distance } else { T::select(hard, distance.min(length), distance) };
        // A step that is not finite ends its lane: it is below no bound.
        active = active & length.lt(T::splat(f64::INFINITY));
        let close = active & distance.le(T::splat(tuning.close) * tolerance);
        if close.any() {
            let error = problem.multiplier_error();
            let converged = close & distance.le(tolerance) & error.le(tolerance);
            outcome.converged = outcome.converged | converged;
            active = active & !converged;
            let accuracy = T::select(hard, T::splat(tuning.strict_accuracy), T::splat(tuning.inner_accuracy));
            let minimised = active & close & distance.le(tolerance.max(accuracy * error));
            if minimised.any() {
                let slow = minimised & hard & (T::splat(tuning.slow_gain) * last_error).lt(error);
                let stiffened = slow & stiffening.lt(T::splat(tuning.max_stiffening));
                let factor = T::select(stiffened, T::splat(10.0), T::splat(1.0));
                stiffening = stiffening * factor;
                problem.stiffen(factor);
                last_error = T::select(minimised, error, last_error);
                problem.recentre(minimised);
                problem.evaluate(LawForm::Present);
            }
        }
        if !active.any() {
            break;
        }
    }
    outcome
}
