use super::ConvexSet;

/// Unilateral contact, C_H = {lambda >= 0} (T 3.56)-(T 3.59).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonNegative;

impl ConvexSet for NonNegative {
    type Point = f64;

    fn project(&self, x: f64) -> f64 {
        x.max(0.0)
    }

    fn support(&self, v: f64) -> f64 {
        if v <= 0.0 { 0.0 } else { f64::INFINITY }
    }
}
