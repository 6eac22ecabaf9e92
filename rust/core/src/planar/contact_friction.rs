//! Friction at contacts in a solve.
//!
//! Coulomb's law bounds friction at an obstacle or between links by mu times a normal impulse that is itself unknown. The
//! stage is then not an optimisation problem, and solutions need not be unique. With fixed bounds it is one. The Newton steps
//! follow the law as it stands for a while, then hold the bounds, and so on.
//!
//! The certificate judges with the bounds of the solution itself. A stage whose bounds have not settled goes to the
//! fallback. It keeps its solution where the bounds came close ([`KEPT_CHANGE`]), and is solved without friction at
//! contacts where they did not: the fallback starts from there, and a robot whose budget for it is spent keeps that.

use nalgebra::Vector2;

use crate::math::{Mask, Real, select_into};
use crate::rows::FrictionRow;
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
    set_bounds(&mut stage.obstacle_friction, &solution.contact);
    set_bounds(&mut stage.pair_friction, &solution.pair);
    let mut outcome = newton.solve(stage, solution, tolerance, max_iterations, lanes);
    let failed = lanes & !outcome.converged & !newton.bound_error().le(T::splat(KEPT_CHANGE));
    if failed.any() {
        release(stage, solution, failed);
        let released = newton.solve_with_held_bounds(stage, solution, tolerance, max_iterations, failed);
        outcome.iterations += T::select(failed, released.iterations, T::zero());
    }
    outcome
}

/// Gives up friction at contacts in the given lanes, and starts anew from the reference velocity: bounds that grow from
/// solve to solve must not leave the robot with velocities that no law limits.
#[inline(always)]
fn release<T: Real>(stage: &mut Stage<T>, solution: &mut StageSolution<T>, lanes: T::Mask) {
    let zero = T::zero();
    let Stage { obstacle_friction, pair_friction, .. } = stage;
    let bounds = obstacle_friction.iter_mut().map(|row| &mut row.bound);
    for bound in bounds.chain(pair_friction.iter_mut().map(|row| &mut row.bound)) {
        *bound = T::select(lanes, zero, *bound);
    }
    for (u, link) in solution.twist.iter_mut().zip(&stage.links) {
        select_into(u, lanes, &link.reference);
    }
    for impulse in &mut solution.friction {
        select_into(impulse, lanes, &Vector2::new(zero, zero));
    }
    let StageSolution { spin, actuator, stop, contact, obstacle_friction, pair, pair_friction, .. } = solution;
    for impulse in spin
        .iter_mut()
        .chain(actuator)
        .chain(stop.as_flattened_mut())
        .chain(contact)
        .chain(obstacle_friction)
        .chain(pair)
        .chain(pair_friction)
    {
        *impulse = T::select(lanes, zero, *impulse);
    }
}

/// Takes the bounds of the normal impulses with which the solver starts.
#[inline(always)]
fn set_bounds<R, T: Real>(rows: &mut [FrictionRow<R, T>], normal: &[T]) {
    for row in rows {
        row.bound = row.coefficient * normal[row.normal].max(T::zero());
    }
}

/// Change of the bounds up to which the solution of a stage that did not settle is kept \[m/s\]. Many contacts of a straight
/// robot along a wall share its push in no unique way, and what each of them bears wanders by more than the strictest
/// tolerances.
const KEPT_CHANGE: f64 = 1e-4;
