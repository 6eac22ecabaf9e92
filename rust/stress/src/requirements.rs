//! What must hold, and what is said where it does not.

use serde::Serialize;

use crate::figures::Figures;
use snake_core::solver::RESIDUAL_LIMIT;

/// Bounds of a scenario; what is infinite is reported and not judged.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    /// Deepest penetration \[m\] of links that travel little in a step; where it is not judged, no more is which side
    /// of a peg they are on.
    pub penetration: f64,
    /// Energy that came from nowhere over all energy turned over.
    pub energy: f64,
    /// Creep \[m\].
    pub drift: f64,
    /// Stages that no solver closed.
    pub misses: u64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { penetration: 0.002, energy: 0.1, drift: f64::INFINITY, misses: 0 }
    }
}

/// Names what `figures` break of the bounds and of what holds everywhere: states are sane, joints closed, and every
/// stage has its certificate or is counted.
pub fn broken(figures: &Figures, bounds: &Bounds) -> Vec<String> {
    let mut broken = Vec::new();
    let mut at_most = |what: &str, value: f64, bound: f64| {
        if value.is_nan() || value > bound {
            broken.push(format!("{what} {value:.1e} > {bound:.1e}"));
        }
    };
    at_most("broken states", figures.broken as f64, 0.0);
    at_most("residual [m/s]", figures.residual, RESIDUAL);
    at_most("misses", figures.misses as f64, bounds.misses as f64);
    at_most("joint gap [m]", figures.joint_gap, JOINT_GAP);
    at_most("skew", figures.skew, SKEW);
    at_most("penetration [m]", figures.penetration, bounds.penetration.max(sagitta(figures.travel)));
    let judged = figures.travel < WIDTH && bounds.penetration.is_finite();
    at_most("tunnels", figures.tunnels as f64, if judged { 0.0 } else { f64::INFINITY });
    at_most("energy created", figures.relative_created, bounds.energy);
    at_most("drift [m]", figures.drift, bounds.drift);
    broken
}

/// How deep a way of this length may cut into a cap of a link: contacts are planes, a step long \[m\].
fn sagitta(travel: f64) -> f64 {
    travel * travel / WIDTH
}

/// Width of a link of Aiko \[m\].
const WIDTH: f64 = 0.105;

/// Largest residual of a stage that is not counted \[m/s\]: `RESIDUAL_LIMIT` times the loosest tolerance of any case.
const RESIDUAL: f64 = RESIDUAL_LIMIT * 1e-6;

/// Joints are eliminated, not solved for: what is left is the round-off of positions of metres \[m\].
const JOINT_GAP: f64 = 1e-11;

/// Link 1 is normalised in every step, the others follow from it: round-off of as many products as there are joints.
const SKEW: f64 = 1e-13;
