//! Friction laws of the minimal model.

use std::f64::consts::FRAC_2_PI;

use nalgebra::Vector2;
use snake_core::scene::{FrictionLawName, SMOOTHING, SceneConfig};

/// The law of dry friction of the minimal model's plant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FrictionLaw {
    /// The exact Coulomb law, the ellipse (T 6.24)-(T 6.25).
    #[default]
    SetValued,
    Smooth(SmoothLaw),
}

impl FrictionLaw {
    /// The law of a scene with its parameter.
    pub fn of(scene: &SceneConfig) -> Self {
        let smoothing = scene.smoothing;
        match scene.friction_law {
            FrictionLawName::SetValued => FrictionLaw::SetValued,
            FrictionLawName::Arctan => FrictionLaw::Smooth(SmoothLaw::Arctan { smoothing }),
            FrictionLawName::Ellipse => FrictionLaw::Smooth(SmoothLaw::Ellipse { smoothing }),
        }
    }
}

/// A smooth approximation of Coulomb friction; each is the gradient of a convex dissipation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SmoothLaw {
    /// (T 6.21): each component on its own, so that forces fill a box. `smoothing` is eps_C \[m/s\].
    Arctan { smoothing: f64 },
    /// -D^2 v / sqrt(v^T D^2 v + eps^2) with D = D_mu_C F_N / 2 (T 6.21 != D20): the smoothed (T 6.25), an ellipse.
    /// `smoothing` is eps, a power \[N m/s\].
    Ellipse { smoothing: f64 },
}

impl SmoothLaw {
    /// The printed law with the printed smoothing: the controller's model.
    pub const PRINTED: Self = Self::Arctan { smoothing: SMOOTHING };

    /// Coulomb force at slip velocity `v`, with `d` the largest force along and across the link.
    pub fn force(self, d: Vector2<f64>, v: Vector2<f64>) -> Vector2<f64> {
        match self {
            // -F_N D_mu_C arctan(v / eps_C) / pi, and d is F_N D_mu_C / 2.
            Self::Arctan { smoothing } => -d.component_mul(&(v / smoothing).map(f64::atan)) * FRAC_2_PI,
            Self::Ellipse { smoothing } => {
                let dv = d.component_mul(&v);
                -d.component_mul(&dv) / dv.norm().hypot(smoothing)
            }
        }
    }
}
