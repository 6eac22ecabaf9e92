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
    newton: Newton,
    trial: StageSolution,
    eased: Stage,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        Self { newton: Newton::new(links), trial: StageSolution::new(links), eased: Stage::with_capacity(links) }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may hold
    /// what another solver left, or nothing of use, not even numbers. Returns the linear solves it took, too.
    pub fn solve_hard(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, Closing) {
        let (mut solves, badness) = self.start_again(stage, solution, tolerance);
        let can_ease = stage.pegs.iter().any(|peg| peg.offset < 0.0);
        if badness <= 1.0 || !can_ease {
            return (solves, if badness <= 1.0 { Closing::Closed } else { Closing::Open });
        }
        self.eased.clone_from(stage);
        self.eased.pegs.iter_mut().for_each(|peg| peg.offset = peg.offset.max(0.0));
        let eased = std::mem::replace(&mut self.eased, Stage::with_capacity(1));
        let (more, badness) = self.start_again(&eased, solution, tolerance);
        self.eased = eased;
        solves += more;
        (solves, if badness <= 1.0 { Closing::Eased } else { Closing::Open })
    }

    /// Solves strictly from free motion, first as asked for, then with ever looser patience for a single convex problem;
    /// keeps the best solution in `solution`. Returns the solves and the residual in admissible ones.
    fn start_again(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, f64) {
        let mut best = badness(stage, solution, tolerance);
        let mut solves = 0;
        for sharpness in [1.0, 0.01] {
            if best <= 1.0 {
                break;
            }
            self.trial.clone_from(solution);
            for (i, link) in stage.links.iter().enumerate() {
                self.trial.twist[i] = free_twist(link);
                self.trial.normal[i] = [0.0; 2];
            }
            let outcome =
                self.newton.solve_strictly(stage, &mut self.trial, sharpness * tolerance, MAX_ITERATIONS, true);
            solves += outcome.iterations as u32;
            let reached = badness(stage, &self.trial, tolerance);
            if reached < best {
                best = reached;
                solution.clone_from(&self.trial);
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
const MAX_ITERATIONS: u32 = 500;

/// Largest residual of a closed stage, in tolerances: the solvers bound velocities in the norm of the energy, the
/// judge looks at every link by itself.
pub const SLACK: f64 = 100.0;
