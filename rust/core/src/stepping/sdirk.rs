//! Coefficients of the two-stage SDIRK scheme that all models use.

use std::f64::consts::FRAC_1_SQRT_2;

/// gamma = 1 - 1/sqrt 2, for which it is of order 2 and L-stable.
pub const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// (1 - gamma) / gamma: weight of the first stage's impulses in the whole step.
pub const EXTRAPOLATION: f64 = (1.0 - GAMMA) / GAMMA;
