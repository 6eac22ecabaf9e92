//! What must hold, and what is said where it does not.

use serde::Serialize;
use snake_core::planar::SLACK;

use crate::figures::Figures;

/// Bounds of a scenario; what is infinite is reported and not judged.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Bounds {
    /// Deepest penetration \[m\], over all times or, for a start inside a peg, at the end.
    pub penetration: f64,
    /// Energy that came from nowhere over all energy turned over.
    pub energy: f64,
    /// Creep \[m\].
    pub drift: f64,
    /// Links that passed a peg.
    pub tunnels: u64,
    /// Stages that no solver closed.
    pub misses: u64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { penetration: 0.002, energy: 0.1, drift: f64::INFINITY, tunnels: 0, misses: 0 }
    }
}

/// Names what `figures` break of the bounds and of what holds everywhere: states are sane, joints closed, and every
/// stage has its certificate or is counted.
pub fn broken(figures: &Figures, bounds: &Bounds) -> Vec<String> {
    let mut broken = Vec::new();
    let mut at_most = |what: &str, value: f64, bound: f64| {
        // Not at most, rather than above: NaN breaks every bound.
        if !(value <= bound) {
            broken.push(format!("{what} {value:.1e} > {bound:.1e}"));
        }
    };
    at_most("broken states", figures.broken as f64, 0.0);
    at_most("residual [m/s]", figures.residual, RESIDUAL);
    at_most("misses", figures.misses as f64, bounds.misses as f64);
    at_most("joint gap [m]", figures.joint_gap, JOINT_GAP);
    at_most("penetration [m]", figures.penetration, bounds.penetration);
    at_most("tunnels", figures.tunnels as f64, bounds.tunnels as f64);
    at_most("energy created", figures.relative_created, bounds.energy);
    at_most("drift [m]", figures.drift, bounds.drift);
    broken
}

/// Largest residual of a stage that is not counted \[m/s\]: `SLACK` times the loosest tolerance of any case.
const RESIDUAL: f64 = SLACK * 1e-6;

/// Joints are eliminated, not solved for: what is left is the round-off of positions of metres \[m\].
const JOINT_GAP: f64 = 1e-11;
