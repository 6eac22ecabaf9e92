//! Fallback for a stage with friction at contacts, which is no optimisation problem: the coupled Newton iteration from
//! what the lanes left, from free motion, from the solution without friction at contacts, and from there along paths on
//! which it grows.

use crate::contact::{LINK_CONTACTS_PER_LINK, PAIRS_PER_LINK};
use crate::planar::{Stage, StageSolution, certify};
use crate::solver::{CoupledStage, residual_limit};

use super::coulomb_newton::CoulombNewton;
use super::coulomb_path::CoulombPath;
use super::fallback::ConvexFallback;

/// Workspace of the fallback, for one robot.
pub(super) struct CoulombFallback {
    newton: CoulombNewton,
    path: CoulombPath,
    trial: StageSolution,
    /// The stage without friction at contacts, and its solution.
    smooth: Stage,
    smooth_solution: StageSolution,
}

impl CoulombFallback {
    pub fn new(links: usize) -> Self {
        let unknowns = (4 + 2 * PAIRS_PER_LINK + 2 * LINK_CONTACTS_PER_LINK) * links + 2;
        Self {
            newton: CoulombNewton::new(links),
            path: CoulombPath::new(unknowns),
            trial: StageSolution::new(links),
            smooth: Stage::with_capacity(links),
            smooth_solution: StageSolution::new(links),
        }
    }

    /// Tries one method after the other and keeps the best solution in `solution`. Returns linear solves and whether the
    /// certificate accepts it.
    pub fn close(
        &mut self,
        convex: &mut ConvexFallback,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        attempts: u32,
    ) -> (u32, bool) {
        let (limit, mut solves) = (residual_limit(tolerance), 0);
        let mut best = residual(stage, solution);
        for attempt in 0..attempts {
            solution.copy_lane(stage, 0, &mut self.trial);
            solves += match attempt {
                0 => self.near_the_lanes(stage, tolerance),
                1 => self.in_free_motion(stage, tolerance),
                2 => self.without_friction(convex, stage, tolerance),
                _ => self.along_a_path(stage, tolerance, attempt - 3),
            };
            let reached = residual(stage, &self.trial);
            if reached < best {
                best = reached;
                self.trial.copy_lane(stage, 0, solution);
            }
            if best <= limit {
                break;
            }
        }
        (solves, best <= limit)
    }

    /// The same from free motion, at first by the method of the lanes.
    pub fn start_again(
        &mut self,
        convex: &mut ConvexFallback,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
    ) -> (u32, bool) {
        start_from_free_motion(stage, solution);
        let solves = convex.as_in_lanes(stage, solution, tolerance);
        let (more, closed) = self.close(convex, stage, solution, tolerance, ATTEMPTS);
        (solves + more, closed)
    }

    fn near_the_lanes(&mut self, stage: &Stage, tolerance: f64) -> u32 {
        self.newton.solve(stage, &mut self.trial, tolerance).0
    }

    fn in_free_motion(&mut self, stage: &Stage, tolerance: f64) -> u32 {
        start_from_free_motion(stage, &mut self.trial);
        self.near_the_lanes(stage, tolerance)
    }

    /// From the solution without friction at contacts.
    fn without_friction(&mut self, convex: &mut ConvexFallback, stage: &Stage, tolerance: f64) -> u32 {
        let Self { trial, smooth, smooth_solution: start, .. } = self;
        stage.copy_lane(0, smooth);
        trial.copy_lane(stage, 0, start);
        let (solves, closed) = convex.without_friction(smooth, start, tolerance);
        if !closed {
            start_from_free_motion(stage, start);
        }
        start.copy_lane(stage, 0, trial);
        solves + self.near_the_lanes(stage, tolerance)
    }

    fn along_a_path(&mut self, stage: &Stage, tolerance: f64, number: u32) -> u32 {
        self.smooth_solution.copy_lane(stage, 0, &mut self.trial);
        self.newton.follow(&mut self.path, number, stage, &mut self.trial, tolerance).0
    }
}

/// The reference velocity without impulses.
fn start_from_free_motion(stage: &Stage, solution: &mut StageSolution) {
    let StageSolution {
        twist, friction, spin, actuator, gear, contact, obstacle_friction, pair, pair_friction, ..
    } = solution;
    for (twist, link) in twist.iter_mut().zip(&stage.links) {
        *twist = link.reference;
    }
    friction.iter_mut().for_each(|impulse| impulse.fill(0.0));
    for impulses in [spin, actuator, gear, contact, obstacle_friction, pair, pair_friction] {
        impulses.fill(0.0);
    }
}

/// Infinite where it is not a number \[m/s\].
fn residual(stage: &Stage, solution: &StageSolution) -> f64 {
    let residual = certify(stage, solution).residual();
    if residual.is_nan() { f64::INFINITY } else { residual }
}

/// Attempts without paths, and with six of these.
pub(super) const WITHOUT_PATHS: u32 = 3;
pub(super) const ATTEMPTS: u32 = WITHOUT_PATHS + 6;
