//! The fallback for one lane of a register.

use std::sync::OnceLock;

use crate::math::Real;
use crate::stepping::{FallbackResult, NEARBY, may_fall_back, solves_within};

use super::{Fallback, SpatialVector, Stage, StageSolution, certify};

static OBSERVER: OnceLock<fn(&Stage)> = OnceLock::new();

/// From now on calls `observer` with every stage that Newton's method leaves to the fallback, also in other threads. The
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
    pub fn new(links: usize, movables: usize) -> Self {
        let nodes = links + movables;
        let solution = StageSolution::new(links).among(movables);
        Self { fallback: Fallback::new(nodes), stage: Stage::with_capacity(nodes), solution }
    }

    /// Solves the stage of `lane`, of so many `nodes`, by the fallback; `None` for a diverged robot, whose stage has a value that is not finite,
    /// and where the fallback would cost more than `solves_left`.
    pub fn solve_lane<T: Real>(
        &mut self,
        stage: &Stage<T>,
        solution: &mut StageSolution<T>,
        (lane, nodes): (usize, usize),
        tolerance: f64,
        solves_left: u32,
    ) -> Option<FallbackResult> {
        stage.copy_lane(lane, &mut self.stage);
        self.stage.leave_out(nodes);
        let pairs = self.stage.pairs.iter().filter(|pair| pair.offset < NEARBY).count() as u32;
        if !self.stage.links.iter().all(|link| is_finite(&link.momentum)) || !may_fall_back(solves_left, pairs) {
            return None;
        }
        OBSERVER.get().inspect(|observe| observe(&self.stage));
        solution.copy_lane(stage, lane, &mut self.solution);
        self.solution.leave_out(&self.stage);
        let (solves, status) =
            self.fallback.solve_hard(&self.stage, &mut self.solution, tolerance, solves_within(solves_left, pairs));
        solution.set_lane(stage, lane, &self.solution);
        let residual = certify(&self.stage, &self.solution).residual();
        Some(FallbackResult { solves, pairs, status, residual, gap: 0.0 })
    }
}

fn is_finite(SpatialVector { linear, angular }: &SpatialVector) -> bool {
    linear.iter().chain(angular.iter()).all(|number| number.is_finite())
}
