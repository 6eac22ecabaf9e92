//! How one robot of a fleet differs from the plant that all share.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Factors on quantities of the shared plant, 1 for no change, and additions to others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantParameters {
    /// Mass and inertia of all links, and with them the friction bounds.
    pub mass: f64,
    /// Friction coefficients mu_Tx, mu_Ty.
    pub friction: Vector2<f64>,
    /// Largest torque of a joint.
    pub torque_limit: f64,
    /// Backlash of the joints beyond the plant's \[rad\].
    pub backlash: f64,
    /// Drop of friction in sliding beyond the plant's, see [`crate::laws::Stribeck`].
    pub stribeck: f64,
}

impl Default for PlantParameters {
    fn default() -> Self {
        let friction = Vector2::new(1.0, 1.0);
        Self { mass: 1.0, friction, torque_limit: 1.0, backlash: 0.0, stribeck: 0.0 }
    }
}
