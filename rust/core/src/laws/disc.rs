use nalgebra::Vector2;

use super::ConvexSet;

/// Isotropic Coulomb friction, C_T1 = {|lambda| <= radius} (T 3.61).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    pub radius: f64,
}

impl ConvexSet for Disc {
    type Point = Vector2<f64>;

    fn project(&self, x: Vector2<f64>) -> Vector2<f64> {
        let norm = x.norm();
        if norm <= self.radius { x } else { x * (self.radius / norm) }
    }

    fn support(&self, v: Vector2<f64>) -> f64 {
        self.radius * v.norm()
    }
}
