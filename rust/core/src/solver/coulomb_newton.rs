//! Newton's method on a stage with Coulomb's law as it stands: friction follows the normal impulse in the tangent, too.
//!
//! The spatial solver of the lanes holds bounds of friction in each step and updates them afterwards, which converges where
//! friction is weak: a change dP of a normal impulse changes friction by mu dP, which acts on normal impulses again. Here
//! velocities and impulses are both unknowns, each law is imposed as `P = prox_C(P)(...)` with the
//! [set that belongs to the present normal impulse](super::coulomb_laws), and the tangent is the unsymmetric one of all
//! that. There is no function to minimise: a step is halved until the squared defects of all laws and balances fall below
//! the largest of the last few, and where no fraction of it achieves that, a tenth is taken anyway, which leaves the kink.
//! Continuation starts from soft contacts: with their compliance normal impulses change little and the problem is nearly
//! convex; its solution is followed to that of the stiff contacts.

use super::CoulombForm;

/// How far velocities and impulses are from solving the stage.
#[derive(Debug, Clone, Copy)]
pub struct Defect {
    /// Sum of squares over masses \[J\].
    pub energy: f64,
    /// The largest \[m/s\].
    pub speed: f64,
}

/// A stage whose velocities and impulses are both unknowns, with its workspace.
pub trait CoupledStage {
    type Stage;
    type Solution;

    /// Takes in a stage with the velocities and impulses of `solution` and the compliance of the stiff contacts; the
    /// centres of the laws are zero.
    fn load(&mut self, stage: &Self::Stage, solution: &Self::Solution, tolerance: f64);

    fn write(&self, solution: &mut Self::Solution);

    fn form(&mut self) -> &mut CoulombForm;

    /// Evaluates all laws and balances at the present velocities and impulses.
    fn defects(&mut self) -> Defect;

    /// Computes the Newton step of all velocities and impulses from here.
    fn find_step(&mut self);

    /// Moves to a fraction of the step from its start.
    fn move_along(&mut self, fraction: f64);

    /// Moves the centres of the laws to the impulses.
    fn recentre(&mut self);

    /// How far an impulse is from its centre at most \[N s\].
    fn centre_error(&self) -> f64;

    /// Error that is negligible \[m/s\].
    fn negligible(&self) -> f64;

    /// Solves `stage` from the velocities and impulses in `solution`, to velocities far below `tolerance` \[m/s\].
    /// Returns the linear solves it took and whether it converged; if not, `solution` is unchanged, or the one with
    /// compliance.
    fn solve(&mut self, stage: &Self::Stage, solution: &mut Self::Solution, tolerance: f64) -> (u32, bool) {
        self.load(stage, solution, tolerance);
        self.close(solution)
    }

    /// Solves the problem with the compliance, which selects the impulses, and then moves the centres to them, with less
    /// compliance, until its effect is negligible.
    fn close(&mut self, solution: &mut Self::Solution) -> (u32, bool) {
        let stiffer = self.form().compliance * STIFFER;
        let mut solves = 0;
        for _ in 0..=MOST_CENTRES {
            let (more, solved) = converge(self);
            solves += more;
            if !solved {
                return (solves, false);
            }
            self.write(solution);
            if self.centre_error() * self.form().compliance <= self.negligible() {
                break;
            }
            self.recentre();
            self.form().compliance = stiffer;
        }
        (solves, true)
    }

    /// The same by continuation from soft contacts to stiff ones; if it does not reach these, `solution` is the last one found.
    /// No soft problem begins after `most` linear solves.
    fn continuation(
        &mut self,
        stage: &Self::Stage,
        solution: &mut Self::Solution,
        tolerance: f64,
        most: u32,
    ) -> (u32, bool) {
        let (mut softness, mut ratio, mut solves) = (SOFTEST, FIRST_RATIO, 0);
        let mut next = softness;
        while ratio > LAST_RATIO && solves < most.min(MOST_SOLVES) {
            self.load(stage, solution, tolerance);
            self.form().compliance *= next;
            let (more, solved) = converge(self);
            solves += more;
            if solved {
                self.write(solution);
                if next == 1.0 {
                    break;
                }
                (softness, ratio) = (next, (ratio * ratio).min(LARGEST_RATIO));
            } else {
                ratio = ratio.sqrt();
            }
            next = (softness / ratio).max(1.0);
        }
        let (more, solved) = self.solve(stage, solution, tolerance);
        (solves + more, solved)
    }
}

/// Newton's method until the defects vanish. Returns the linear solves and whether they did.
pub(crate) fn converge(stage: &mut (impl CoupledStage + ?Sized)) -> (u32, bool) {
    let mut here = stage.defects();
    let mut recent = [here.energy; MEMORY];
    for solves in 0..MAX_ITERATIONS {
        if here.speed <= ROUND_OFF * stage.negligible() {
            return (solves, true);
        }
        stage.find_step();
        let reference = recent.iter().copied().fold(0.0, f64::max);
        let found = search(stage, reference);
        if found.is_none() && here.speed <= stage.negligible() {
            arrive(stage, 0.0);
            return (solves + 1, true);
        }
        here = found.unwrap_or_else(|| arrive(stage, KICK));
        recent[solves as usize % MEMORY] = here.energy;
    }
    (MAX_ITERATIONS, here.speed <= stage.negligible())
}

/// Takes the largest fraction of the step that decreases the defects, if there is one.
fn search(stage: &mut (impl CoupledStage + ?Sized), reference: f64) -> Option<Defect> {
    let mut fraction = 1.0;
    for _ in 0..MAX_HALVINGS {
        let there = arrive(stage, fraction);
        if there.energy < (1.0 - DESCENT * fraction) * reference {
            return Some(there);
        }
        fraction *= 0.5;
    }
    None
}

fn arrive(stage: &mut (impl CoupledStage + ?Sized), fraction: f64) -> Defect {
    stage.move_along(fraction);
    stage.defects()
}

impl Defect {
    pub const NONE: Self = Self { energy: 0.0, speed: 0.0 };

    pub fn add(&mut self, energy: f64, speed: f64) {
        self.energy += energy;
        self.speed = self.speed.max(speed);
    }

    /// Adds a missing impulse on a mass.
    pub fn add_impulse(&mut self, missing: f64, mass: f64) {
        self.add(missing * missing / mass, missing.abs() / mass);
    }
}

/// Newton steps for one position of the centres.
const MAX_ITERATIONS: u32 = 100;

/// How often the centres of the laws move to the impulses, and how much less compliance there is around them.
const MOST_CENTRES: u32 = 10;
const STIFFER: f64 = 1e-2;

/// A step must not end above the worst of as many before it.
const MEMORY: usize = 6;

/// By which part of its length a step must decrease the defects, and how often it is halved.
const DESCENT: f64 = 1e-4;
const MAX_HALVINGS: u32 = 12;

/// Part of a step that is taken where none decreases the defects.
const KICK: f64 = 0.1;

/// Largest compliance over that of the stage, by what it is divided at first, at most, and at least, and linear solves
/// for all of that.
const SOFTEST: f64 = 1e4;
const FIRST_RATIO: f64 = 10.0;
const LARGEST_RATIO: f64 = 1e3;
const LAST_RATIO: f64 = 1.01;
const MOST_SOLVES: u32 = 3000;

/// Defects that are left, over the negligible error.
const ROUND_OFF: f64 = 0.1;
