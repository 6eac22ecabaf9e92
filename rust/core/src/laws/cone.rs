use std::ops::AddAssign;

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::ConvexSet;

/// A normal impulse with the friction that it bounds, (normal, along, across): C = {|P_T| <= mu P_N}.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// mu
    pub coefficient: f64,
}

impl Cone {
    /// prox_C(x) and its derivative.
    pub fn evaluate(&self, x: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let (mu, normal, tangential) = (self.coefficient, x.x, x.yz().norm());
        if mu == 0.0 {
            let slope = if normal > 0.0 { 1.0 } else { 0.0 };
            return (Vector3::x() * normal.max(0.0), Matrix3::from_diagonal(&(Vector3::x() * slope)));
        }
        if normal >= 0.0 && tangential <= mu * normal {
            return (*x, Matrix3::identity());
        }
        if mu * tangential <= -normal {
            return (Vector3::zeros(), Matrix3::zeros());
        }
        let out = x.yz() / tangential;
        let (edge, share) = (Vector3::new(1.0, mu * out.x, mu * out.y), 1.0 / (1.0 + mu * mu));
        let load = share * (normal + mu * tangential);
        let mut derivative = edge * edge.transpose() * share;
        let across = (Matrix2::identity() - out * out.transpose()) * (mu * load / tangential);
        derivative.fixed_view_mut::<2, 2>(1, 1).add_assign(&across);
        (edge * load, derivative)
    }
}

impl ConvexSet for Cone {
    type Point = Vector3<f64>;
    type Scalar = f64;

    fn project(&self, x: Vector3<f64>) -> Vector3<f64> {
        self.evaluate(&x).0
    }

    fn support(&self, v: Vector3<f64>) -> f64 {
        if v.x + self.coefficient * v.yz().norm() <= 0.0 { 0.0 } else { f64::INFINITY }
    }
}
