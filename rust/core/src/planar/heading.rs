use nalgebra::Vector2;

/// Direction of a link: cosine and sine of its absolute angle, R_B^I (T 3.7).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Heading {
    pub cos: f64,
    pub sin: f64,
}

impl Heading {
    pub fn of(theta: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        Self { cos, sin }
    }

    /// e_x^B, along the link towards the next one.
    pub fn axial(&self) -> Vector2<f64> {
        Vector2::new(self.cos, self.sin)
    }

    /// e_y^B, across the link.
    pub fn lateral(&self) -> Vector2<f64> {
        Vector2::new(-self.sin, self.cos)
    }

    /// R_B^I v: from the link's frame to the world.
    pub fn to_world(&self, v: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.cos * v.x - self.sin * v.y, self.sin * v.x + self.cos * v.y)
    }

    /// (R_B^I)^T v: from the world to the link's frame; gamma_T of (T 3.31)-(T 3.32).
    pub fn to_link(&self, v: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.cos * v.x + self.sin * v.y, self.cos * v.y - self.sin * v.x)
    }
}
