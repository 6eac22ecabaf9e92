//! A path of straight segments in the plane.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, coordinate, require};

/// Two points or more, no two in a row the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polyline {
    points: Vec<Vector2<f64>>,
}

impl Polyline {
    /// # Errors
    /// Names the point that is not finite, or the same as the one before, or says that there are fewer than two.
    pub fn new(points: Vec<Vector2<f64>>) -> Result<Self, ConfigError> {
        let count = points.len();
        require(count >= 2, "path", format!("{count} points"), "2 points or more")?;
        for (k, point) in points.iter().enumerate() {
            point.iter().try_for_each(|value| coordinate(&format!("path[{k}]"), *value).map(drop))?;
            let differs = k == 0 || (point - points[k - 1]).norm() > 0.0;
            require(differs, &format!("path[{k}]"), format!("{:?}", [point.x, point.y]), "another point than before")?;
        }
        Ok(Self { points })
    }

    pub fn points(&self) -> &[Vector2<f64>] {
        &self.points
    }

    /// \[m\]
    pub fn length(&self) -> f64 {
        self.segments().map(|(from, to)| (to - from).norm()).sum()
    }

    /// The point at an arc length, or the nearer end \[m\].
    pub fn point(&self, along: f64) -> Vector2<f64> {
        let mut left = along.max(0.0);
        for (from, to) in self.segments() {
            let length = (to - from).norm();
            if left <= length {
                return from + (to - from) * (left / length);
            }
            left -= length;
        }
        self.points[self.points.len() - 1]
    }

    /// Arc length of the point nearest to `position`, among those no farther than `reach` from arc length `around` along
    /// the path; the first of several \[m\].
    pub fn nearest(&self, position: Vector2<f64>, around: f64, reach: f64) -> f64 {
        let (mut start, mut best, mut distance) = (0.0, around, f64::INFINITY);
        for (from, to) in self.segments() {
            let length = (to - from).norm();
            let (first, last) = ((around - reach - start).max(0.0), (around + reach - start).min(length));
            if first <= last {
                let along = ((position - from).dot(&(to - from)) / length).clamp(first, last);
                let apart = (from + (to - from) * (along / length) - position).norm();
                if apart < distance {
                    (best, distance) = (start + along, apart);
                }
            }
            start += length;
        }
        best
    }

    /// Distance of `position` from the point at an arc length, positive to the left of the path there \[m\].
    pub fn offset(&self, position: Vector2<f64>, along: f64) -> f64 {
        let arm = position - self.point(along);
        let ahead = self.point(along + SHORT) - self.point(along - SHORT);
        arm.norm().copysign(ahead.perp(&arm))
    }

    fn segments(&self) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
        self.points.windows(2).map(|pair| (pair[0], pair[1]))
    }
}

/// Length over which the direction of the path is taken, so that it turns at a corner \[m\].
const SHORT: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    /// A hairpin whose arms are 0.1 m apart.
    fn hairpin() -> Polyline {
        let points = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.1], [0.0, 0.1]];
        Polyline::new(points.map(Vector2::from).to_vec()).unwrap()
    }

    #[test]
    fn points_lie_at_their_arc_length() {
        let path = hairpin();
        assert!((path.length() - 4.1).abs() < 1e-15);
        assert!((path.point(2.05) - Vector2::new(2.0, 0.05)).norm() < 1e-12);
        assert_eq!(path.point(-1.0), Vector2::new(0.0, 0.0));
        assert_eq!(path.point(9.0), Vector2::new(0.0, 0.1));
    }

    #[test]
    fn the_nearest_point_stays_on_its_arm_of_a_hairpin() {
        let path = hairpin();
        let between = Vector2::new(1.0, 0.06);
        assert!((path.nearest(between, 0.0, f64::INFINITY) - 3.1).abs() < 1e-12, "the nearer arm");
        assert!((path.nearest(between, 1.0, 0.2) - 1.0).abs() < 1e-12, "the arm that it is on");
    }

    #[test]
    fn offsets_have_signs() {
        let path = hairpin();
        assert!((path.offset(Vector2::new(1.0, 0.03), 1.0) - 0.03).abs() < 1e-15);
        assert!((path.offset(Vector2::new(1.0, 0.13), 3.1) + 0.03).abs() < 1e-12);
    }

    #[test]
    fn a_path_needs_two_different_points() {
        let refused = |points: &[[f64; 2]]| {
            Polyline::new(points.iter().copied().map(Vector2::from).collect()).map_err(|error| error.field).unwrap_err()
        };
        assert_eq!(refused(&[[0.0, 0.0]]), "path");
        assert_eq!(refused(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), "path[2]");
        assert_eq!(refused(&[[0.0, f64::NAN], [1.0, 0.0]]), "path[0]");
    }
}
