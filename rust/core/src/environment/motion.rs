//! Motion of the robot as a whole: centre of gravity and mean body direction.

use std::f64::consts::PI;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::planar::{Heading, PlanarState};
use crate::robot::Robot;

/// Where the whole robot is and how it moves; the goal direction is +x of the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Centre of gravity of all links \[m\].
    pub position: Vector2<f64>,
    /// Its velocity \[m/s\].
    pub velocity: Vector2<f64>,
    /// Angle from the goal direction to the mean body direction, in \[-pi, pi\] \[rad\].
    ///
    /// Link 1 leads, so the body direction is minus the mean of e_x^B over the links.
    pub heading: f64,
    /// Mean angular velocity of the links \[rad/s\].
    pub yaw_rate: f64,
}

impl Motion {
    pub fn of(robot: &Robot, state: &PlanarState) -> Self {
        let (mut position, mut velocity) = (Vector2::zeros(), Vector2::zeros());
        let (mut direction, mut yaw_rate) = (Vector2::zeros(), 0.0);
        for ((link, q), u) in robot.links.iter().zip(&state.pose).zip(&state.twist) {
            position += link.mass * q.xy();
            velocity += link.mass * u.xy();
            direction -= Heading::of(q.z).axial();
            yaw_rate += u.z;
        }
        let mass = robot.total_mass();
        Self {
            position: position / mass,
            velocity: velocity / mass,
            heading: direction.y.atan2(direction.x),
            yaw_rate: yaw_rate / robot.link_count() as f64,
        }
    }
}

/// The angle in \[-pi, pi\].
pub fn wrap_angle(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::{Pose, Twist};
    use crate::robot::RobotConfig;

    #[test]
    fn a_stretched_robot_that_drives_ahead_moves_along_its_heading() {
        let robot = Robot::new(&RobotConfig { links: 3, ..RobotConfig::default() }).unwrap();
        let ahead = 0.3f64;
        let mut state = PlanarState::zero(3);
        for i in 0..3 {
            let behind = 0.122 * i as f64;
            state.pose[i] = Pose::new(-behind * ahead.cos(), -behind * ahead.sin(), ahead + PI);
            state.twist[i] = Twist::new(0.2 * ahead.cos(), 0.2 * ahead.sin(), 0.0);
        }
        let motion = Motion::of(&robot, &state);
        assert!((motion.heading - ahead).abs() < 1e-15);
        assert!((motion.velocity.y.atan2(motion.velocity.x) - ahead).abs() < 1e-15);
        assert!((motion.position - state.pose[1].xy()).norm() < 1e-15, "the CG is that of the middle link");
    }

    #[test]
    fn wrapped_angles_differ_by_whole_turns_and_are_at_most_pi() {
        for angle in [-10.0, -PI, 0.0, 1.0, 3.2, 100.0] {
            let wrapped = wrap_angle(angle);
            assert!(wrapped.abs() <= PI + 1e-12);
            assert!(((angle - wrapped) / (2.0 * PI) - ((angle - wrapped) / (2.0 * PI)).round()).abs() < 1e-12);
        }
    }
}
