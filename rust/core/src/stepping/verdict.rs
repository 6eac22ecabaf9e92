//! What *residual*, *unconverged* and *fallback* mean, for all models.
//!
//! * The **residual** of a stage is what the model's certificate finds: the worst violation of any law of the stage by
//!   the solution, as a velocity \[m/s\]. It is computed by code that no solver uses.
//! * A stage is **solved** if its solver met its own stopping rule and the residual is at most
//!   [`Model::RESIDUAL_FACTOR`] times the tolerance. A residual that is not a number solves nothing.
//! * A stage that Newton's method did not solve is given to the **fallback**, one robot at a time. The fallback counts
//!   in `fallbacks` whether or not it succeeds.
//! * A stage is **unconverged** if the fallback did not solve it either, or could not be tried because the stage itself
//!   has a value that is not finite. The minimal model has no fallback because its stages have no contacts: a stage
//!   whose residual is above [`crate::solver::RESIDUAL_LIMIT`] times the tolerance is solved again from its solution,
//!   with the tolerance divided by that factor.
//!
//! The factor relates two norms: solvers bound velocities in the norm of the kinetic energy of all links, certificates
//! check every law and every link separately, relative to its own mass and inertia. In the plane solutions meet their
//! tolerance in both norms but for rare stages, and the factor is 1: those go to the fallback. In 3D, with two contacts
//! and six balances per link, the certificate is commonly above the tolerance where the velocities are not, and the
//! factor is [`crate::solver::RESIDUAL_LIMIT`]. A solution of a fallback counts as solved up to that limit in both.

use crate::math::{Mask, Real};
use crate::solver::{SolveStatus, is_unconverged};

use super::model::Model;
use super::stage::SolvedStage;

/// What the fallback did with one stage.
#[derive(Debug, Clone, Copy)]
pub struct FallbackResult {
    /// Linear solves.
    pub solves: u32,
    pub status: SolveStatus,
    /// Certified residual \[m/s\] and duality gap \[J\] of the stage as it was before penetrations were allowed.
    pub residual: f64,
    pub gap: f64,
}

impl<T: Real> SolvedStage<T> {
    /// Whether the stage of a lane is solved.
    pub fn is_solved<M: Model>(&self, lane: usize, tolerance: f64) -> bool {
        let (converged, residual) = (self.outcome.converged.lane(lane), self.residual.lane(lane));
        !is_unconverged(converged, residual, M::RESIDUAL_FACTOR * tolerance)
    }
}
