use super::ConvexSet;

/// A bounded scalar, C = [-limit, limit]: the torque an actuator can give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub limit: f64,
}

impl ConvexSet for Interval {
    type Point = f64;

    fn project(&self, x: f64) -> f64 {
        x.clamp(-self.limit, self.limit)
    }

    fn support(&self, v: f64) -> f64 {
        self.limit * v.abs()
    }
}
