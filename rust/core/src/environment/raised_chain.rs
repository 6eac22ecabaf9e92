//! A robot of the spatial model at a start where it does not lie flat on the ground.

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{ConvexPolygon, Peg};
use crate::robot::{Link, Robot};
use crate::spatial::{End, Pose, assemble_chain, ground_gap, orientation_of, peg_gap, rest_on_ground, wall_gap};

use super::start::Start;

/// How a start differs from lying flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Raised {
    /// Height of the CG of link 1; none: the robot rests on the ground \[m\].
    pub height: Option<f64>,
    /// Turns of the chain about link 1: it rises behind it, and rolls about its centre line \[rad\].
    pub pitch: f64,
    pub roll: f64,
    /// Of the joints; empty: all zero \[rad\].
    pub joint_pitch: Vec<f64>,
}

/// Poses of the robot there.
#[derive(Debug, Clone, PartialEq)]
pub struct RaisedChain {
    pub pose: Vec<Pose>,
    /// (yaw, pitch) of the joints \[rad\].
    pub joint_angle: Vec<Vector2<f64>>,
    pub has_own_posture: bool,
    /// Where it is wound by the gait: the references of its joints, over their angles.
    pub grip: Option<f64>,
    /// It is held at a height of its own; else it rests on what is under it.
    pub has_own_height: bool,
}

impl RaisedChain {
    /// The robot at `start`, whose joints have the yaw angles `yaw`, raised as prescribed.
    pub fn new(robot: &Robot, start: &Start, yaw: &[f64], raised: &Raised) -> Self {
        let pitch = raised.joint_pitch.iter().copied().chain(std::iter::repeat(0.0));
        let joint_angle: Vec<_> = yaw.iter().zip(pitch).map(|(yaw, pitch)| Vector2::new(*yaw, pitch)).collect();
        let head = Pose {
            position: start.position.push(raised.height.unwrap_or(0.0)),
            orientation: orientation_of(start.angle, raised.pitch, raised.roll),
        };
        let mut pose = vec![Pose::identity(); robot.link_count()];
        assemble_chain(robot, head, &joint_angle, &mut pose);
        if raised.height.is_none() {
            rest_on_ground(robot, &mut pose);
        }
        let (has_own_posture, has_own_height) = (start.has_own_posture, raised.height.is_some());
        Self { pose, joint_angle, has_own_posture, grip: None, has_own_height }
    }

    /// Smallest gap to a peg, which is vertical and without end \[m\].
    pub fn gap_to_peg(&self, robot: &Robot, peg: &Peg) -> f64 {
        self.smallest(robot, |link, pose| peg_gap(link, pose, peg))
    }

    /// Smallest gap to a wall, which is vertical and without end \[m\].
    pub fn gap_to_wall(&self, robot: &Robot, wall: &ConvexPolygon) -> f64 {
        self.smallest(robot, |link, pose| wall_gap(link, &pose.position, &pose.axis(), wall))
    }

    /// Smallest gap to the ground \[m\].
    pub fn gap_to_ground(&self, robot: &Robot) -> f64 {
        let of_end = |link: &Link, pose: &Pose| End::BOTH.map(|end| ground_gap(link, pose, end));
        self.smallest(robot, |link, pose| of_end(link, pose).into_iter().fold(f64::INFINITY, f64::min))
    }

    /// CG of the robot \[m\].
    pub fn gravity_centre(&self, robot: &Robot) -> Vector3<f64> {
        let moments = robot.links.iter().zip(&self.pose).map(|(link, pose)| pose.position * link.mass);
        moments.sum::<Vector3<f64>>() / robot.total_mass()
    }

    fn smallest(&self, robot: &Robot, gap: impl Fn(&Link, &Pose) -> f64) -> f64 {
        robot.links.iter().zip(&self.pose).map(|(link, pose)| gap(link, pose)).fold(f64::INFINITY, f64::min)
    }
}
