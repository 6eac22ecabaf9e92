//! The planar model for the stepper.

use crate::gait::{JointTarget, Reference};
use crate::math::Real;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;
use crate::stepping::start::is_following;
use crate::stepping::{self, Accuracy, AnyGroup, ImplicitConfig, Model, group_for};

use super::workspace::Workspace;
use super::{PlanarSystem, Pose, Twist, WarmStart, assemble_chain};

/// The planar model (T ch. 3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar;

/// One planar robot among its obstacles.
pub type Body = stepping::Body<Planar>;

/// Planar robots that are advanced together.
pub type Fleet = stepping::Fleet<Planar>;

/// A planar robot that follows a reference.
pub type Scripted<R> = stepping::Scripted<R, Planar>;

impl Model for Planar {
    type System = PlanarSystem;
    type Pose = Pose;
    type Twist = Twist;
    type WarmStart = WarmStart;
    type Target = JointTarget;
    type Workspace<T: Real> = Workspace<T>;

    const ACCURACY: Accuracy = Accuracy { step: 0.025, tolerance: 1e-4, step_tolerance: 4e-4, impact_step: 1.5e-3 };

    fn group(config: &ImplicitConfig, system: &PlanarSystem, lanes: usize) -> Box<dyn AnyGroup<Self>> {
        group_for(config, system, lanes)
    }

    fn robot(system: &PlanarSystem) -> &Robot {
        &system.robot
    }

    fn follows(_: &PlanarSystem, body: &Body, targets: &[JointTarget]) -> bool {
        let mut joints = targets.iter().enumerate();
        joints.all(|(joint, target)| is_following(target, body.state.joint_angle(joint), body.state.joint_rate(joint)))
    }
}

impl<R: Reference<JointTarget>> Scripted<R> {
    /// A robot at rest among `obstacles`: `start` is CG and absolute angle of link 1, `joint_angle` its posture.
    pub fn new(robot: &Robot, obstacles: ObstacleGrid, start: [f64; 3], joint_angle: &[f64], reference: R) -> Self {
        let mut body = Body::new(robot, obstacles);
        assemble_chain(robot, Pose::from(start), joint_angle, &mut body.state.pose);
        body.clear_memory();
        Self { body, reference }
    }
}
