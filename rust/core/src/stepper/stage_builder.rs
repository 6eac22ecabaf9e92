//! From a robot in a scene to the data of one stage.

use nalgebra::{Vector2, Vector3};

use crate::contact::{LinkPegContact, NearPair, link_peg_contact};
use crate::control::PdConfig;
use crate::error::ConfigError;
use crate::gait::JointReference;
use crate::pegs::PegGrid;
use crate::planar::{Heading, Pose, Stage, StageContact, StageJoint, StageLink, Twist};
use crate::robot::{Link, Robot};
use crate::scene::Scene;

/// Robot, ground, pegs and controller: what stays constant while stepping.
#[derive(Debug, Clone)]
pub struct Plant {
    pub robot: Robot,
    pub pegs: PegGrid,
    pub controller: PdConfig,
    /// mu_Tx, mu_Ty.
    friction: Vector2<f64>,
}

impl Plant {
    /// # Errors
    /// Names the gain that is not admissible.
    pub fn new(robot: Robot, scene: &Scene, controller: PdConfig) -> Result<Self, ConfigError> {
        controller.validate()?;
        Ok(Self {
            robot,
            pegs: PegGrid::new(&scene.pegs),
            controller,
            friction: Vector2::from(scene.friction),
        })
    }

    /// Friction bound of a link along and across it, mu m g \[N\].
    pub fn friction_force(&self, link: &Link) -> Vector2<f64> {
        self.friction * (link.mass * self.robot.gravity)
    }

    /// Links of a stage: directions at `pose`, reference velocities `reference`.
    pub fn fill_links(&self, stage: &mut Stage, pose: &[Pose], reference: &[Twist]) {
        stage.links.clear();
        stage.links.extend(self.robot.links.iter().zip(pose).zip(reference).map(|((link, q), u)| StageLink {
            heading: Heading::of(q.z),
            reference: *u,
            mass: link.mass,
            inertia: link.inertia,
            half_length: 0.5 * link.length,
            friction: self.friction_force(link) * stage.coefficient,
        }));
    }

    /// Joints of a stage that ends at `end_time`: the PD torque (T 3.51) at the end of the stage,
    /// where phi = phi_base + c omega_J, is linear in omega_J.
    pub fn fill_implicit_joints(&self, stage: &mut Stage, base: &[Pose], reference: &impl JointReference, end_time: f64) {
        let c = stage.coefficient;
        let (kp, kd) = self.controller.gains_at(end_time);
        stage.joints.clear();
        stage.joints.extend(base.windows(2).enumerate().map(|(j, q)| {
            let target = reference.target(j, end_time);
            StageJoint {
                drive: c * (kp * (target.angle - (q[1].z - q[0].z)) + kd * target.rate),
                stiffness: c * (c * kp + kd),
                limit: c * self.controller.limit(),
            }
        }));
    }

    /// Joints of a stage with the PD torque (T 3.51) at the given state and time, held over the stage.
    pub fn fill_explicit_joints(
        &self,
        stage: &mut Stage,
        pose: &[Pose],
        twist: &[Twist],
        reference: &impl JointReference,
        time: f64,
    ) {
        let c = stage.coefficient;
        let (kp, kd) = self.controller.gains_at(time);
        stage.joints.clear();
        stage.joints.extend(pose.windows(2).zip(twist.windows(2)).enumerate().map(|(j, (q, u))| {
            let target = reference.target(j, time);
            let torque = kp * (target.angle - (q[1].z - q[0].z)) + kd * (target.rate - (u[1].z - u[0].z));
            StageJoint { drive: c * torque, stiffness: 0.0, limit: c * self.controller.limit() }
        }));
    }

    /// Contacts of a stage from the near pairs whose predicted gap is below `margin`.
    ///
    /// The end-of-stage gap is linearised at the predicted end configuration,
    /// `g(q_E) = g(q_pred) + c w . (u - u_pred)`, so that a sustained contact is exact to second order.
    /// Where the prediction runs deep into a peg the side is uncertain, and the gap is linearised at
    /// the start. Either plane touches the distance function of a convex body from below (for a link
    /// that translates), so `g + c w . u >= 0` keeps the true gap non-negative however long the step.
    pub fn fill_contacts(&self, stage: &mut Stage, pairs: &[NearPair], base: &[Pose], predicted: &[Pose], twist: &[Twist], margin: f64) {
        let c = stage.coefficient;
        stage.contacts.clear();
        for (index, pair) in pairs.iter().enumerate() {
            let link = &self.robot.links[pair.link];
            let peg = &self.pegs.pegs()[pair.peg];
            let heading = stage.links[pair.link].heading;
            let at_end = link_peg_contact(&predicted[pair.link], heading.cos, heading.sin, link, peg);
            if at_end.gap > margin {
                continue;
            }
            let (contact, travelled) = if at_end.gap > -DEEP * (peg.radius + link.radius) {
                (at_end, at_end.direction.dot(&twist[pair.link]))
            } else {
                let start = Heading::of(base[pair.link].z);
                (link_peg_contact(&base[pair.link], start.cos, start.sin, link, peg), 0.0)
            };
            stage.contacts.push(stage_contact(pair.link, index, &contact, travelled, c));
        }
    }

    /// Closed contacts on velocity level (T 3.68): no gap, directions at `pose`.
    pub fn fill_velocity_contacts(&self, stage: &mut Stage, closed: &[NearPair], pose: &[Pose]) {
        stage.contacts.clear();
        for (index, pair) in closed.iter().enumerate() {
            let link = &self.robot.links[pair.link];
            let heading = stage.links[pair.link].heading;
            let contact = link_peg_contact(&pose[pair.link], heading.cos, heading.sin, link, &self.pegs.pegs()[pair.peg]);
            stage.contacts.push(StageContact { link: pair.link, pair: index, direction: contact.direction, offset: 0.0 });
        }
    }
}

fn stage_contact(link: usize, pair: usize, contact: &LinkPegContact, travelled: f64, c: f64) -> StageContact {
    let offset = contact.gap / c - travelled;
    StageContact { link, pair, direction: contact.direction, offset: offset.max(-RECOVERY_SPEED) }
}

/// Predicted penetration, relative to the sum of the radii, beyond which the side is uncertain.
const DEEP: f64 = 0.1;

/// Fastest separation asked of a penetrating contact \[m/s\]: an initial penetration is undone over
/// several steps instead of being thrown out within one.
const RECOVERY_SPEED: f64 = 0.2;

/// Largest speed of any point of the robot \[m/s\].
pub fn largest_speed(links: &[Link], twist: &[Vector3<f64>]) -> f64 {
    let speed = |(link, u): (&Link, &Vector3<f64>)| u.xy().norm() + link.reach() * u.z.abs();
    links.iter().zip(twist).map(speed).fold(0.0, f64::max)
}
