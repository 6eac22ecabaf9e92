//! The spatial model for the stepper.

use nalgebra::Vector2;

use crate::gait::{CardanTarget, Reference};
use crate::math::Real;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;
use crate::stepping::{self, Accuracy, AnyGroup, ImplicitConfig, Model, group_for};

use super::workspace::Workspace;
use super::{ChainState, Pose, SpatialSystem, StackedTwist, assemble_chain, rest_on};

/// The spatial model (T ch. 4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spatial;

/// One spatial robot among its obstacles.
pub type SpatialBody = stepping::Body<Spatial>;

/// Spatial robots that are advanced together.
pub type SpatialFleet = stepping::Fleet<Spatial>;

/// A spatial robot that follows a reference.
pub type SpatialScripted<R> = stepping::Scripted<R, Spatial>;

/// Tolerance of the solvers of a stage whose residual is to be at most `tolerance` \[m/s\]. Their stopping rules bound
/// velocities in the norm of the kinetic energy of all links. The certificate checks every law and every link, relative to
/// its own mass and inertia: with two contacts and six balances per link it commonly finds more.
pub fn stopping(tolerance: f64) -> f64 {
    0.1 * tolerance
}

impl Model for Spatial {
    type System = SpatialSystem;
    type Pose = Pose;
    type Twist = StackedTwist;
    type WarmStart = ChainState;
    type Target = CardanTarget;
    type Workspace<T: Real> = Workspace<T>;

    // Links touch down all the time: impacts count for more than in the plane.
    const ACCURACY: Accuracy = Accuracy { step: 0.025, tolerance: 1e-5, step_tolerance: 1.5e-4, impact_step: 4e-4 };

    fn group(config: &ImplicitConfig, system: &SpatialSystem, lanes: usize) -> Box<dyn AnyGroup<Self>> {
        group_for(config, system, lanes)
    }

    fn robot(system: &SpatialSystem) -> &Robot {
        &system.robot
    }

    fn follows(system: &SpatialSystem, body: &SpatialBody, targets: &[CardanTarget]) -> bool {
        body.warm_start.is_following(&system.robot.axes, targets)
    }

    fn to_reduced(system: &SpatialSystem, body: &mut SpatialBody) {
        body.warm_start.read(&system.robot, body.parameters.mass, &body.state);
    }

    fn from_reduced(system: &SpatialSystem, body: &mut SpatialBody) {
        let mass = body.parameters.mass;
        body.warm_start.write(&system.robot, mass, &system.shape, &mut body.state);
    }
}

impl<R: Reference<CardanTarget>> SpatialScripted<R> {
    /// A robot at rest on the ground among `obstacles`, or on those that are under it: pose of link 1, which is lifted
    /// or lowered, and (yaw, pitch) of all joints.
    pub fn new(robot: &Robot, obstacles: ObstacleGrid, head: Pose, joint_angle: &[Vector2<f64>], reference: R) -> Self {
        let mut body = SpatialBody::new(robot, obstacles);
        assemble_chain(robot, head, joint_angle, &mut body.state.pose);
        rest_on(robot, &body.obstacles, &mut body.state.pose);
        body.clear_memory();
        Self { body, reference }
    }
}
