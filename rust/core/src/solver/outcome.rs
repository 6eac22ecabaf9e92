use crate::math::Real;

/// How a solve ended, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<T: Real = f64> {
    /// Linear solves, a whole number.
    pub iterations: T,
    /// Whether the solver's own stopping rule was met; the certificate does not depend on it.
    pub converged: T::Mask,
}

/// Result of a fallback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// The stage is solved: within its tolerance that may be with recovery of penetration switched off.
    Solved,
    /// The contacts contradict each other: no velocity opens all of them as fast as their penetration demands, or none under
    /// forces that are not absurd. The stage is solved with recovery of penetration switched off.
    Relaxed,
    /// The best solution found is not within its tolerance.
    Unsolved,
}

/// Ratio from which impulses at contacts are those of links that are wedged: to what the robot needs for the speed at which
/// its contacts are to open, and to the impulses where none is to open. Contacts that contradict each other leave little
/// under forces that are large enough.
pub(crate) const STRAIN: f64 = 100.0;

/// Residual up to which only round-off keeps a stage from an exact solution \[m/s\].
pub(crate) const EXACT: f64 = 1e-8;

/// Of all contacts with obstacles and between links \[N s\].
pub(crate) fn greatest_impulse(contact: &[f64], pair: &[f64]) -> f64 {
    contact.iter().chain(pair).copied().fold(0.0, f64::max)
}

/// Largest residual over the tolerance of a stage that a fallback solved: solvers bound velocities in the norm of the
/// energy, certificates check every link separately.
pub const RESIDUAL_LIMIT: f64 = 100.0;

/// Largest residual of a stage of this tolerance that a fallback solved \[m/s\]: [`RESIDUAL_LIMIT`] tolerances, but no more
/// than 0.1 mm/s unless the tolerance itself is looser.
pub fn residual_limit(tolerance: f64) -> f64 {
    (RESIDUAL_LIMIT * tolerance).min(LARGEST_RESIDUAL).max(tolerance)
}

/// \[m/s\]
const LARGEST_RESIDUAL: f64 = 1e-4;

/// Whether the solver left a stage unsolved: its stopping rule was not met, or the certificate's residual \[m/s\] exceeds
/// `limit` or is NaN. The caller hands such a stage to the fallback, if it has one.
pub fn is_unsolved(converged: bool, residual: f64, limit: f64) -> bool {
    !converged || residual.is_nan() || residual > limit
}
