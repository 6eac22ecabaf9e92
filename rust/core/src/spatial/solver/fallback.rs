//! Fallback for a stage that the lanes' Newton iteration did not solve: the coupled Newton iteration from there and by
//! continuation from soft contacts, then the strict variant of the lanes' method from free motion; where the contacts
//! contradict each other, the stage is relaxed. `docs/notes/fallback.md` counts which method solves how many stages.

use nalgebra::Vector2;

use crate::solver::{CoupledStage, SolveStatus, residual_limit};
use crate::spatial::{Stage, StageLink, StageSolution, Twist, certify};

use super::{CoulombNewton, Newton};

/// Workspace of the fallback, for one robot.
#[derive(Debug, Clone)]
pub struct Fallback {
    attempt: Attempt,
    relaxed: Stage,
}

#[derive(Debug, Clone)]
struct Attempt {
    coulomb: CoulombNewton,
    strict: Newton,
    trial: StageSolution,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        let attempt = Attempt {
            coulomb: CoulombNewton::new(links),
            strict: Newton::strict(links),
            trial: StageSolution::new(links),
        };
        Self { attempt, relaxed: Stage::with_capacity(links) }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may
    /// hold the result of another solver or anything else, NaN included. Also returns the number of linear solves.
    pub fn solve_hard(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, SolveStatus) {
        let (solves, merit) = self.attempt.close(stage, solution, tolerance);
        let mut offsets = stage.pegs.iter().map(|peg| peg.offset).chain(stage.pairs.iter().map(|pair| pair.offset));
        let can_relax = offsets.any(|offset| offset < 0.0);
        if merit <= 1.0 || !can_relax {
            return (solves, if merit <= 1.0 { SolveStatus::Solved } else { SolveStatus::Unsolved });
        }
        self.relaxed.copy_from(stage);
        let Stage { pegs, pairs, .. } = &mut self.relaxed;
        let offsets = pegs.iter_mut().map(|peg| &mut peg.offset).chain(pairs.iter_mut().map(|pair| &mut pair.offset));
        offsets.for_each(|offset| *offset = offset.max(0.0));
        let (more, merit) = self.attempt.close(&self.relaxed, solution, tolerance);
        (solves + more, if merit <= 1.0 { SolveStatus::Relaxed } else { SolveStatus::Unsolved })
    }
}

impl Attempt {
    /// Tries one method after the other and keeps the best solution in `solution`. Returns the solves and the residual
    /// in admissible ones.
    fn close(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, f64) {
        let methods = [Self::near_the_lanes, Self::by_continuation, Self::strictly];
        let mut best = merit(stage, solution, tolerance);
        let mut solves = 0;
        for method in methods {
            self.trial.copy_from(solution);
            if best.is_infinite() {
                self.start_from_free_motion(stage);
            }
            solves += method(self, stage, tolerance);
            let reached = merit(stage, &self.trial, tolerance);
            if reached < best {
                best = reached;
                solution.copy_from(&self.trial);
            }
            if best <= 1.0 {
                break;
            }
        }
        (solves, best)
    }

    /// Newton's method on the coupled problem from what the lanes left.
    fn near_the_lanes(&mut self, stage: &Stage, tolerance: f64) -> u32 {
        self.coulomb.solve(stage, &mut self.trial, tolerance).0
    }

    /// The same along the path of solutions from soft contacts.
    fn by_continuation(&mut self, stage: &Stage, tolerance: f64) -> u32 {
        self.start_from_free_motion(stage);
        self.coulomb.continuation(stage, &mut self.trial, tolerance).0
    }

    /// The lanes' method from free motion, radii moving only when the convex problem is solved.
    fn strictly(&mut self, stage: &Stage, tolerance: f64) -> u32 {
        self.start_from_free_motion(stage);
        self.strict.solve(stage, &mut self.trial, tolerance, MAX_ITERATIONS, true).iterations as u32
    }

    /// Free motion without impulses.
    fn start_from_free_motion(&mut self, stage: &Stage) {
        let StageSolution { twist, normal, friction, rolling, peg, peg_friction, pair, .. } = &mut self.trial;
        for (twist, link) in twist.iter_mut().zip(&stage.links) {
            *twist = free_twist(link);
        }
        normal.fill([0.0; 2]);
        friction.fill([Vector2::zeros(); 2]);
        rolling.fill(Vector2::zeros());
        peg.fill(0.0);
        peg_friction.fill(Vector2::zeros());
        pair.fill(0.0);
    }
}

/// At most 1 for a solution that is good enough.
fn merit(stage: &Stage, solution: &StageSolution, tolerance: f64) -> f64 {
    let residual = certify(stage, solution).residual();
    if residual.is_nan() { f64::INFINITY } else { residual / residual_limit(tolerance) }
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

/// Newton steps of one attempt.
const MAX_ITERATIONS: u32 = 1000;
