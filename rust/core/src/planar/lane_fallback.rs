//! The fallback for one lane of a register.

use crate::math::Real;
use crate::stepping::FallbackResult;

use super::{Fallback, Stage, StageSolution, certify};

/// Workspace for one robot at a time.
#[derive(Debug, Clone)]
pub struct LaneFallback {
    fallback: Fallback,
    stage: Stage,
    solution: StageSolution,
}

impl LaneFallback {
    pub fn new(links: usize) -> Self {
        Self { fallback: Fallback::new(links), stage: Stage::with_capacity(links), solution: StageSolution::new(links) }
    }

    /// Solves the stage of `lane` anew; `None` for a diverged robot, whose stage has a value that is not finite.
    pub fn solve_lane<T: Real>(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        lane: usize,
        tolerance: f64,
    ) -> Option<FallbackResult> {
        stage.copy_lane(lane, &mut self.stage);
        if !self.stage.energy().is_finite() {
            return None;
        }
        solution.copy_lane(stage, lane, &mut self.solution);
        let (solves, status) = self.fallback.solve_hard(&self.stage, &mut self.solution, tolerance);
        solution.set_lane(stage, lane, &self.solution);
        let certificate = certify(&self.stage, &self.solution);
        Some(FallbackResult { solves, status, residual: certificate.residual(), gap: certificate.gap })
    }
}
