//! Fallback for a stage that Newton's method did not solve: another method, a polish and, where the contacts
//! contradict each other or wedge the robot, a relaxed stage. With friction at contacts the other methods are those of
//! [`coulomb_fallback`](super::coulomb_fallback).

use nalgebra::Vector2;

use crate::planar::{Stage, StageSolution, certify};
use crate::rows::{demanded_speed, relax};
use crate::solver::{EXACT, STRAIN, SolveStatus, greatest_impulse, residual_limit};

use super::coulomb_fallback::{ATTEMPTS, CoulombFallback, WITHOUT_PATHS};
use super::{InteriorPoint, Newton};

/// Workspace of the fallback, for one robot.
pub struct Fallback {
    convex: ConvexFallback,
    coulomb: CoulombFallback,
    relaxed: Stage,
    /// The best solution found and its residual.
    best: StageSolution,
    residual: f64,
}

pub(super) struct ConvexFallback {
    interior_point: InteriorPoint,
    newton: Newton,
    /// The stage with the ellipses of the sides on which its forces lie.
    on_sides: Stage,
    polished: StageSolution,
    /// Energies of the original stage \[J\].
    energy: f64,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        let convex = ConvexFallback {
            interior_point: InteriorPoint::new(links),
            newton: Newton::new(links),
            on_sides: Stage::with_capacity(links),
            polished: StageSolution::new(links),
            energy: 0.0,
        };
        Self {
            convex,
            coulomb: CoulombFallback::new(links),
            relaxed: Stage::with_capacity(links),
            best: StageSolution::new(links),
            residual: f64::INFINITY,
        }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may
    /// hold the result of another solver or anything else, NaN included; where no method solves the stage, the best is kept of
    /// that and of all that is found. Also returns the number of linear solves.
    pub fn solve_hard(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, SolveStatus) {
        self.solve(stage, solution, tolerance, false)
    }

    /// The same; where it is `brief`, a stage with penetrations is relaxed after fewer methods.
    pub(crate) fn solve(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        brief: bool,
    ) -> (u32, SolveStatus) {
        self.begin(stage, solution);
        let (is_convex, demand) = (stage.is_convex(), demanded_speed(&stage.contacts, &stage.pairs));
        let (mut solves, closed) = if is_convex {
            self.convex.close(stage, solution, tolerance)
        } else {
            let attempts = if brief && demand > 0.0 { WITHOUT_PATHS } else { ATTEMPTS };
            self.coulomb.close(&mut self.convex, stage, solution, tolerance, attempts)
        };
        self.keep_if_better(stage, solution);
        let impulse = greatest_impulse(&solution.contact, &solution.pair);
        let may_be_wedged = !is_convex && demand > EXACT && impulse > STRAIN * stage.mass() * demand;
        if closed && !(may_be_wedged && self.residual > EXACT) {
            return (solves, SolveStatus::Solved);
        }
        if demand > 0.0 && self.residual > EXACT {
            self.relax(stage);
            let (more, eased) = if is_convex {
                self.convex.start_again(&self.relaxed, solution, tolerance)
            } else {
                self.coulomb.start_again(&mut self.convex, &self.relaxed, solution, tolerance)
            };
            solves += more;
            if eased && (!closed || impulse > STRAIN * greatest_impulse(&solution.contact, &solution.pair)) {
                let is_accurate = !is_convex && certify(stage, solution).residual() <= residual_limit(tolerance);
                return (solves, if is_accurate { SolveStatus::Solved } else { SolveStatus::Relaxed });
            }
            self.keep_if_better(stage, solution);
        }
        if !(closed || is_convex) {
            solves += self.calm(stage, solution, tolerance);
        }
        self.best.copy_lane(stage, 0, solution);
        (solves, if closed { SolveStatus::Solved } else { SolveStatus::Unsolved })
    }

    /// For a step that is out of solves: replaces `solution` by that of the optimisation problem without recovery of
    /// penetrations and without friction at contacts, where the certificate finds that better. Its contacts give the robot no
    /// energy, unlike what a method has left on its way.
    pub fn end_calmly(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, SolveStatus) {
        self.begin(stage, solution);
        let solves = self.calm(stage, solution, tolerance);
        self.best.copy_lane(stage, 0, solution);
        let limit = if stage.is_convex() { tolerance } else { residual_limit(tolerance) };
        (solves, if self.residual <= limit { SolveStatus::Solved } else { SolveStatus::Unsolved })
    }

    fn calm(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> u32 {
        self.relax(stage);
        let (solves, _) = self.convex.without_friction(&mut self.relaxed, solution, tolerance);
        self.keep_if_better(stage, solution);
        solves
    }

    /// The relaxed stage is that of `stage`.
    fn relax(&mut self, stage: &Stage) {
        stage.copy_lane(0, &mut self.relaxed);
        relax(&mut self.relaxed.contacts, &mut self.relaxed.pairs);
    }

    /// Begins a stage, of which nothing is known but `solution`.
    fn begin(&mut self, stage: &Stage, solution: &StageSolution) {
        self.convex.energy = stage.energy();
        self.residual = f64::INFINITY;
        self.keep_if_better(stage, solution);
    }

    fn keep_if_better(&mut self, stage: &Stage, solution: &StageSolution) {
        let reached = certify(stage, solution).residual();
        // The first is kept whatever it is.
        if reached < self.residual || self.residual.is_infinite() {
            solution.copy_lane(stage, 0, &mut self.best);
            self.residual = if reached.is_nan() { f64::INFINITY } else { reached };
        }
    }
}

impl ConvexFallback {
    /// The polish, and where it fails the interior point method.
    fn close(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        let (solves, closed) = self.polish(stage, solution, tolerance);
        if closed {
            return (solves, true);
        }
        let (more, closed) = self.start_again(stage, solution, tolerance);
        (solves + more, closed)
    }

    /// The interior point method from the reference velocity, polished. Returns linear solves and whether that
    /// solved the stage.
    pub fn start_again(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        for (twist, link) in solution.twist.iter_mut().zip(&stage.links) {
            *twist = link.reference;
        }
        if stage.skin.is_none() {
            let descent = self.interior_point.solve(stage, solution, tolerance);
            let (solves, closed) = self.polish(stage, solution, tolerance);
            return (descent.solves + solves, closed);
        }
        solution.friction.fill(Vector2::zeros());
        let mut solves = 0;
        for _ in 0..MAX_SIDES {
            stage.copy_lane(0, &mut self.on_sides);
            self.on_sides.take_sides(solution);
            solves += self.interior_point.solve(&self.on_sides, solution, tolerance).solves;
            let (more, closed) = self.polish(stage, solution, tolerance);
            solves += more;
            if closed {
                return (solves, true);
            }
        }
        (solves, false)
    }

    /// Takes friction from the contacts of `stage`, which makes it an optimisation problem, and solves that from the
    /// reference velocity; those impulses are zero in `solution`. Returns linear solves and whether that solved it.
    pub fn without_friction(&mut self, stage: &mut Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        let rubbing = [stage.obstacle_friction.len(), stage.pair_friction.len()];
        stage.obstacle_friction.clear();
        stage.pair_friction.clear();
        solution.obstacle_friction.clear();
        solution.pair_friction.clear();
        let found = self.start_again(stage, solution, tolerance);
        solution.obstacle_friction.resize(rubbing[0], 0.0);
        solution.pair_friction.resize(rubbing[1], 0.0);
        found
    }

    /// The method of the lanes. Returns linear solves.
    pub fn as_in_lanes(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> u32 {
        self.newton.solve_one(stage, solution, tolerance, AS_IN_LANES).iterations as u32
    }

    /// Newton's method from near a solution that is not good enough, to a stricter tolerance; keeps the better of both.
    fn polish(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        let (before, residual) = self.merit(stage, solution, tolerance);
        if before.max(residual) <= 1.0 || !before.is_finite() {
            return (0, before <= 1.0);
        }
        solution.copy_lane(stage, 0, &mut self.polished);
        let outcome = self.newton.solve_one(stage, &mut self.polished, POLISH * tolerance, MAX_POLISH);
        let (after, polished_residual) = self.merit(stage, &self.polished, tolerance);
        if (after.max(1.0), polished_residual) < (before.max(1.0), residual) {
            self.polished.copy_lane(stage, 0, solution);
        }
        (outcome.iterations as u32, before.min(after) <= 1.0)
    }

    /// At most 1 for a solution that is good enough: each law obeyed nearly, and all together by the duality gap. And
    /// the residual in tolerances.
    fn merit(&self, stage: &Stage, solution: &StageSolution, tolerance: f64) -> (f64, f64) {
        let certificate = certify(stage, solution);
        let enough = (0.5 * stage.lightest_mass() * tolerance * tolerance).max(ACCEPTED_GAP * self.energy);
        let residual = certificate.residual() / tolerance;
        // Impulses of a jam may be so large that even a small residual leaves more than the required gap.
        let merit =
            (certificate.gap / enough).min(10.0 * residual).max(residual * tolerance / residual_limit(tolerance));
        let is_number = !certificate.gap.is_nan() && !residual.is_nan();
        (if is_number { merit } else { f64::INFINITY }, residual)
    }
}

/// Tolerance of a polish, in tolerances, and its Newton steps.
const POLISH: f64 = 0.01;
const MAX_POLISH: u32 = 50;

/// Iterations of the method of the lanes from free motion.
const AS_IN_LANES: u32 = 100;

/// Times the ellipses of a skin follow the sides of the forces in the interior point method.
const MAX_SIDES: u32 = 8;

/// Duality gap of a solved stage, relative to the stage's energies.
const ACCEPTED_GAP: f64 = 1e-10;
