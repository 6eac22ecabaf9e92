//! Requirements, and messages for those that are violated.

use serde::Serialize;

use crate::figures::{FLAGGED_DEPTH, Figures};

/// Bounds of a scenario; figures with an infinite bound are reported but not tested.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    /// Deepest penetration \[m\] of a robot that is not flagged; where it is not tested, passing through obstacles is not
    /// tested either.
    pub penetration: f64,
    /// Energy created over all energy turned over.
    pub energy: f64,
    /// Creep \[m\].
    pub drift: f64,
    /// Stages that stay unconverged.
    pub unconverged: u64,
    /// Largest residual of a stage that is not counted \[m/s\]: in the plane [`snake_core::solver::residual_limit`].
    pub residual: f64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { penetration: 1.01 * FLAGGED_DEPTH, energy: 0.1, drift: f64::INFINITY, unconverged: 0, residual: 1e-4 }
    }
}

/// Lists the bounds that `figures` violate, and the requirements of all scenarios: states are plausible, joints closed,
/// and every stage is certified or counted.
pub fn broken(figures: &Figures, bounds: &Bounds) -> Vec<String> {
    let mut broken = Vec::new();
    let mut at_most = |what: &str, value: f64, bound: f64| {
        if value.is_nan() || value > bound {
            broken.push(format!("{what} {value:.1e} > {bound:.1e}"));
        }
    };
    at_most("broken states", figures.broken as f64, 0.0);
    at_most("residual [m/s]", figures.residual, bounds.residual);
    at_most("unconverged", figures.unconverged as f64, bounds.unconverged as f64);
    at_most("joint gap [m]", figures.joint_gap, JOINT_GAP);
    at_most("skew", figures.skew, SKEW);
    at_most("penetration [m]", figures.penetration, bounds.penetration);
    at_most("tunnels", figures.tunnels as f64, if bounds.penetration.is_finite() { 0.0 } else { f64::INFINITY });
    at_most("energy created", figures.relative_created, bounds.energy);
    at_most("drift [m]", figures.drift, bounds.drift);
    broken
}

/// Joints are eliminated, not solved for: what is left is the round-off of positions of metres \[m\].
const JOINT_GAP: f64 = 1e-11;

/// Link 1 is normalised in every step, the others follow from it: round-off of as many products as there are joints.
const SKEW: f64 = 1e-13;
