//! How one robot of a fleet differs from the plant that all share.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Factors on quantities of the plant; one leaves them as they are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// Mass and inertia of all links, and with them the friction bounds.
    pub mass: f64,
    /// Friction coefficients mu_Tx, mu_Ty.
    pub friction: Vector2<f64>,
    /// Largest torque of a joint.
    pub torque_limit: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self { mass: 1.0, friction: Vector2::new(1.0, 1.0), torque_limit: 1.0 }
    }
}
