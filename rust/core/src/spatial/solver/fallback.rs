//! Fallback for a stage that the lanes' Newton iteration did not solve: rest, the coupled Newton iteration from there, a
//! sequence of convex problems, the coupled iteration by continuation from soft contacts, then the strict variant of the
//! lanes' method from free motion. Of all that is found, the solution with the least certified residual is kept. Where
//! contacts contradict each other, or wedge the robot, the stage is relaxed.

use nalgebra::{Vector2, Vector3};

use crate::rows::{demanded_speed, relax};
use crate::solver::{CoupledStage, EXACT, STRAIN, SolveStatus, greatest_impulse};
use crate::spatial::rest::{RestCandidate, bound, fastest};
use crate::spatial::{Stage, StageLink, StageSolution, Twist, certify, stopping};

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
    /// Whether that is a robot at rest.
    stands: bool,
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
            stands: false,
            rest: RestCandidate::new(links),
        };
        Self { attempt, relaxed: Stage::with_capacity(links), relaxed_solution: StageSolution::new(links) }
    }

    /// Solves `stage` to a residual of at most `tolerance` \[m/s\]. `solution` has the size of the stage and may
    /// hold the result of another solver or anything else, NaN included. Neither a method nor a convex problem begins
    /// after `most` linear solves, but those of a calm end; their number is also returned.
    pub fn solve_hard(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        most: u32,
    ) -> (u32, SolveStatus) {
        self.solve(stage, solution, tolerance, (most, false))
    }

    /// The same; where it is `brief`, a stage with penetrations is relaxed after fewer methods.
    pub(crate) fn solve(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        tolerance: f64,
        (most, brief): (u32, bool),
    ) -> (u32, SolveStatus) {
        let demand = demanded_speed(&stage.contacts, &stage.pairs);
        let (mut solves, mut is_done, mut residual) = (0, false, f64::INFINITY);
        let (near, far) = METHODS.split_at(NEAR);
        let contradiction = tolerance.max(CONTRADICTION);
        let at_once = if brief { contradiction } else { f64::INFINITY };
        for (methods, inaccurate) in [(near, at_once), (far, contradiction)] {
            if is_done || solves >= most {
                break;
            }
            let (more, done) = self.attempt.close(stage, solution, methods, tolerance, most - solves);
            (solves, is_done, residual) = (solves + more, done, self.attempt.residual);
            // Not the forces of a method that has gone astray, nor those of an exact solution.
            let is_wedged = EXACT < residual
                && residual <= contradiction
                && greatest_impulse(&solution.contact, &solution.pair) > STRAIN * stage.momentum_with(demand);
            if demand > 0.0 && (is_wedged || residual > inaccurate) {
                let (more, eased) = self.ease(stage, solution, is_wedged, tolerance, most.saturating_sub(solves));
                solves += more;
                if eased {
                    let is_solved = certified(stage, solution) <= tolerance;
                    return (solves, if is_solved { SolveStatus::Solved } else { SolveStatus::Relaxed });
                }
            }
        }
        if residual <= tolerance {
            return (solves, SolveStatus::Solved);
        }
        let (more, status) = self.end_calmly(stage, solution, tolerance);
        (solves + more, status)
    }

    /// For a stage that stays open or a step that is out of solves: replaces `solution` by what a few convex problems without
    /// recovery of penetrations find, where the certificate finds that better. Their contacts give the robot no energy, unlike
    /// what a method has left on its way.
    pub fn end_calmly(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, SolveStatus) {
        self.relax(stage);
        let Self { attempt, relaxed, relaxed_solution: calm } = self;
        calm.copy_from(solution);
        start_from_free_motion(stage, calm);
        let is_enough = |solution: &StageSolution| certified(relaxed, solution) <= tolerance;
        let stopping = stopping(tolerance);
        let solves = attempt.coulomb.lag(relaxed, calm, stopping, MOST_TO_END, Lag::Follows, is_enough);
        let [before, after] = [&*solution, calm].map(|solution| certified(stage, solution));
        if after < before || before.is_infinite() {
            solution.copy_from(calm);
        }
        (solves, if before.min(after) <= tolerance { SolveStatus::Solved } else { SolveStatus::Unsolved })
    }

    /// Takes the solution of the stage with recovery of penetrations switched off, if it is found, and if its forces are
    /// ordinary where the robot `is_wedged` by those of `solution`. Also returns the linear solves.
    fn ease(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        is_wedged: bool,
        tolerance: f64,
        most: u32,
    ) -> (u32, bool) {
        self.relax(stage);
        let Self { attempt, relaxed, relaxed_solution: eased } = self;
        eased.copy_from(solution);
        if is_wedged {
            start_from_free_motion(stage, eased);
        }
        let (solves, _) = attempt.close(relaxed, eased, &METHODS, tolerance, most);
        let is_solved = attempt.residual <= tolerance;
        let impulses = [&*solution, eased].map(|one| greatest_impulse(&one.contact, &one.pair));
        let eases = is_solved && (!is_wedged || impulses[0] > STRAIN * impulses[1]);
        if eases {
            solution.copy_from(eased);
        }
        (solves, eases)
    }

    /// The relaxed stage is that of `stage`.
    fn relax(&mut self, stage: &Stage) {
        self.relaxed.copy_from(stage);
        relax(&mut self.relaxed.contacts, &mut self.relaxed.pairs);
    }
}

/// Continues from the trial to a tolerance of the solvers; is told how many linear solves are left, and returns how many it
/// took.
type Method = fn(&mut Attempt, &Stage, f64, u32) -> u32;

/// Methods, with the residual over that tolerance that is enough: the fallback is as accurate as the lanes.
const METHODS: [(Method, f64); 5] = [
    (Attempt::at_rest, ENOUGH),
    (Attempt::near_the_lanes, ENOUGH),
    (Attempt::by_convex_problems, 1.0),
    (Attempt::by_continuation, 1.0),
    (Attempt::strictly, 1.0),
];

/// As many of them are tried before a wedge is looked for.
const NEAR: usize = 2;

impl Attempt {
    /// Tries one method after the other until the residual is enough, and keeps the best solution in `solution`. Returns the
    /// solves and whether that is so.
    fn close(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        methods: &[(Method, f64)],
        tolerance: f64,
        most: u32,
    ) -> (u32, bool) {
        let stopping = stopping(tolerance);
        self.best.copy_from(solution);
        (self.residual, self.stands) = (certified(stage, solution), false);
        let (mut solves, mut is_done) = (0, false);
        for (method, enough) in methods {
            if is_done || solves >= most {
                break;
            }
            self.trial.copy_from(&self.best);
            if self.residual.is_infinite() {
                start_from_free_motion(stage, &mut self.trial);
            }
            solves += method(self, stage, stopping, most - solves);
            self.keep_if_better(stage);
            is_done = self.stands || self.residual <= enough * stopping;
        }
        solution.copy_from(&self.best);
        (solves, is_done)
    }

    fn keep_if_better(&mut self, stage: &Stage) {
        let reached = certified(stage, &self.trial);
        if reached < self.residual {
            self.residual = reached;
            self.best.copy_from(&self.trial);
        }
    }

    /// Friction that does not lag at all, whose solution is rest where the contacts can hold the robot: the robot stands
    /// once it is held within the [bound](rest::bound) that keeps it at rest from then on.
    fn at_rest(&mut self, stage: &Stage, stopping: f64, most: u32) -> u32 {
        let Self { coulomb, trial, best, residual, stands, rest, .. } = self;
        if residual.is_infinite() || fastest(stage, best) > SLOW {
            return 0;
        }
        let (bound, mut left) = (bound(stage, stopping), f64::INFINITY);
        let solves = coulomb.lag(stage, trial, bound, most, Lag::None, |solution| {
            let before = std::mem::replace(&mut left, rest.residual(stage, solution));
            left <= bound || left > GAIN * before
        });
        if left <= bound {
            // The trial too, so that it does not replace rest by the last iterate.
            (*stands, *residual) = (true, left);
            rest.write(true, best);
            trial.copy_from(best);
        }
        solves
    }

    /// Newton's method on the coupled problem from what the lanes left.
    fn near_the_lanes(&mut self, stage: &Stage, stopping: f64, _: u32) -> u32 {
        self.coulomb.solve(stage, &mut self.trial, stopping).0
    }

    /// Convex problems with friction that lags, from what is best so far.
    fn by_convex_problems(&mut self, stage: &Stage, stopping: f64, most: u32) -> u32 {
        let Self { coulomb, trial, best, residual: least, .. } = self;
        coulomb.lag(stage, trial, stopping, most, Lag::Follows, |solution| {
            let reached = certified(stage, solution);
            if reached < *least {
                *least = reached;
                best.copy_from(solution);
            }
            *least <= ENOUGH * stopping
        })
    }

    /// The same along the path of solutions from soft contacts.
    fn by_continuation(&mut self, stage: &Stage, stopping: f64, most: u32) -> u32 {
        start_from_free_motion(stage, &mut self.trial);
        self.coulomb.continuation(stage, &mut self.trial, stopping, most).0
    }

    /// The lanes' method from free motion, radii moving only when the convex problem is solved.
    fn strictly(&mut self, stage: &Stage, stopping: f64, most: u32) -> u32 {
        start_from_free_motion(stage, &mut self.trial);
        self.strict.solve_one(stage, &mut self.trial, stopping, most.min(MAX_ITERATIONS)).iterations as u32
    }
}

/// Free motion without impulses.
fn start_from_free_motion(stage: &Stage, solution: &mut StageSolution) {
    let StageSolution { twist, surface, normal, friction, rolling, gear, contact, obstacle_friction, pair, .. } =
        solution;
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

/// Certified; infinite for one that is not a number.
fn certified(stage: &Stage, solution: &StageSolution) -> f64 {
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

/// Residual over the tolerance of the solvers with which nothing better is looked for: what is left of the forces at rest
/// makes a robot creep, ten times as fast as the residual at many contacts close to slipping.
const ENOUGH: f64 = 0.1;

/// Speed up to which rest is tried \[m/s\], and by which part of itself what is left of the forces must fall in a problem.
const SLOW: f64 = 1e-2;
const GAIN: f64 = 0.9;

/// Residual from which on contacts may contradict each other \[m/s\].
const CONTRADICTION: f64 = 1e-4;

/// Newton steps of one attempt.
const MAX_ITERATIONS: u32 = 1000;

/// Linear solves after which no other convex problem of a calm end begins.
const MOST_TO_END: u32 = 50;
