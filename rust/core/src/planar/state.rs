use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::math::{Mask, Real};
use crate::obstacles::Moved;
use crate::robot::Robot;
use crate::stepping::{MAX_RATE, MAX_SPEED, RobotState};

/// q_i = (x, y, theta): position of a link's CG \[m\] and absolute angle \[rad\] (T 3.4).
pub type Pose = Vector3<f64>;

/// u_i = (v_x, v_y, omega): velocity of a link's CG \[m/s\] and angular velocity \[rad/s\] (T 3.5).
pub type Twist = Vector3<f64>;

/// State of one robot: plain data (T 3.6).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanarState {
    /// \[s\]
    pub time: f64,
    pub pose: Vec<Pose>,
    pub twist: Vec<Twist>,
    /// Of the obstacles that can be pushed.
    #[serde(default)]
    pub movables: Vec<Moved>,
}

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

impl RobotState for PlanarState {
    fn zero(links: usize) -> Self {
        Self { time: 0.0, pose: vec![Pose::zeros(); links], twist: vec![Twist::zeros(); links], movables: Vec::new() }
    }

    fn movables(&self) -> &[Moved] {
        &self.movables
    }

    fn movables_mut(&mut self) -> &mut Vec<Moved> {
        &mut self.movables
    }

    fn copy_from(&mut self, other: &Self) {
        self.time = other.time;
        self.pose.copy_from_slice(&other.pose);
        self.twist.copy_from_slice(&other.twist);
        self.movables.clone_from(&other.movables);
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn set_time(&mut self, time: f64) {
        self.time = time;
    }

    fn stop(&mut self) {
        self.twist.fill(Twist::zeros());
        self.movables.iter_mut().for_each(|moved| *moved = moved.stopped());
    }

    fn fits(&self, links: usize, movables: usize) -> bool {
        self.pose.len() == links && self.twist.len() == links && self.movables.len() == movables
    }

    fn is_plausible(&self) -> bool {
        is_plausible(&self.pose, &self.twist) && self.movables.iter().all(Moved::is_plausible)
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
