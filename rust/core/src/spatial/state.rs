use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use crate::obstacles::{Moved, OutOfPlane};
use crate::robot::Robot;
use crate::stepping::{Coordinates, LinkPose, MAX_RATE, MAX_SPEED, RobotState};

use super::{SpatialVector, Twist, mass_diagonal, potential_energy};

/// q_i: position of a link's CG in frame I \[m\] and its orientation R_B^I as a unit quaternion (T 4.1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    pub position: Vector3<f64>,
    pub orientation: UnitQuaternion<f64>,
}

impl Pose {
    /// At the origin, frame B parallel to frame I.
    pub fn identity() -> Self {
        Self { position: Vector3::zeros(), orientation: UnitQuaternion::identity() }
    }

    /// R_B^I, whose columns are e_x^B, e_y^B and e_z^B in frame I (T 4.3).
    pub fn rotation(&self) -> Matrix3<f64> {
        self.orientation.to_rotation_matrix().into_inner()
    }

    /// e_z^B, the direction of the link's centre line towards the next link, in frame I.
    pub fn axis(&self) -> Vector3<f64> {
        self.orientation * Vector3::z()
    }
}

/// u_i: velocity of a link's CG in frame I \[m/s\], stacked on its angular velocity in frame B \[rad/s\] (T 4.2).
/// The solvers use [`super::Twist`], whose parts are both in frame I.
pub type StackedTwist = Vector6<f64>;

/// A twist, or a force and moment, from its two parts.
pub fn twist_of(linear: Vector3<f64>, angular: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// The angular part of a twist, or the moment of a force: frame B.
pub fn turning(twist: &Vector6<f64>) -> Vector3<f64> {
    twist.fixed_rows::<3>(3).into_owned()
}

/// Where something that can be pushed is, centre and turn about the vertical, and its twist.
pub fn place_and_twist(Moved { pose, twist, out_of_plane }: &Moved) -> [SpatialVector; 2] {
    let OutOfPlane { height, rise, roll: [x, y] } = *out_of_plane;
    let place = SpatialVector { linear: pose.xy().push(height), angular: Vector3::new(0.0, 0.0, pose.z) };
    [place, Twist { linear: twist.xy().push(rise), angular: Vector3::new(x, y, twist.z) }]
}

/// The same from both. How a ball has rolled is left out.
pub fn moved_of(place: &SpatialVector, twist: &Twist) -> Moved {
    let (Twist { linear, angular }, height) = (twist, place.linear.z);
    let out_of_plane = OutOfPlane { height, rise: linear.z, roll: [angular.x, angular.y] };
    Moved { pose: place.in_plane(), twist: twist.in_plane(), out_of_plane }
}

/// State of one robot (T 4.7).
pub type SpatialState = RobotState<Pose, StackedTwist>;

impl SpatialState {
    /// Kinetic energy of all links \[J\].
    pub fn kinetic_energy(&self, robot: &Robot) -> f64 {
        let energy = |(link, u): (_, &StackedTwist)| 0.5 * u.dot(&mass_diagonal(link).component_mul(u));
        robot.links.iter().zip(&self.twist).map(energy).sum()
    }

    /// Potential energy of all links under the acceleration of gravity in frame I, zero with every CG at the height of
    /// the origin \[J\].
    pub fn potential_energy(&self, robot: &Robot, gravity: &Vector3<f64>) -> f64 {
        let energy = |(link, pose): (_, &Pose)| potential_energy(link, gravity, pose);
        robot.links.iter().zip(&self.pose).map(energy).sum()
    }
}

impl Coordinates for StackedTwist {
    fn zero() -> Self {
        Self::zeros()
    }
}

impl Coordinates for Pose {
    fn zero() -> Self {
        Self::identity()
    }
}

impl LinkPose<StackedTwist> for Pose {
    fn is_plausible(&self, twist: &StackedTwist) -> bool {
        let (velocity, rate) = (twist.iter().take(3), twist.iter().skip(3));
        velocity.map(|v| v.abs()).all(|speed| speed < MAX_SPEED)
            && rate.map(|omega| omega.abs()).all(|rate| rate < MAX_RATE)
            && self.position.iter().chain(self.orientation.coords.iter()).all(|x| x.is_finite())
    }
}
