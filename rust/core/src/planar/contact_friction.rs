//! Friction at obstacles: a fixed point over the normal impulses.
//!
//! Coulomb's law bounds friction at an obstacle by mu times a normal impulse that is itself unknown. The stage is then not
//! an optimisation problem: solutions need not be unique, and with large coefficients none may be found. With fixed bounds
//! it is one, so stages are solved with the bounds of the last solution until the bounds change by no more than the tolerance,
//! as a velocity of the link. Each solve starts from the solution of the one before, and the iterations of all count.
//!
//! The certificate judges with the bounds of the solution itself. A stage whose bounds have not settled counts as
//! unconverged, unless the certificate finds it within `RESIDUAL_LIMIT` tolerances like a solution of the fallback. It
//! keeps its solution where the bounds came close ([`KEPT_CHANGE`]), and is solved without friction at obstacles where they
//! did not.

use crate::math::{Mask, Real, select_into};
use crate::solver::Outcome;

use super::{Newton, Stage, StageSolution};

/// Solves a stage whose contacts have friction, in the given lanes.
#[inline(always)]
pub fn solve_with_contact_friction<T: Real>(
    newton: &mut Newton<T>,
    stage: &mut Stage<T>,
    solution: &mut StageSolution<T>,
    tolerance: f64,
    max_iterations: u32,
    lanes: T::Mask,
) -> Outcome<T> {
    hold_bounds(stage, solution, T::splat(1.0));
    let mut total = newton.solve(stage, solution, tolerance, max_iterations, lanes);
    let mut active = lanes;
    let mut last_change = T::zero();
    for round in 1..MAX_ROUNDS {
        let share = T::splat(if round < UNDAMPED_ROUNDS { 1.0 } else { DAMPED_SHARE });
        let change = hold_bounds(stage, solution, share);
        last_change = T::select(active, change, last_change);
        let left = total.iterations.lt(T::splat(f64::from(max_iterations)));
        let unsettled = active & !change.le(T::splat(tolerance));
        // A lane that runs out of iterations is left with the bounds that it has.
        total.converged = total.converged & (left | !unsettled);
        active = unsettled & left;
        if !active.any() {
            break;
        }
        let outcome = newton.solve(stage, solution, tolerance, max_iterations, active);
        total.iterations += T::select(active, outcome.iterations, T::zero());
        total.converged = (total.converged & !active) | (outcome.converged & active);
    }
    total.converged = total.converged & !active;
    let failed = lanes & !total.converged & !last_change.le(T::splat(KEPT_CHANGE));
    if failed.any() {
        release(stage, solution, failed);
        let outcome = newton.solve(stage, solution, tolerance, max_iterations, failed);
        total.iterations += T::select(failed, outcome.iterations, T::zero());
    }
    total
}

/// Gives up friction at obstacles in the given lanes, and starts anew from the reference velocity: bounds that grow from
/// solve to solve must not leave the robot with velocities that no law limits.
#[inline(always)]
fn release<T: Real>(stage: &mut Stage<T>, solution: &mut StageSolution<T>, lanes: T::Mask) {
    let zero = T::zero();
    for friction in &mut stage.contact_friction {
        friction.bound = T::select(lanes, zero, friction.bound);
    }
    for (u, link) in solution.twist.iter_mut().zip(&stage.links) {
        select_into(u, lanes, &link.reference);
    }
    for impulse in &mut solution.friction {
        (impulse.x, impulse.y) = (T::select(lanes, zero, impulse.x), T::select(lanes, zero, impulse.y));
    }
    let StageSolution { actuator, contact, contact_friction, pair, .. } = solution;
    for impulse in actuator.iter_mut().chain(contact).chain(contact_friction).chain(pair) {
        *impulse = T::select(lanes, zero, *impulse);
    }
}

/// Moves the bounds by a share of the way to those of the present normal impulses; returns the largest way, as a velocity
/// \[m/s\].
#[inline(always)]
fn hold_bounds<T: Real>(stage: &mut Stage<T>, solution: &StageSolution<T>, share: T) -> T {
    let mut largest = T::zero();
    for friction in &mut stage.contact_friction {
        let change = friction.coefficient * solution.contact[friction.contact].max(T::zero()) - friction.bound;
        largest = largest.max(change.abs() / stage.links[friction.link].mass);
        friction.bound += share * change;
    }
    largest
}

/// Solves of one stage at most.
const MAX_ROUNDS: u32 = 60;

/// Change of the bounds up to which the solution of a stage that did not settle is kept \[m/s\]. Many contacts of a straight
/// robot along a wall share its push in no unique way, and what each of them bears wanders by more than the strictest
/// tolerances.
const KEPT_CHANGE: f64 = 1e-4;

/// Solves after which the bounds move by a part of the way only, and that part.
const UNDAMPED_ROUNDS: u32 = 12;
const DAMPED_SHARE: f64 = 0.5;
