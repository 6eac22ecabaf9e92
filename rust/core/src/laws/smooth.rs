use std::f64::consts::FRAC_2_PI;

use nalgebra::{Matrix2, Vector2};

use crate::math::Real;

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

    /// One component of [`Self::PRINTED`] in lanes: the force at the slip velocity `slip`, with `d` the largest one.
    #[inline(always)]
    pub fn printed_force<T: Real>(d: T, slip: T) -> T {
        -d * ((slip * T::splat(1.0 / Self::SMOOTHING)).arctangent() * T::splat(FRAC_2_PI))
    }

    /// -dF/dv, symmetric and positive semidefinite \[N s/m\].
    pub fn damping(self, d: Vector2<f64>, v: Vector2<f64>) -> Matrix2<f64> {
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
