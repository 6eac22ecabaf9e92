//! Where an episode's robot has to go: over a line, to a point, along a path, or in a direction.
//!
//! Distances are those of the CG of the whole robot. A goal line is crossed along +x, wherever in the
//! corridor; a goal point is reached from any side, so the goal direction is the bearing of the point. Along a path it is
//! the bearing of the point of the path [`LOOK_AHEAD`] before the robot. A direction has no end.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::polyline::Polyline;

/// What has to be reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Target {
    /// The line across a corridor along +x, `distance` \[m\] ahead of the start.
    Line { distance: f64, centre_line: f64 },
    /// The disc of `radius` \[m\] around a point.
    Disc { centre: Vector2<f64>, radius: f64 },
    /// The last `radius` \[m\] of a path that is followed.
    Path { path: Polyline, radius: f64 },
    /// Nothing: the robot goes on at this angle from +x \[rad\].
    Direction { angle: f64 },
}

/// A target as seen from where the episode began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    pub target: Target,
    /// CG at the start \[m\].
    pub origin: Vector2<f64>,
    /// Commanded speed along the goal direction, if there is one \[m/s\].
    pub speed: Option<f64>,
    /// Arc length of the point of a path nearest to the CG, at the start and now; zero without a path \[m\].
    began: f64,
    along: f64,
}

impl Goal {
    /// The goal of a robot whose CG starts at `origin`.
    pub fn new(target: Target, origin: Vector2<f64>, speed: Option<f64>) -> Self {
        let began = match &target {
            Target::Path { path, .. } => path.nearest(origin, 0.0, f64::INFINITY),
            _ => 0.0,
        };
        Self { target, origin, speed, began, along: began }
    }

    /// The centre of the disc, the point where the centre line meets the goal line, or the end of the path; not a number
    /// where the goal is a direction \[m\].
    pub fn point(&self) -> Vector2<f64> {
        match &self.target {
            Target::Line { distance, centre_line } => Vector2::new(self.origin.x + distance, *centre_line),
            Target::Disc { centre, .. } => *centre,
            Target::Path { path, .. } => path.point(path.length()),
            Target::Direction { .. } => Vector2::repeat(f64::NAN),
        }
    }

    /// Radius of the goal around its point; zero for a line, not a number where the goal is a direction \[m\].
    pub fn radius(&self) -> f64 {
        match self.target {
            Target::Disc { radius, .. } | Target::Path { radius, .. } => radius,
            Target::Line { .. } => 0.0,
            Target::Direction { .. } => f64::NAN,
        }
    }

    /// The corners of the path; none without one.
    pub fn path(&self) -> &[Vector2<f64>] {
        match &self.target {
            Target::Path { path, .. } => path.points(),
            _ => &[],
        }
    }

    /// Distance to cover from the start to success; infinite where the goal is a direction \[m\].
    pub fn span(&self) -> f64 {
        match &self.target {
            Target::Line { distance, .. } => *distance,
            Target::Disc { centre, radius } => (centre - self.origin).norm() - radius,
            Target::Path { path, radius } => path.length() - radius - self.began,
            Target::Direction { .. } => f64::INFINITY,
        }
    }

    /// Distance towards the goal that a robot at `position` has covered since the start; along a path, as of the last
    /// [`Goal::advance`] \[m\].
    pub fn covered(&self, position: Vector2<f64>) -> f64 {
        match &self.target {
            Target::Line { .. } => position.x - self.origin.x,
            Target::Disc { centre, .. } => (centre - self.origin).norm() - (centre - position).norm(),
            Target::Path { .. } => self.along - self.began,
            Target::Direction { angle } => ahead(*angle).dot(&(position - self.origin)),
        }
    }

    /// Moves on with the robot; returns what `covered` gains \[m\].
    pub fn advance(&mut self, from: Vector2<f64>, to: Vector2<f64>) -> f64 {
        match &self.target {
            Target::Line { .. } => to.x - from.x,
            Target::Disc { centre, .. } => (centre - from).norm() - (centre - to).norm(),
            Target::Path { path, .. } => {
                let before = self.along;
                self.along = path.nearest(to, before, (to - from).norm() + SEARCH);
                self.along - before
            }
            Target::Direction { angle } => ahead(*angle).dot(&(to - from)),
        }
    }

    /// Angle from +x to the goal direction at `position` \[rad\].
    pub fn bearing(&self, position: Vector2<f64>) -> f64 {
        let towards = |point: Vector2<f64>| (point.y - position.y).atan2(point.x - position.x);
        match &self.target {
            Target::Line { .. } => 0.0,
            Target::Disc { centre, .. } => towards(*centre),
            Target::Path { path, .. } => towards(path.point(self.along + LOOK_AHEAD)),
            Target::Direction { angle } => *angle,
        }
    }

    /// Distance of `position` to the left of the corridor's centre line, of the straight way from the start to the goal
    /// point, of the path, or of the line from the start in the goal direction \[m\].
    pub fn lateral_offset(&self, position: Vector2<f64>) -> f64 {
        match &self.target {
            Target::Line { centre_line, .. } => position.y - centre_line,
            Target::Disc { centre, .. } => {
                let way = centre - self.origin;
                way.perp(&(position - self.origin)) / way.norm()
            }
            Target::Path { path, .. } => path.offset(position, self.along),
            Target::Direction { angle } => ahead(*angle).perp(&(position - self.origin)),
        }
    }

    /// Whether a robot at `position` has left the course: farther than `reach` from the corridor's centre line or from
    /// the path, or farther from the goal point, by as much, than it was at the start. A direction cannot be left.
    pub fn is_left(&self, position: Vector2<f64>, reach: f64) -> bool {
        match self.target {
            Target::Line { .. } | Target::Path { .. } => self.lateral_offset(position).abs() > reach,
            Target::Disc { .. } => self.covered(position) < -reach,
            Target::Direction { .. } => false,
        }
    }
}

fn ahead(angle: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin())
}

/// How far before the robot's CG the point of a path lies that it heads for: a bit more than a third of Aiko's length
/// \[m\].
pub const LOOK_AHEAD: f64 = 0.5;

/// Where a path comes near itself, the CG passes from one part to the next only over this length of it \[m\].
const SEARCH: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn disc() -> Goal {
        Goal::new(Target::Disc { centre: Vector2::new(1.0, 3.0), radius: 0.25 }, Vector2::new(1.0, 1.0), None)
    }

    #[test]
    fn a_disc_is_reached_exactly_at_its_rim() {
        let goal = disc();
        for angle in [0.0f64, 1.0, 2.0, 4.0] {
            let at = |distance: f64| Vector2::new(1.0, 3.0) + distance * Vector2::new(angle.cos(), angle.sin());
            assert!(goal.covered(at(0.2499)) > goal.span());
            assert!(goal.covered(at(0.2501)) < goal.span());
        }
    }

    #[test]
    fn left_of_the_way_is_positive_and_the_bearing_points_at_the_goal() {
        let goal = disc();
        // The way leads along +y: its left is -x.
        assert!((goal.lateral_offset(Vector2::new(0.7, 2.0)) - 0.3).abs() < 1e-15);
        assert!((goal.bearing(Vector2::new(-1.0, 3.0))).abs() < 1e-15);
        assert!(!goal.is_left(Vector2::new(1.0, 0.5), 0.6) && goal.is_left(Vector2::new(1.0, 0.3), 0.6));
    }

    /// Along +x, then along +y.
    fn corner() -> Goal {
        let points = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]].map(Vector2::from);
        let path = Polyline::new(points.to_vec()).unwrap();
        Goal::new(Target::Path { path, radius: 0.25 }, Vector2::new(0.5, 0.2), None)
    }

    #[test]
    fn a_path_is_covered_along_its_segments() {
        let mut goal = corner();
        assert!((goal.span() - 3.25).abs() < 1e-15 && (goal.lateral_offset(goal.origin) - 0.2).abs() < 1e-15);
        assert!((goal.bearing(goal.origin) - (-0.2f64).atan2(0.5)).abs() < 1e-15);
        let mut from = goal.origin;
        for k in 1..=40 {
            let to = corner_at(0.5 + 0.08 * f64::from(k));
            goal.advance(from, to);
            from = to;
        }
        assert!((goal.covered(from) - 3.2).abs() < 1e-12 && goal.lateral_offset(from).abs() < 1e-12);
        assert!((goal.bearing(from) - 0.5 * std::f64::consts::PI).abs() < 1e-12, "the end of the path lies ahead");
        assert!(goal.is_left(Vector2::new(1.1, 1.7), 0.8) && !goal.is_left(Vector2::new(1.3, 1.7), 0.8));
    }

    fn corner_at(along: f64) -> Vector2<f64> {
        if along < 2.0 { Vector2::new(along, 0.0) } else { Vector2::new(2.0, along - 2.0) }
    }

    #[test]
    fn a_direction_has_no_end_and_is_never_left() {
        let goal = Goal::new(Target::Direction { angle: 1.2 }, Vector2::new(1.0, -1.0), Some(0.1));
        let there = goal.origin + 3.0 * ahead(1.2) + 0.4 * Vector2::new(-(1.2f64).sin(), (1.2f64).cos());
        assert!((goal.covered(there) - 3.0).abs() < 1e-15 && (goal.lateral_offset(there) - 0.4).abs() < 1e-15);
        assert!(goal.span().is_infinite() && !goal.is_left(there, 0.1) && goal.bearing(there) == 1.2);
    }

    proptest! {
        #[test]
        fn progress_adds_up_to_the_distance_covered(
            path in proptest::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 1..9), kind in 0..4,
        ) {
            let mut goal = match kind {
                0 => Goal::new(Target::Line { distance: 2.0, centre_line: 0.1 }, Vector2::new(1.0, 1.0), None),
                1 => disc(),
                2 => corner(),
                _ => Goal::new(Target::Direction { angle: 2.0 }, Vector2::new(1.0, 1.0), None),
            };
            let mut position = goal.origin;
            let mut sum = 0.0;
            for (x, y) in path {
                sum += goal.advance(position, Vector2::new(x, y));
                position = Vector2::new(x, y);
            }
            prop_assert!((sum - goal.covered(position)).abs() < 1e-12);
        }
    }
}
