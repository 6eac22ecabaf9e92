use crate::math::Real;

/// How a solve ended, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<T: Real = f64> {
    /// Linear solves, a whole number.
    pub iterations: T,
    /// Whether the solver's own stopping rule was met; the certificate judges independently.
    pub converged: T::Mask,
}
