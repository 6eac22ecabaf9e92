//! The fallback for one lane of a register.

use crate::math::Real;
use crate::solver::{SolveStatus, residual_limit};
use crate::stepping::{FallbackResult, may_fall_back};

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

    /// Solves the stage of `lane` by the fallback. `None` if the stage has a value that is not finite (a diverged robot), or
    /// if the fallback would cost more than `solves_left`. With friction at obstacles the stage is not an optimisation
    /// problem and the fallback is not tried: the present solution counts as solved if its residual is within the
    /// fallback's limit, otherwise `None`.
    pub fn solve_lane<T: Real>(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        lane: usize,
        tolerance: f64,
        solves_left: u32,
    ) -> Option<FallbackResult> {
        if stage.contact_friction.iter().any(|friction| friction.coefficient.lane(lane) > 0.0) {
            return accept_lane(stage, solution, lane, tolerance);
        }
        stage.copy_lane(lane, &mut self.stage);
        let pairs = self.stage.pairs.len() as u32;
        if !self.stage.energy().is_finite() || !may_fall_back(solves_left, pairs) {
            return None;
        }
        solution.copy_lane(stage, lane, &mut self.solution);
        let (solves, status) = self.fallback.solve_hard(&self.stage, &mut self.solution, tolerance);
        solution.set_lane(stage, lane, &self.solution);
        let certificate = certify(&self.stage, &self.solution);
        Some(FallbackResult { solves, pairs, status, residual: certificate.residual(), gap: certificate.gap })
    }
}

/// Accepts what the fixed point over the normal impulses left, if the certificate finds it good enough.
fn accept_lane<T: Real>(
    stage: &Stage<T>,
    solution: &StageSolution<T>,
    lane: usize,
    tolerance: f64,
) -> Option<FallbackResult> {
    let certificate = certify(stage, solution);
    let (residual, gap) = (certificate.residual().lane(lane), certificate.gap.lane(lane));
    let accepted = || FallbackResult { solves: 0, pairs: 0, status: SolveStatus::Solved, residual, gap };
    (residual <= residual_limit(tolerance)).then(accepted)
}
