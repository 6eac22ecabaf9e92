//! What a group does about lanes whose stage Newton's method did not close.

use nalgebra::Vector2;

use crate::math::Real;
use crate::planar::{Certificate, Fallback, Stage, StageSolution, certify};
use crate::solver::SolveStatus;

use super::stage_work::StageWork;
use crate::stepping::Tally;
use crate::stepping::energy::Works;

/// Workspace for one robot at a time.
#[derive(Debug, Clone)]
pub struct Rescue {
    fallback: Fallback,
    stage: Stage,
    solution: StageSolution,
}

/// A rescued stage.
pub struct Rescued {
    /// Linear solves.
    pub solves: u32,
    pub closing: SolveStatus,
    /// Of the stage as it was asked for, also where it had to be eased.
    pub certificate: Certificate,
}

impl Rescued {
    /// Takes note of a stage that took the fallback after `iterations` of Newton's method.
    pub fn record(&self, iterations: u32, tally: &mut Tally) {
        let Self { solves, closing, certificate } = self;
        let (eased, open) = (*closing == SolveStatus::Relaxed, *closing == SolveStatus::Unsolved);
        tally.add_fallback(iterations + solves, eased, open, certificate.residual(), certificate.gap);
    }
}

impl Rescue {
    pub fn new(links: usize) -> Self {
        Self { fallback: Fallback::new(links), stage: Stage::with_capacity(links), solution: StageSolution::new(links) }
    }

    /// Solves the stage of `lane` anew and puts everything that follows from the solution in its place; `None` for
    /// a robot that is lost, whose stage is not made of numbers.
    pub fn solve_lane<T: Real>(&mut self, work: &mut StageWork<T>, lane: usize, tolerance: f64) -> Option<Rescued> {
        work.stage.copy_lane(lane, &mut self.stage);
        if !self.stage.energy().is_finite() {
            return None;
        }
        work.solution.copy_lane(&work.stage.contacts, lane, &mut self.solution);
        let (solves, closing) = self.fallback.solve_hard(&self.stage, &mut self.solution, tolerance);
        work.solution.set_lane(&work.stage.contacts, lane, &self.solution);
        self.set_forces(work, lane);
        work.works.set_lane(lane, &Works::of(&self.stage, &self.solution));
        work.deviation.set_lane(lane, self.deviation(work, lane));
        Some(Rescued { solves, closing, certificate: certify(&self.stage, &self.solution) })
    }

    fn set_forces<T: Real>(&self, work: &mut StageWork<T>, lane: usize) {
        let per_second = 1.0 / self.stage.coefficient;
        for (force, impulse) in work.friction_force.iter_mut().zip(&self.solution.friction) {
            force.x.set_lane(lane, impulse.x * per_second);
            force.y.set_lane(lane, impulse.y * per_second);
        }
        let StageWork { contact_force, stage, .. } = work;
        let forces = contact_force.iter_mut().zip(&stage.contacts).filter(|(_, contact)| contact.is_in(lane));
        for ((force, _), impulse) in forces.zip(&self.solution.contact) {
            force.set_lane(lane, impulse * per_second);
        }
    }

    /// How far the stage ends from its prediction, for any point of the robot \[m\].
    fn deviation<T: Real>(&self, work: &StageWork<T>, lane: usize) -> f64 {
        let speeds = self.solution.twist.iter().zip(&work.guess).zip(&work.constants).map(|((u, guess), link)| {
            let change = Vector2::new(u.x - guess.x.lane(lane), u.y - guess.y.lane(lane));
            change.norm() + link.reach.lane(lane) * (u.z - guess.z.lane(lane)).abs()
        });
        speeds.fold(0.0, f64::max) * self.stage.coefficient
    }
}
