//! A robot that winds as a helix around the x direction, on a pole or in a pipe.
//!
//! With two waves of the joints alike and a quarter period apart the body bends by the same angle everywhere, and the
//! direction in which it bends turns by beta from joint to joint: a helix. Running waves roll every link about its own axis,
//! which carries the helix along the cylinder that it is pressed against.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector2, Vector3};

use crate::environment::config::EnvConfig;
use crate::environment::default_gait::DefaultGait;
use crate::environment::goal::Target;
use crate::environment::raised_chain::RaisedChain;
use crate::environment::start::Start;
use crate::error::{ConfigError, require};
use crate::gait::Wave;
use crate::obstacles::{Obstacle, ObstacleGrid, Shape};
use crate::robot::{Axes, Robot};
use crate::spatial::{Pose, assemble_chain};

use super::{EpisodeStart, Placement};

/// A robot that winds around the line y = 0, z = `height`, its CG at x = 0.
#[derive(Debug)]
pub struct Helix {
    chain: RaisedChain,
    /// Smallest and largest distance of its surface from the axis \[m\].
    radius: [f64; 2],
    /// Extent along the axis, to either side \[m\].
    reach: f64,
    goal_distance: f64,
}

/// How a helix is wound.
#[derive(Debug, Clone, Copy)]
pub struct Winding {
    /// Angle by which its joints bend \[rad\].
    pub bend: f64,
    /// By which the direction of bending turns from joint to joint \[rad\]; rolling, a robot inside moves against one
    /// outside.
    pub turn: f64,
    /// Amplitude of the gait's waves over the bend: above one it presses inward, below outward.
    pub grip: f64,
}

/// The gait of action zero.
pub fn rolling(Winding { bend, turn, grip }: Winding) -> DefaultGait {
    let yaw = Wave { amplitude: grip * bend, omega: ROLLING, beta: turn, ..Wave::default() };
    DefaultGait { yaw, lift: grip * bend, lift_phase: FRAC_PI_2, travel: 0.0 }
}

/// # Errors
/// Names what a helix needs of the robot.
pub fn validate(config: &EnvConfig) -> Result<(), ConfigError> {
    let name = config.task.family().name;
    let axes = config.robot.axes.expand(config.robot.links - 1).map_err(|e| e.inside("robot"))?;
    let is_helical = axes.iter().all(|axes| *axes == Axes::Both) && config.robot.links >= FEWEST_LINKS;
    let expected = format!("at least {FEWEST_LINKS} links and cardan joints for the task \"{name}\"");
    require(is_helical, "robot", format!("{} links", config.robot.links), &expected)
}

impl Helix {
    /// The start, at `height` \[m\]; link 1 leads to +x.
    pub fn new(config: &EnvConfig, robot: &Robot, winding: Winding, height: f64) -> Self {
        let bend = |joint: usize| {
            let (sin, cos) = (winding.turn * joint as f64).sin_cos();
            Vector2::new(sin, cos) * winding.bend
        };
        let joint_angle: Vec<_> = (0..robot.joint_count()).map(bend).collect();
        let mut pose = vec![Pose::identity(); robot.link_count()];
        assemble_chain(robot, Pose::identity(), &joint_angle, &mut pose);
        let (axis, centre) = axis_through(&pose);
        let to_head = pose[0].position - pose[pose.len() - 1].position;
        let axis = axis * axis.dot(&to_head).signum();
        let turn = UnitQuaternion::rotation_between(&axis, &Vector3::x()).unwrap_or_default();
        let mut head = Pose {
            position: turn * (pose[0].position - centre) + Vector3::z() * height,
            orientation: turn * pose[0].orientation,
        };
        assemble_chain(robot, head, &joint_angle, &mut pose);
        let grip = Some(winding.grip);
        let mut chain = RaisedChain { pose, joint_angle, has_own_posture: false, grip, has_own_height: true };
        head.position.x -= chain.gravity_centre(robot).x;
        assemble_chain(robot, head, &chain.joint_angle, &mut chain.pose);
        let (mut radius, mut reach) = ([f64::INFINITY, 0.0_f64], 0.0_f64);
        for (link, pose) in robot.links.iter().zip(&chain.pose) {
            let [front, rear] = link.sides();
            for along in [front, 0.5 * (front + rear), rear] {
                let point = pose.position + pose.axis() * along;
                let from_axis = point.y.hypot(point.z - height);
                radius = [radius[0].min(from_axis - link.radius), radius[1].max(from_axis + link.radius)];
                reach = reach.max(point.x.abs() + link.radius);
            }
        }
        Self { chain, radius, reach, goal_distance: config.goal_distance }
    }

    /// Radius of the pole inside the helix, and of the pipe around it \[m\].
    pub fn cylinders(&self) -> [f64; 2] {
        [self.radius[0] - CLEARANCE, self.radius[1] + CLEARANCE]
    }

    /// Puts the robot at its start, among these obstacles.
    pub fn place(&self, placement: &mut Placement, obstacles: Vec<(Shape, f64)>) -> EpisodeStart {
        let obstacle = |(shape, friction)| Obstacle { friction, ..Obstacle::endless(shape) };
        let obstacles: Vec<_> = obstacles.into_iter().map(obstacle).collect();
        placement.pegs.clear();
        placement.set_scene(Some(Arc::new(ObstacleGrid::of(&obstacles))));
        placement.set_raised(self.chain.clone());
        let start = Start::of_gait(self.chain.pose[0].position.xy(), 0.0);
        let target = Target::Line { distance: self.goal_distance, centre_line: 0.0 };
        EpisodeStart { start, target, speed: None }
    }

    /// From before the robot to beyond it at the goal, along the axis \[m\].
    pub fn way(&self) -> [f64; 2] {
        [-2.0 * self.reach, self.goal_distance + 2.0 * self.reach]
    }
}

/// Direction of the axis of a helix and a point of it: from where its points are at the most equal distances, by the
/// Gauss-Newton iteration. Second differences of the points lead to the axis and about across it, where the search begins.
fn axis_through(pose: &[Pose]) -> (Vector3<f64>, Vector3<f64>) {
    let points: Vec<_> = pose.iter().map(|pose| pose.position).collect();
    let bends = points.windows(3).map(|three| three[0] - 2.0 * three[1] + three[2]);
    let spread = bends.map(|bend| bend * bend.transpose()).sum::<Matrix3<f64>>().symmetric_eigen();
    let mut axis: Vector3<f64> = spread.eigenvectors.column(spread.eigenvalues.imin()).into();
    let mut centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut radius = 0.0;
    for _ in 0..ITERATIONS {
        let side = axis.cross(&if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }).normalize();
        let up = axis.cross(&side);
        let mut equations = DMatrix::zeros(points.len(), 5);
        let mut errors = DVector::zeros(points.len());
        for (row, point) in points.iter().enumerate() {
            let along = (point - centre).dot(&axis);
            let across = point - centre - axis * along;
            let outward = across.normalize();
            let [a, b] = [outward.dot(&side), outward.dot(&up)];
            equations.row_mut(row).copy_from_slice(&[-a, -b, -along * a, -along * b, -1.0]);
            errors[row] = radius - across.norm();
        }
        let change = equations.svd(true, true).solve(&errors, f64::EPSILON).expect("both bases");
        centre += side * change[0] + up * change[1];
        axis = (axis + side * change[2] + up * change[3]).normalize();
        radius += change[4];
    }
    (axis, centre)
}

/// To round-off, for helices of about one winding.
const ITERATIONS: usize = 20;

/// Rate of the waves \[rad/s\].
const ROLLING: f64 = 1.0;

/// One winding of Aiko's proportions has 8 links.
const FEWEST_LINKS: usize = 8;

/// Between the robot and the cylinder at the start \[m\].
const CLEARANCE: f64 = 1e-3;
