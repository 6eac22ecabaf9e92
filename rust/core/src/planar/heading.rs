use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::math::Real;
use crate::rows::Saved;

/// Direction of a link: cosine and sine of its absolute angle, R_B^I (T 3.7).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct Heading<T = f64> {
    pub cos: T,
    pub sin: T,
}

impl<T: Real> Heading<T> {
    #[inline(always)]
    pub fn of(theta: T) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { cos, sin }
    }

    /// e_x^B, along the link towards the next one.
    #[inline(always)]
    pub fn axial(&self) -> Vector2<T> {
        Vector2::new(self.cos, self.sin)
    }

    /// e_y^B, across the link.
    #[inline(always)]
    pub fn lateral(&self) -> Vector2<T> {
        Vector2::new(-self.sin, self.cos)
    }

    /// R_B^I v: from the link's frame to the world.
    #[inline(always)]
    pub fn to_world(&self, v: Vector2<T>) -> Vector2<T> {
        Vector2::new(self.sin.subtract_from(v.y, self.cos * v.x), self.sin.mul_add(v.x, self.cos * v.y))
    }

    /// (R_B^I)^T v: from the world to the link's frame; gamma_T of (T 3.31)-(T 3.32).
    #[inline(always)]
    pub fn to_link(&self, v: Vector2<T>) -> Vector2<T> {
        Vector2::new(self.sin.mul_add(v.y, self.cos * v.x), self.sin.subtract_from(v.x, self.cos * v.y))
    }

    /// The direction seen in the frame of `other`: cosine and sine of the difference of the angles.
    #[inline(always)]
    pub fn relative_to(&self, other: &Self) -> Self {
        Self { cos: other.cos * self.cos + other.sin * self.sin, sin: other.cos * self.sin - other.sin * self.cos }
    }
}
