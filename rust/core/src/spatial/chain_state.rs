//! State of a robot between steps: coordinates in which joints cannot open, and the forces of its last stage.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::{CAPSULE_CONTACTS, ContactMemory};
use crate::gait::CardanTarget;
use crate::math::{Real, read_lane, write_lane};
use crate::obstacles::{Moved, ObstacleGrid};
use crate::robot::{Axes, Robot};
use crate::rows::Saved;
use crate::spatial::{
    ChainShape, ChainVelocity, Configuration, Frame, Momentum, Pose, SpatialState, StackedTwist, Twist, axis_angles,
    axis_rates, inertia, moved_of, place_and_twist, turned_by, turning, twist_of,
};
use crate::stepping::WarmStart;
use crate::stepping::start::is_following;

use super::near_pairs::NearPairs;

/// What a step passes to the next one.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainState {
    pub configuration: Configuration,
    pub velocity: ChainVelocity,
    /// Momentum of each link, and angular momentum about its CG, frame I: exchanged by the joints and conserved.
    pub momentum: Vec<Momentum>,
    /// What the next step takes from the last one beside the motion.
    pub last: SavedForces,
    /// Velocity with which a postponed stage is solved again, if there is one.
    pub guess: ChainVelocity,
    pub is_postponed: bool,
    /// The obstacles near its links; listed anew in every interval.
    pub near: NearPairs,
    frames: Vec<Frame>,
}

/// Forces of the ground in the last stage: which contacts carried load, and which of them stuck.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved")]
pub struct GroundForces<T = f64> {
    /// At both ends of each link \[N\].
    pub normal: Vec<[T; 2]>,
    pub friction: Vec<[Vector2<T>; 2]>,
    /// Rolling friction of both ends together.
    pub rolling: Vec<Vector2<T>>,
}

impl<T: Real> GroundForces<T> {
    pub fn none(links: usize) -> Self {
        let (zero, none) = (T::zero(), Vector2::new(T::zero(), T::zero()));
        Self { normal: vec![[zero; 2]; links], friction: vec![[none; 2]; links], rolling: vec![none; links] }
    }

    pub fn read_lane(&self, lane: usize, to: &mut GroundForces) {
        read_lane::<T, _>(&self.normal, lane, &mut to.normal);
        read_lane::<T, _>(&self.friction, lane, &mut to.friction);
        read_lane::<T, _>(&self.rolling, lane, &mut to.rolling);
    }

    pub fn set_lane(&mut self, lane: usize, from: &GroundForces) {
        write_lane::<T, _>(&mut self.normal, lane, &from.normal);
        write_lane::<T, _>(&mut self.friction, lane, &from.friction);
        write_lane::<T, _>(&mut self.rolling, lane, &from.rolling);
    }
}

impl GroundForces {
    pub fn copy_from(&mut self, other: &Self) {
        self.normal.copy_from_slice(&other.normal);
        self.friction.copy_from_slice(&other.friction);
        self.rolling.copy_from_slice(&other.rolling);
    }

    fn clear(&mut self) {
        self.normal.fill([0.0; 2]);
        self.friction.fill([Vector2::zeros(); 2]);
        self.rolling.fill(Vector2::zeros());
    }

    pub fn fits(&self, links: usize) -> bool {
        self.normal.len() == links && self.friction.len() == links && self.rolling.len() == links
    }
}

impl ChainState {
    /// Pose of link 1, joint angles, their rates and all momenta from the poses and twists of all links, whose masses are
    /// `mass` times those of `robot`; and what can be pushed.
    pub fn read(&mut self, robot: &Robot, mass: f64, state: &SpatialState) {
        let (pose, twist) = (&state.pose, &state.twist);
        let Self { configuration, velocity, momentum, last, guess, near, .. } = self;
        near.clear();
        configuration.moved.clear();
        configuration.moved.extend(state.movables.iter().map(|moved| place_and_twist(moved)[0]));
        velocity.moved.clear();
        velocity.moved.extend(state.movables.iter().map(|moved| place_and_twist(moved)[1]));
        guess.moved.resize(state.movables.len(), Twist::zero());
        last.surface.resize(state.movables.len(), Vector3::zeros());
        let q = pose[0].orientation.quaternion();
        (configuration.position, configuration.orientation) = (pose[0].position, [q.w, q.i, q.j, q.k]);
        velocity.head = Twist { linear: linear(&twist[0]), angular: pose[0].orientation * turning(&twist[0]) };
        for (j, (angle, rate)) in configuration.angle.iter_mut().zip(&mut velocity.rate).enumerate() {
            *angle = axis_angles(robot.axes[j], &pose[j], &pose[j + 1]);
            *rate = axis_rates(robot.axes[j], (&pose[j], &twist[j]), (&pose[j + 1], &twist[j + 1]));
        }
        for (i, link) in robot.links.iter().enumerate() {
            let spin = turning(&twist[i]).component_mul(&inertia(link)) * mass;
            momentum[i] =
                Momentum { linear: linear(&twist[i]) * (link.mass * mass), angular: pose[i].orientation * spin };
        }
    }

    /// Poses and twists of all links; `mass` as in [`Self::read`].
    pub fn write(&mut self, robot: &Robot, mass: f64, shape: &ChainShape, state: &mut SpatialState) {
        let SpatialState { pose, twist, movables, .. } = state;
        for (number, moved) in movables.iter_mut().enumerate() {
            *moved = self.moved(number);
        }
        self.place_links(shape, pose);
        for (i, link) in robot.links.iter().enumerate() {
            let Momentum { linear, angular } = &self.momentum[i];
            let spin = pose[i].orientation.inverse_transform_vector(angular);
            twist[i] = twist_of(linear / (link.mass * mass), spin.component_div(&(inertia(link) * mass)));
        }
    }

    /// Where something that can be pushed is, and how it moves.
    pub fn moved(&self, number: usize) -> Moved {
        moved_of(&self.configuration.moved[number], &self.velocity.moved[number])
    }

    /// Ends a step: records which contacts carry force.
    pub fn end_step(&mut self) {
        let SavedForces { forces, stands, contacts, .. } = &mut self.last;
        for (stands, normal) in stands.iter_mut().zip(&forces.normal) {
            *stands = normal.map(|force| force > 0.0);
        }
        // Penetrations are measured at the start of the next step.
        contacts.end_step(|_| 0.0);
    }

    fn place_links(&mut self, shape: &ChainShape, pose: &mut [Pose]) {
        self.configuration.place_links(shape, &mut self.frames);
        let [w, x, y, z] = self.configuration.orientation;
        let mut orientation = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        for (i, (pose, frame)) in pose.iter_mut().zip(&self.frames).enumerate() {
            if i > 0 {
                orientation = turned_by(shape.axes[i - 1], &orientation, self.configuration.angle[i - 1]);
            }
            *pose = Pose { position: frame.position, orientation };
        }
    }

    /// A robot that was placed in motion with its reference has no start to resolve.
    pub fn is_following(&self, axes: &[Axes], targets: &[CardanTarget]) -> bool {
        let mut joints = targets.iter().zip(axes).zip(self.configuration.angle.iter().zip(&self.velocity.rate));
        joints.all(|((target, axes), (angle, rate))| {
            (!axes.has(0) || is_following(&target.yaw, angle[0], rate[0]))
                && (!axes.has(1) || is_following(&target.pitch, angle[1], rate[1]))
        })
    }
}

fn linear(twist: &StackedTwist) -> Vector3<f64> {
    twist.fixed_rows::<3>(0).into()
}

/// What continues a run elsewhere beside the state: forces of the last stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedForces {
    /// The last step began at rest.
    pub began_at_rest: bool,
    pub forces: GroundForces,
    /// Of friction on what can be pushed: force and moment, frame I \[N\], \[N m\].
    #[serde(default)]
    pub surface: Vec<Vector3<f64>>,
    /// Whether the ground carried the ends of each link at the end of the last accepted step.
    pub stands: Vec<[bool; 2]>,
    /// With obstacles and of the robot with itself, in the last stage.
    pub contacts: ContactMemory,
    /// Forces at both stops of each axis, empty where none presses \[N\].
    pub joint_stops: Vec<[f64; 2]>,
    /// tau_C = (yaw, pitch) of each joint in the last step \[N m\] (T 4.89).
    pub joint_torque: Vec<Vector2<f64>>,
    /// Positions of the joints in their backlash, yaw and pitch of each, phi less the motor's angle \[rad\].
    pub backlash: Vec<f64>,
    /// Torque of the friction in the gear of each axis's motor, empty without motors \[N m\].
    pub gear_friction: Vec<f64>,
}

impl WarmStart for ChainState {
    type Saved = SavedForces;

    fn new(links: usize) -> Self {
        Self {
            configuration: Configuration::straight(links),
            velocity: ChainVelocity::rest(links),
            momentum: vec![Momentum::zero(); links],
            last: SavedForces {
                began_at_rest: false,
                forces: GroundForces::none(links),
                surface: Vec::new(),
                stands: vec![[false; 2]; links],
                contacts: ContactMemory::with_capacity(8 * links),
                joint_stops: Vec::with_capacity(2 * (links - 1)),
                joint_torque: vec![Vector2::zeros(); links - 1],
                backlash: vec![0.0; 2 * (links - 1)],
                gear_friction: Vec::new(),
            },
            guess: ChainVelocity::rest(links),
            is_postponed: false,
            near: NearPairs::new(links),
            frames: vec![Frame::origin(); links],
        }
    }

    fn clear(&mut self) {
        self.is_postponed = false;
        let last = &mut self.last;
        last.began_at_rest = false;
        last.forces.clear();
        last.surface.clear();
        last.stands.fill([false; 2]);
        last.contacts.clear();
        last.joint_stops.clear();
        last.joint_torque.fill(Vector2::zeros());
        last.backlash.fill(0.0);
        last.gear_friction.clear();
    }

    fn save(&self) -> SavedForces {
        self.last.clone()
    }

    fn resume(&mut self, saved: &SavedForces) {
        let last = &mut self.last;
        last.began_at_rest = saved.began_at_rest;
        last.forces.copy_from(&saved.forces);
        last.surface.clone_from(&saved.surface);
        last.stands.copy_from_slice(&saved.stands);
        last.contacts.copy_from(&saved.contacts);
        last.joint_stops.clone_from(&saved.joint_stops);
        last.joint_torque.clone_from(&saved.joint_torque);
        last.backlash.copy_from_slice(&saved.backlash);
        last.gear_friction.clone_from(&saved.gear_friction);
    }

    fn fits(saved: &SavedForces, links: usize, obstacles: &ObstacleGrid) -> bool {
        saved.forces.fits(links)
            && [0, obstacles.movables().len()].contains(&saved.surface.len())
            && saved.stands.len() == links
            && [0, 2 * (links - 1)].contains(&saved.joint_stops.len())
            && saved.joint_torque.len() == links - 1
            && saved.backlash.len() == 2 * (links - 1)
            && [0, 2 * (links - 1)].contains(&saved.gear_friction.len())
            && saved.contacts.fits(links, obstacles, CAPSULE_CONTACTS)
    }
}
