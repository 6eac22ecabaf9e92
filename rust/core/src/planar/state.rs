use nalgebra::Vector3;

use crate::math::{Mask, Real};
use crate::robot::Robot;
use crate::stepping::{Coordinates, LinkPose, MAX_RATE, MAX_SPEED, RobotState};

/// q_i = (x, y, theta): position of a link's CG \[m\] and absolute angle \[rad\] (T 3.4).
pub type Pose = Vector3<f64>;

/// u_i = (v_x, v_y, omega): velocity of a link's CG \[m/s\] and angular velocity \[rad/s\] (T 3.5).
pub type Twist = Vector3<f64>;

/// State of one robot (T 3.6).
pub type PlanarState = RobotState<Pose, Twist>;

impl PlanarState {
    /// Kinetic energy of all links \[J\].
    pub fn kinetic_energy(&self, robot: &Robot) -> f64 {
        robot.links.iter().zip(&self.twist).map(|(link, u)| link.energy_in_plane(u)).sum()
    }

    /// phi_i = theta_{i+1} - theta_i (T 3.52) \[rad\].
    pub fn joint_angle(&self, joint: usize) -> f64 {
        self.pose[joint + 1].z - self.pose[joint].z
    }

    /// omega_{i+1} - omega_i (T 3.53) \[rad/s\].
    pub fn joint_rate(&self, joint: usize) -> f64 {
        self.twist[joint + 1].z - self.twist[joint].z
    }
}

impl Coordinates for Vector3<f64> {
    fn zero() -> Self {
        Self::zeros()
    }
}

impl LinkPose<Twist> for Pose {
    fn is_plausible(&self, twist: &Twist) -> bool {
        is_plausible(&[*self], &[*twist])
    }
}

/// Whether states are finite, and slow enough to be robots rather than diverged computations.
#[inline(always)]
pub fn is_plausible<T: Real>(pose: &[Vector3<T>], twist: &[Vector3<T>]) -> T::Mask {
    let (speed, rate, anywhere) = (T::splat(MAX_SPEED), T::splat(MAX_RATE), T::splat(f64::INFINITY));
    let mut plausible = T::Mask::of(|_| true);
    for (q, u) in pose.iter().zip(twist) {
        plausible = plausible & u.x.abs().lt(speed) & u.y.abs().lt(speed) & u.z.abs().lt(rate);
        plausible = plausible & q.x.abs().lt(anywhere) & q.y.abs().lt(anywhere) & q.z.abs().lt(anywhere);
    }
    plausible
}
