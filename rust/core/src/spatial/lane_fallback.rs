//! What is done about lanes whose stage Newton's method did not close: the fallback, one robot at a time.

use crate::math::Real;
use crate::solver::SolveStatus;
use crate::spatial::{Certificate, Fallback, Stage, StageSolution, certify};

use super::SpatialPlant;
use super::contact_map::Slots;
use super::stage_work::StageWork;

/// Workspace for one robot at a time.
#[derive(Debug, Clone)]
pub struct Rescue {
    fallback: Fallback,
    stage: Stage,
    solution: StageSolution,
}

impl Rescue {
    pub fn new(plant: &SpatialPlant) -> Self {
        let links = plant.robot.link_count();
        Self { fallback: Fallback::new(links), stage: Stage::with_capacity(links), solution: StageSolution::new(links) }
    }

    /// Solves the stage of `lane` anew. Returns the linear solves it took, how far they led, and what the judge says.
    pub fn solve_lane<T: Real>(
        &mut self,
        work: &mut StageWork<T>,
        slots: &Slots,
        lane: usize,
        tolerance: f64,
    ) -> (u32, SolveStatus, Certificate) {
        work.stage.read_lane(lane, slots.of_lane(lane), &mut self.stage);
        work.solution.read_lane(lane, slots.of_lane(lane), &mut self.solution);
        let (solves, closing) = self.fallback.solve_hard(&self.stage, &mut self.solution, tolerance);
        work.solution.set_lane(lane, slots.of_lane(lane), &self.solution);
        (solves, closing, certify(&self.stage, &self.solution))
    }
}
