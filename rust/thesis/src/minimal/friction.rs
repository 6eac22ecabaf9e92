//! Friction of one contact point in its link's frame: Coulomb and viscous (T 6.19)-(T 6.26).

use nalgebra::Vector2;

use super::Ground;
use super::SmoothLaw;

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
}
