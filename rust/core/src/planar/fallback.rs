//! What is done about a stage that Newton's method did not close: another method, a polish, and, where the
//! contacts contradict each other, a stage that can be closed.

use super::{InteriorPoint, Newton, Stage, StageSolution, certify};

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
    solvers: Solvers,
    eased: Stage,
}

#[derive(Debug, Clone)]
struct Solvers {
    interior_point: InteriorPoint,
    newton: Newton,
    polished: StageSolution,
    /// Energies of the stage as it was asked for \[J\].
    energy: f64,
}

impl Fallback {
    pub fn new(links: usize) -> Self {
        let solvers = Solvers {
            interior_point: InteriorPoint::new(links),
            newton: Newton::new(links),
            polished: StageSolution::new(links),
            energy: 0.0,
        };
        Self { solvers, eased: Stage::with_capacity(links) }
    }

    /// Solves `stage` for velocities within about `tolerance` \[m/s\]. `solution` has the size of the stage and may
    /// hold what another solver left, or nothing of use, not even numbers. Returns the linear solves it took, too.
    pub fn solve_hard(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, Closing) {
        self.solvers.energy = stage.energy();
        let (mut solves, closed) = self.solvers.polish(stage, solution, tolerance);
        if closed {
            return (solves, Closing::Closed);
        }
        let (more, closed) = self.solvers.start_again(stage, solution, tolerance);
        solves += more;
        let can_ease = stage.contacts.iter().any(|contact| contact.offset < 0.0);
        if closed || !can_ease {
            return (solves, if closed { Closing::Closed } else { Closing::Open });
        }
        stage.copy_lane(0, &mut self.eased);
        self.eased.contacts.iter_mut().for_each(|contact| contact.offset = contact.offset.max(0.0));
        let (more, closed) = self.solvers.start_again(&self.eased, solution, tolerance);
        (solves + more, if closed { Closing::Eased } else { Closing::Open })
    }
}

impl Solvers {
    /// The interior point method from the reference velocity, polished. Returns linear solves and whether that
    /// closed the stage.
    fn start_again(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        for (twist, link) in solution.twist.iter_mut().zip(&stage.links) {
            *twist = link.reference;
        }
        let descent = self.interior_point.solve(stage, solution, tolerance);
        let (solves, closed) = self.polish(stage, solution, tolerance);
        (descent.solves + solves, closed)
    }

    /// Newton's method from near a solution that is not good enough, to a stricter tolerance; keeps the better of both.
    fn polish(&mut self, stage: &Stage, solution: &mut StageSolution, tolerance: f64) -> (u32, bool) {
        let (before, residual) = self.badness(stage, solution, tolerance);
        if before.max(residual) <= 1.0 || !before.is_finite() {
            return (0, before <= 1.0);
        }
        solution.copy_lane(&stage.contacts, 0, &mut self.polished);
        let outcome = self.newton.solve(stage, &mut self.polished, POLISH * tolerance, MAX_POLISH, true);
        let (after, polished_residual) = self.badness(stage, &self.polished, tolerance);
        if (after.max(1.0), polished_residual) < (before.max(1.0), residual) {
            self.polished.copy_lane(&stage.contacts, 0, solution);
        }
        (outcome.iterations as u32, before.min(after) <= 1.0)
    }

    /// At most 1 for a solution that is good enough: each law obeyed nearly, and all together by the duality gap. And
    /// the residual in tolerances.
    fn badness(&self, stage: &Stage, solution: &StageSolution, tolerance: f64) -> (f64, f64) {
        let certificate = certify(stage, solution);
        let lightest = stage.links.iter().map(|link| link.mass).fold(f64::INFINITY, f64::min);
        let enough = (0.5 * lightest * tolerance * tolerance).max(RELATIVE_GAP * self.energy);
        let residual = certificate.residual() / tolerance;
        // Impulses of a jam may be so large that even a small residual leaves more than the gap asked for.
        let badness = (certificate.gap / enough).min(10.0 * residual).max(residual / SLACK);
        let is_number = !certificate.gap.is_nan() && !residual.is_nan();
        (if is_number { badness } else { f64::INFINITY }, residual)
    }
}

/// Tolerance of a polish, in tolerances, and its Newton steps.
const POLISH: f64 = 0.01;
const MAX_POLISH: u32 = 50;

/// Duality gap of a closed stage, relative to the stage's energies.
const RELATIVE_GAP: f64 = 1e-10;

/// Largest residual of a closed stage, in tolerances: the solvers bound velocities in the norm of the energy, the
/// judge looks at every link by itself.
pub const SLACK: f64 = 100.0;
