//! The fallback for one lane of a register.

use std::sync::OnceLock;

use crate::math::Real;
use crate::stepping::{Effort, FallbackResult, NEARBY, is_worth_an_end, may_fall_back};

use super::{Fallback, Stage, StageSolution, certify};

static OBSERVER: OnceLock<fn(&Stage)> = OnceLock::new();

/// From now on calls `observer` with every stage that Newton's method leaves to the full fallback, also in other threads. The
/// first observer stays.
pub fn observe_hard_stages(observer: fn(&Stage)) {
    OBSERVER.get_or_init(|| observer);
}

/// Workspace for one robot at a time.
pub struct LaneFallback {
    fallback: Fallback,
    stage: Stage,
    solution: StageSolution,
}

impl LaneFallback {
    pub fn new(links: usize) -> Self {
        Self { fallback: Fallback::new(links), stage: Stage::with_capacity(links), solution: StageSolution::new(links) }
    }

    /// Solves the stage of `lane`, whose links and discs are so many `nodes`, by the fallback as far as `effort` allows.
    /// `None` if the stage has a value that is not finite (a diverged robot), or too many contacts between links for that.
    pub fn solve_lane<T: Real>(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        (lane, nodes): (usize, usize),
        tolerance: f64,
        effort: Effort,
    ) -> Option<FallbackResult> {
        stage.copy_lane(lane, &mut self.stage);
        self.stage.leave_out(nodes);
        let pairs = self.stage.pairs.iter().filter(|pair| pair.offset < NEARBY).count() as u32;
        let may_fall_back = may_fall_back(effort.solves_left, pairs);
        if !self.stage.energy().is_finite() || !(may_fall_back || is_worth_an_end(pairs)) {
            return None;
        }
        solution.copy_lane(stage, lane, &mut self.solution);
        self.solution.leave_out(&self.stage);
        let (solves, status) = if may_fall_back {
            OBSERVER.get().inspect(|observe| observe(&self.stage));
            self.fallback.solve(&self.stage, &mut self.solution, tolerance, effort.is_brief)
        } else {
            self.fallback.end_calmly(&self.stage, &mut self.solution, tolerance)
        };
        solution.set_lane(stage, lane, &self.solution);
        let certificate = certify(&self.stage, &self.solution);
        Some(FallbackResult { solves, pairs, status, residual: certificate.residual(), gap: certificate.gap })
    }
}
