//! Fallback for a stage that the lanes' Newton iteration did not solve: the coupled Newton iteration from there, a sequence
//! of convex problems, the coupled iteration by continuation from soft contacts, then the strict variant of the lanes'
//! method from free motion; where the contacts contradict each other, the stage is relaxed. Of all that is found, the
//! solution with the least certified residual is kept.

use nalgebra::{Vector2, Vector3};

use crate::solver::{CoupledStage, SolveStatus};
use crate::spatial::rest::{RestCandidate, bound, fastest};
use crate::spatial::{Spatial, Stage, StageLink, StageSolution, Twist, certify};
use crate::stepping::Model;

use super::lagged::Lag;
use super::{CoulombNewton, Newton};

/// Workspace of the fallback, for one robot.
pub struct Fallback {
    attempt: Attempt,
    relaxed: Stage,
    relaxed_solution: StageSolution,
}

struct Attempt {
    coulomb: CoulombNewton,
    strict: Newton,
    trial: StageSolution,
    /// The best solution found and its residual.
    best: StageSolution,
    residual: f64,
    rest: RestCandidate,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        let attempt = Attempt {
            coulomb: CoulombNewton::new(links),
            strict: Newton::strict(links),
            trial: StageSolution::new(links),
            best: StageSolution::new(links),
            residual: f64::INFINITY,
            rest: RestCandidate::new(links),
        };
        Self { attempt, relaxed: Stage::with_capacity(links), relaxed_solution: StageSolution::new(links) }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may
    /// hold the result of another solver or anything else, NaN included. Neither a method nor a convex problem begins
    /// after `most` linear solves, the number of which is also returned.
    pub fn solve_hard(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        most: u32,
    ) -> (u32, SolveStatus) {
        let limit = Spatial::RESIDUAL_FACTOR * tolerance;
        let (solves, residual) = self.attempt.close(stage, solution, tolerance, most);
        let mut offsets =
            stage.contacts.iter().map(|contact| contact.offset).chain(stage.pairs.iter().map(|pair| pair.offset));
        let may_contradict = residual > limit.max(CONTRADICTION) && offsets.any(|offset| offset < 0.0);
        if !may_contradict {
            return (solves, if residual <= limit { SolveStatus::Solved } else { SolveStatus::Unsolved });
        }
        self.relaxed.copy_from(stage);
        let Stage { contacts, pairs, .. } = &mut self.relaxed;
        let offsets =
            contacts.iter_mut().map(|contact| &mut contact.offset).chain(pairs.iter_mut().map(|pair| &mut pair.offset));
        offsets.for_each(|offset| *offset = offset.max(0.0));
        self.relaxed_solution.copy_from(solution);
        let (more, of_relaxed) =
            self.attempt.close(&self.relaxed, &mut self.relaxed_solution, tolerance, most.saturating_sub(solves));
        if of_relaxed > limit {
            return (solves + more, SolveStatus::Unsolved);
        }
        solution.copy_from(&self.relaxed_solution);
        (solves + more, SolveStatus::Relaxed)
    }
}

/// Continues from the trial to a tolerance; is told how many linear solves are left, and returns how many it took.
type Method = fn(&mut Attempt, &Stage, f64, u32) -> u32;

impl Attempt {
    /// Tries one method after the other until the residual is well within the tolerance, and keeps the best solution in
    /// `solution`. Returns the solves and its residual, infinite if it is not a number.
    fn close(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64, most: u32) -> (u32, f64) {
        // With the residual over the tolerance that is enough.
        let methods: [(Method, f64); 4] = [
            (Self::near_the_lanes, ENOUGH),
            (Self::by_convex_problems, 1.0),
            (Self::by_continuation, 1.0),
            (Self::strictly, 1.0),
        ];
        self.best.copy_from(solution);
        self.residual = residual(stage, solution);
        let (mut solves, is_done) = self.at_rest(stage, tolerance, most);
        for (method, enough) in methods {
            if is_done || solves >= most {
                break;
            }
            self.trial.copy_from(&self.best);
            if self.residual.is_infinite() {
                self.start_from_free_motion(stage);
            }
            solves += method(self, stage, tolerance, most - solves);
            self.keep_if_better(stage);
            if self.residual <= enough * tolerance {
                break;
            }
        }
        solution.copy_from(&self.best);
        (solves, self.residual)
    }

    fn keep_if_better(&mut self, stage: &Stage) {
        let reached = residual(stage, &self.trial);
        if reached < self.residual {
            self.residual = reached;
            self.best.copy_from(&self.trial);
        }
    }

    /// Friction that does not lag at all, whose solution is rest where the contacts can hold the robot: the robot stands
    /// once it is held within the [bound](rest::bound) that keeps it at rest from then on. Returns the linear solves and
    /// whether the stage is solved.
    fn at_rest(&mut self, stage: &Stage, tolerance: f64, most: u32) -> (u32, bool) {
        let Self { coulomb, trial, best, residual: least, rest, .. } = self;
        if most == 0 || least.is_infinite() || fastest(stage, best) > SLOW {
            return (0, false);
        }
        trial.copy_from(best);
        let (bound, mut left) = (bound(stage, tolerance), f64::INFINITY);
        let solves = coulomb.lag(stage, trial, bound, most, Lag::None, |solution| {
            let before = std::mem::replace(&mut left, rest.residual(stage, solution));
            left <= bound || left > GAIN * before
        });
        let stands = left <= bound;
        if stands {
            rest.write(true, best);
            *least = left;
        } else {
            self.keep_if_better(stage);
        }
        (solves, stands || self.residual <= ENOUGH * tolerance)
    }

    /// Newton's method on the coupled problem from what the lanes left.
    fn near_the_lanes(&mut self, stage: &Stage, tolerance: f64, _: u32) -> u32 {
        self.coulomb.solve(stage, &mut self.trial, tolerance).0
    }

    /// Convex problems with friction that lags, from what is best so far.
    fn by_convex_problems(&mut self, stage: &Stage, tolerance: f64, most: u32) -> u32 {
        let Self { coulomb, trial, best, residual: least, .. } = self;
        coulomb.lag(stage, trial, tolerance, most, Lag::Follows, |solution| {
            let reached = residual(stage, solution);
            if reached < *least {
                *least = reached;
                best.copy_from(solution);
            }
            *least <= ENOUGH * tolerance
        })
    }

    /// The same along the path of solutions from soft contacts.
    fn by_continuation(&mut self, stage: &Stage, tolerance: f64, most: u32) -> u32 {
        self.start_from_free_motion(stage);
        self.coulomb.continuation(stage, &mut self.trial, tolerance, most).0
    }

    /// The lanes' method from free motion, radii moving only when the convex problem is solved.
    fn strictly(&mut self, stage: &Stage, tolerance: f64, most: u32) -> u32 {
        self.start_from_free_motion(stage);
        self.strict.solve_one(stage, &mut self.trial, tolerance, most.min(MAX_ITERATIONS)).iterations as u32
    }

    /// Free motion without impulses.
    fn start_from_free_motion(&mut self, stage: &Stage) {
        let StageSolution { twist, surface, normal, friction, rolling, gear, contact, obstacle_friction, pair, .. } =
            &mut self.trial;
        for (twist, link) in twist.iter_mut().zip(&stage.links) {
            *twist = free_twist(link);
        }
        surface.fill(Vector3::zeros());
        normal.fill([0.0; 2]);
        friction.fill([Vector2::zeros(); 2]);
        rolling.fill(Vector2::zeros());
        gear.fill(0.0);
        contact.fill(0.0);
        obstacle_friction.fill(Vector2::zeros());
        pair.fill(0.0);
    }
}

/// Certified; infinite for one that is not a number.
fn residual(stage: &Stage, solution: &StageSolution) -> f64 {
    let residual = certify(stage, solution).residual();
    if residual.is_nan() { f64::INFINITY } else { residual }
}

/// M^-1 p.
fn free_twist(link: &StageLink) -> Twist {
    let (z, l) = (&link.axes[2], &link.momentum.angular);
    let spin = z.dot(l);
    Twist {
        linear: link.momentum.linear / link.mass,
        angular: (l - z * spin) / link.inertia + z * (spin / link.roll_inertia),
    }
}

/// Residual over the tolerance with which nothing better is looked for: what is left of the forces at rest makes a robot
/// creep, ten times as fast as the residual at many contacts close to slipping.
const ENOUGH: f64 = 0.1;

/// Speed up to which rest is tried \[m/s\], and by which part of itself what is left of the forces must fall in a problem.
const SLOW: f64 = 1e-2;
const GAIN: f64 = 0.9;

/// Residual from which on contacts may contradict each other \[m/s\].
const CONTRADICTION: f64 = 1e-4;

/// Newton steps of one attempt.
const MAX_ITERATIONS: u32 = 1000;
