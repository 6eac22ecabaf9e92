//! What is done about a stage that Newton's method did not close: the strict variant of the method from afar, and, where
//! the contacts contradict each other, a stage that can be closed.

use super::{Newton, Screw, Stage, StageLink, StageSolution, certify};

/// How far the fallback came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// The stage is solved.
    Closed,
    /// No velocity opens all contacts as fast as they ask: penetrations stay, and the stage is solved otherwise.
    Eased,
    /// The best solution found is not within its tolerance.
    Open,
}

/// Workspace of the fallback, for one robot.
#[derive(Debug, Clone)]
pub struct Fallback {
    attempt: Attempt,
    eased: Stage,
}

#[derive(Debug, Clone)]
struct Attempt {
    newton: Newton,
    trial: StageSolution,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        let attempt = Attempt { newton: Newton::strict(links), trial: StageSolution::new(links) };
        Self { attempt, eased: Stage::with_capacity(links) }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may hold
    /// what another solver left, or nothing of use, not even numbers. Returns the linear solves it took, too.
    pub fn solve_hard(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, Closing) {
        let (solves, badness) = self.attempt.start_again(stage, solution, tolerance);
        let can_ease = stage.pegs.iter().any(|peg| peg.offset < 0.0);
        if badness <= 1.0 || !can_ease {
            return (solves, if badness <= 1.0 { Closing::Closed } else { Closing::Open });
        }
        self.eased.copy_from(stage);
        self.eased.pegs.iter_mut().for_each(|peg| peg.offset = peg.offset.max(0.0));
        let (more, badness) = self.attempt.start_again(&self.eased, solution, tolerance);
        (solves + more, if badness <= 1.0 { Closing::Eased } else { Closing::Open })
    }
}

impl Attempt {
    /// Solves strictly from free motion, to the tolerance and then to a hundredth of it; keeps the best solution in
    /// `solution`. Returns the solves and the residual in admissible ones.
    fn start_again(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, f64) {
        let mut best = badness(stage, solution, tolerance);
        let mut solves = 0;
        for sharpness in [1.0, 0.01] {
            if best <= 1.0 {
                break;
            }
            self.trial.copy_from(solution);
            for (i, link) in stage.links.iter().enumerate() {
                self.trial.twist[i] = free_twist(link);
                self.trial.normal[i] = [0.0; 2];
            }
            let outcome = self.newton.solve(stage, &mut self.trial, sharpness * tolerance, MAX_ITERATIONS, true);
            solves += outcome.iterations as u32;
            let reached = badness(stage, &self.trial, tolerance);
            if reached < best {
                best = reached;
                solution.copy_from(&self.trial);
            }
        }
        (solves, best)
    }
}

/// At most 1 for a solution that is good enough.
fn badness(stage: &Stage, solution: &StageSolution, tolerance: f64) -> f64 {
    let residual = certify(stage, solution).residual();
    if residual.is_nan() { f64::INFINITY } else { residual / (SLACK * tolerance) }
}

/// M^-1 p.
fn free_twist(link: &StageLink) -> Screw {
    let (z, l) = (&link.axes[2], &link.momentum.angular);
    let spin = z.dot(l);
    Screw {
        linear: link.momentum.linear / link.mass,
        angular: (l - z * spin) / link.inertia + z * (spin / link.roll_inertia),
    }
}

/// Newton steps of one attempt.
const MAX_ITERATIONS: u32 = 1000;

/// Largest residual of a closed stage, in tolerances: the solvers bound velocities in the norm of the energy, the
/// judge looks at every link by itself.
pub const SLACK: f64 = 100.0;
