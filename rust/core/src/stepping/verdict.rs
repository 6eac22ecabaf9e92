//! What *residual*, *unconverged* and *fallback* mean, for all models.
//!
//! * The **residual** of a stage is what the model's certificate finds: the worst violation of any law of the stage by
//!   the solution, as a velocity \[m/s\]. It is computed by code that no solver uses.
//! * A stage is **solved** if its solver met its own stopping rule and the residual is at most the tolerance. A residual
//!   that is not a number solves nothing.
//! * A stage that Newton's method did not solve is given to the **fallback**, one robot at a time. The fallback counts
//!   in `fallbacks` whether or not it succeeds.
//! * A stage is **unconverged** if the fallback did not solve it either, or was not tried: the stage has a value that is not
//!   finite, or the budget does not suffice and many links are close to each other.
//!
//! A step has a **budget** of [`STEP_BUDGET`] times `max_iterations` linear solves, in which a solve of the fallback with k
//! contacts between links counts as `1 + k^2 / 50`, as much as it costs, and those of a fallback that does not solve its
//! stage, or relaxes it, count [`IN_VAIN`] times. Contacts that contradict each other send every stage of every part to the
//! fallback, and shorter parts do not help; after the first that is relaxed the fallback is brief ([`Effort`]). Once the budget
//! is spent, parts are not divided for a penetration, and only the calm end is left of the fallback, whose contacts give the
//! robot no energy. What stays open counts in `unconverged`, and what sinks beyond recovery sets `penetrated`. The full
//! fallback is not begun either if it would spend more than what is left: where links are predicted to fly through each
//! other, each of a thousand solves would take in hundreds of contacts.
//!
//! The solvers of a model may stop at a share of the tolerance, as those of 3D do. In the plane a solution of the fallback
//! counts as solved up to [`crate::solver::residual_limit`].

use crate::math::{Mask, Real};
use crate::solver::{SolveStatus, is_unsolved};

use super::stage::SolvedStage;

/// Linear solves of one step in `max_iterations`, 100,000 by default. Steps of ordinary scenes take tens, a coil that is
/// pressed together without a torque limit, solved to 1e-10 m/s, takes 6,000. A jam between rough walls in steps
/// of 1 ms takes more than 20,000 (`test_a_jam_between_rough_walls_is_solved_in_short_steps`); where such a step is out of
/// solves, the next ones start from what it left.
const STEP_BUDGET: u32 = 500;

/// How often the solves of a fallback count that does not solve its stage, as none does where contacts contradict each
/// other.
const IN_VAIN: u32 = 5;

/// What a step still spends on stages that Newton's method does not solve.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// What is left of its budget.
    pub solves_left: u32,
    /// Whether only the first methods are tried before a stage is relaxed: one of this step was.
    pub is_brief: bool,
}

/// What is left of the budget of a step that has cost `spent` linear solves: while there is any, the step may be divided,
/// and may take the fallback.
pub fn solves_left(spent: u32, max_iterations: u32) -> u32 {
    STEP_BUDGET.saturating_mul(max_iterations).saturating_sub(spent)
}

/// Offset up to which contacts between links count in the cost of a fallback \[m/s\], and are taken in by the interior point
/// method at first: others hardly ever close in a stage, and lanes without a contact have this offset.
pub(crate) const NEARBY: f64 = 1.0;

/// Cost of one solve of the fallback that takes in `pairs` contacts between links, in linear solves without any.
fn solve_cost(pairs: u32) -> u64 {
    1 + u64::from(pairs) * u64::from(pairs) / 50
}

fn fallback_cost(solves: u32, pairs: u32) -> u32 {
    u32::try_from(u64::from(solves) * solve_cost(pairs)).unwrap_or(u32::MAX)
}

/// Solves of the fallback with `pairs` contacts between links that fit into what is left of the budget if they are in vain,
/// but at least what it is expected to take.
pub(crate) fn solves_within(solves_left: u32, pairs: u32) -> u32 {
    ((u64::from(solves_left / IN_VAIN) / solve_cost(pairs)) as u32).max(FALLBACK_SOLVES)
}

/// Whether the fallback of a stage with `pairs` contacts between links fits into what is left of the budget.
pub(crate) fn may_fall_back(solves_left: u32, pairs: u32) -> bool {
    solves_left > 0 && fallback_cost(FALLBACK_SOLVES, pairs) <= solves_left
}

/// Whether a stage of a step that is out of solves is worth what a calm end costs with `pairs` contacts between links.
pub(crate) fn is_worth_an_end(pairs: u32) -> bool {
    solve_cost(pairs) <= MOST_COST
}

/// Of one solve, in linear solves without contacts between links: a calm end takes some 50, and a step may need hundreds.
const MOST_COST: u64 = 50;

/// Linear solves that the fallback is expected to take.
const FALLBACK_SOLVES: u32 = 100;

/// What the fallback did with one stage.
#[derive(Debug, Clone, Copy)]
pub struct FallbackResult {
    /// Linear solves, and the contacts between links that are taken into account in each.
    pub solves: u32,
    pub pairs: u32,
    pub status: SolveStatus,
    /// Certified residual \[m/s\] and duality gap \[J\] of the stage as it was before penetrations were allowed.
    pub residual: f64,
    pub gap: f64,
}

impl FallbackResult {
    /// What the fallback cost, in linear solves without contacts between links, times [`IN_VAIN`] where it did not solve the
    /// stage.
    pub fn cost(&self) -> u32 {
        let times = if self.status == SolveStatus::Solved { 1 } else { IN_VAIN };
        fallback_cost(self.solves.saturating_mul(times), self.pairs)
    }
}

impl<T: Real> SolvedStage<T> {
    /// Whether the stage of a lane is solved.
    pub fn is_solved(&self, lane: usize, tolerance: f64) -> bool {
        !is_unsolved(self.outcome.converged.lane(lane), self.residual.lane(lane), tolerance)
    }
}
