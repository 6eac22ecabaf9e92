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

    /// Solves the stage of `lane` by the fallback; `None` for a diverged robot, whose stage has a value that is not finite,
    /// and where obstacles have friction, with which a stage is no optimisation problem.
    pub fn solve_lane<T: Real>(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        lane: usize,
        tolerance: f64,
    ) -> Option<FallbackResult> {
        if stage.contact_friction.iter().any(|friction| friction.coefficient.lane(lane) > 0.0) {
            return None;
        }
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
