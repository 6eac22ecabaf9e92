//! Rectangles along the axes, which rule out what is far away.

use nalgebra::Vector2;

/// The smallest rectangle along the axes around some points \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    pub low: Vector2<f64>,
    pub high: Vector2<f64>,
}

impl Rectangle {
    pub fn around(points: impl IntoIterator<Item = Vector2<f64>>) -> Self {
        points
            .into_iter()
            .fold(Self::default(), |Self { low, high }, point| Self { low: low.inf(&point), high: high.sup(&point) })
    }

    /// Distance of a point, zero inside \[m\].
    pub fn distance(&self, point: &Vector2<f64>) -> f64 {
        (self.low - point).sup(&(point - self.high)).sup(&Vector2::zeros()).norm()
    }
}

/// Around no point: infinitely far from all.
impl Default for Rectangle {
    fn default() -> Self {
        Self { low: Vector2::repeat(f64::INFINITY), high: Vector2::repeat(f64::NEG_INFINITY) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_point_inside() {
        let rectangle = Rectangle::around([Vector2::new(1.0, 5.0), Vector2::new(3.0, 2.0)]);
        assert_eq!(rectangle.distance(&Vector2::new(2.0, 3.0)), 0.0);
        assert_eq!(rectangle.distance(&Vector2::new(2.0, 6.5)), 1.5);
        assert_eq!(rectangle.distance(&Vector2::new(6.0, -2.0)), 5.0);
        assert_eq!(Rectangle::default().distance(&Vector2::zeros()), f64::INFINITY);
    }
}
