//! Friction of one contact point in its link's frame: Coulomb and viscous (T 6.19)-(T 6.26).

use std::f64::consts::FRAC_2_PI;

use nalgebra::{Matrix2, Vector2};

use super::Ground;

/// Strength of the friction of one contact point, which carries F_N / 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// D_mu_C F_N / 2: largest Coulomb force along and across the link (T 6.22) \[N\].
    pub coulomb: Vector2<f64>,
    /// D_mu_V F_N / 2: viscous force per slip velocity (T 6.26) \[N s/m\].
    pub viscous: Vector2<f64>,
}

impl Friction {
    /// Friction under the normal force `weight` \[N\].
    pub fn of_point(weight: f64, ground: &Ground) -> Self {
        Self { coulomb: Vector2::from(ground.coulomb) * weight, viscous: Vector2::from(ground.viscous) * weight }
    }

    /// F^P = F^C + F^V of a smooth law at slip velocity `v` (T 6.19) \[N\].
    pub fn force(&self, law: SmoothLaw, v: Vector2<f64>) -> Vector2<f64> {
        law.force(self.coulomb, v) - self.viscous.component_mul(&v)
    }

    /// -dF^P/dv, symmetric and positive semidefinite \[N s/m\].
    pub fn damping(&self, law: SmoothLaw, v: Vector2<f64>) -> Matrix2<f64> {
        law.damping(self.coulomb, v) + Matrix2::from_diagonal(&self.viscous)
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
    /// eps_C of (T Table 7.2).
    pub const SMOOTHING: f64 = 1e-3;

    /// The printed law with the printed smoothing: the controller's model.
    pub const PRINTED: Self = Self::Arctan { smoothing: Self::SMOOTHING };

    /// Coulomb force at slip velocity `v`, with `d` the largest force along and across the link.
    fn force(self, d: Vector2<f64>, v: Vector2<f64>) -> Vector2<f64> {
        match self {
            // -F_N D_mu_C arctan(v / eps_C) / pi, and d is F_N D_mu_C / 2.
            Self::Arctan { smoothing } => -d.component_mul(&(v / smoothing).map(f64::atan)) * FRAC_2_PI,
            Self::Ellipse { smoothing } => {
                let dv = d.component_mul(&v);
                -d.component_mul(&dv) / dv.norm().hypot(smoothing)
            }
        }
    }

    fn damping(self, d: Vector2<f64>, v: Vector2<f64>) -> Matrix2<f64> {
        match self {
            Self::Arctan { smoothing } => {
                let slope = v.map(|v| FRAC_2_PI / (smoothing * (1.0 + (v / smoothing).powi(2))));
                Matrix2::from_diagonal(&d.component_mul(&slope))
            }
            Self::Ellipse { smoothing } => {
                let dv = d.component_mul(&v);
                let size = dv.norm().hypot(smoothing);
                let p = dv / size;
                let d = Matrix2::from_diagonal(&d);
                d * (Matrix2::identity() - p * p.transpose()) * d / size
            }
        }
    }
}
