use nalgebra::Vector2;

use super::{ConvexSet, Interval};

/// Orthotropic Coulomb friction, C_T2 = {(x / a_x)^2 + (y / a_y)^2 <= 1} (T 3.63 != D4).
///
/// Either semi-axis may be zero: the set is then a segment, or only the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Semi-axes along e_x^B and e_y^B.
    pub axes: Vector2<f64>,
}

impl ConvexSet for Ellipse {
    type Point = Vector2<f64>;
    type Scalar = f64;

    /// The nearest point to round-off.
    ///
    /// Outside, the nearest point is `a^2 x / (t + a^2)` component by component, where `t > 0` is the
    /// root of the convex, decreasing `f(t) = (a_x x / (t + a_x^2))^2 + (a_y y / (t + a_y^2))^2 - 1`.
    /// Newton's method started left of the root climbs to it monotonically; the start at which one
    /// of the two terms equals 1 keeps `f` below 1, so a handful of steps suffices.
    fn project(&self, x: Vector2<f64>) -> Vector2<f64> {
        let a = self.axes;
        if a.x == a.y {
            return super::Disc { radius: a.x }.project(x);
        }
        if a.x == 0.0 || a.y == 0.0 {
            return x.zip_map(&a, |x, limit| Interval { limit }.project(x));
        }
        if x.component_div(&a).norm_squared() <= 1.0 {
            return x;
        }
        // Lengths relative to the larger axis, so that squares neither overflow nor vanish.
        let scale = a.max();
        let (a, x) = (a / scale, x / scale);
        let squares = a.component_mul(&a);
        let numerator = a.component_mul(&x.abs());
        let mut t = (numerator - squares).max().max(0.0);
        for _ in 0..MAX_NEWTON_STEPS {
            let denominator = squares.add_scalar(t);
            let ratio = numerator.component_div(&denominator);
            let value = ratio.norm_squared() - 1.0;
            let slope = -2.0 * ratio.component_mul(&ratio).component_div(&denominator).sum();
            let next = t - value / slope;
            if next <= t {
                break;
            }
            t = next;
        }
        x.component_mul(&squares).component_div(&squares.add_scalar(t)) * scale
    }

    fn support(&self, v: Vector2<f64>) -> f64 {
        self.axes.component_mul(&v).norm()
    }
}

/// Monotone convergence ends after 5 to 10 steps; the bound only guards against NaN.
const MAX_NEWTON_STEPS: usize = 100;
