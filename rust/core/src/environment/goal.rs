//! Where an episode's robot has to go: over a line, or to a point.
//!
//! Distances are those of the CG of the whole robot. A goal line is crossed along +x, wherever in the
//! corridor; a goal point is reached from any side, so the goal direction is the bearing of the point.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// What has to be reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Target {
    /// The line across a corridor along +x, `distance` \[m\] ahead of the start.
    Line { distance: f64, centre_line: f64 },
    /// The disc of `radius` \[m\] around a point.
    Disc { centre: Vector2<f64>, radius: f64 },
}

/// A target as seen from where the episode began.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    pub target: Target,
    /// CG at the start \[m\].
    pub origin: Vector2<f64>,
}

impl Goal {
    /// Distance to cover from the start to success \[m\].
    pub fn span(&self) -> f64 {
        match self.target {
            Target::Line { distance, .. } => distance,
            Target::Disc { centre, radius } => (centre - self.origin).norm() - radius,
        }
    }

    /// Distance towards the goal that a robot at `position` has covered since the start \[m\].
    pub fn covered(&self, position: Vector2<f64>) -> f64 {
        match self.target {
            Target::Line { .. } => position.x - self.origin.x,
            Target::Disc { centre, .. } => (centre - self.origin).norm() - (centre - position).norm(),
        }
    }

    /// What `covered` gains between two positions \[m\].
    pub fn progress(&self, from: Vector2<f64>, to: Vector2<f64>) -> f64 {
        match self.target {
            Target::Line { .. } => to.x - from.x,
            Target::Disc { centre, .. } => (centre - from).norm() - (centre - to).norm(),
        }
    }

    /// Angle from +x to the goal direction at `position` \[rad\].
    pub fn bearing(&self, position: Vector2<f64>) -> f64 {
        match self.target {
            Target::Line { .. } => 0.0,
            Target::Disc { centre, .. } => (centre.y - position.y).atan2(centre.x - position.x),
        }
    }

    /// Distance of `position` to the left of the corridor's centre line, or of the straight way from
    /// the start to the goal point \[m\].
    pub fn lateral_offset(&self, position: Vector2<f64>) -> f64 {
        match self.target {
            Target::Line { centre_line, .. } => position.y - centre_line,
            Target::Disc { centre, .. } => {
                let way = centre - self.origin;
                way.perp(&(position - self.origin)) / way.norm()
            }
        }
    }

    /// Whether a robot at `position` has gone astray: farther than `reach` from the corridor's centre line,
    /// or farther from the goal point, by as much, than it was at the start.
    pub fn is_left(&self, position: Vector2<f64>, reach: f64) -> bool {
        match self.target {
            Target::Line { .. } => self.lateral_offset(position).abs() > reach,
            Target::Disc { .. } => self.covered(position) < -reach,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn disc() -> Goal {
        Goal { target: Target::Disc { centre: Vector2::new(1.0, 3.0), radius: 0.25 }, origin: Vector2::new(1.0, 1.0) }
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

    proptest! {
        #[test]
        fn progress_adds_up_to_the_distance_covered(
            path in proptest::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 1..9), on_a_line: bool,
        ) {
            let target = Target::Line { distance: 2.0, centre_line: 0.1 };
            let goal = if on_a_line { Goal { target, ..disc() } } else { disc() };
            let mut position = goal.origin;
            let mut sum = 0.0;
            for (x, y) in path {
                sum += goal.progress(position, Vector2::new(x, y));
                position = Vector2::new(x, y);
            }
            prop_assert!((sum - goal.covered(position)).abs() < 1e-12);
        }
    }
}
