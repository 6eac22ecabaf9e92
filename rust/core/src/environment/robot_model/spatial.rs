//! The robot of the spatial model with its joint references.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};

use crate::error::ConfigError;
use crate::simulation::{SpatialSimulation, SpatialSnapshot};
use crate::spatial::{Pose, Spatial, SpatialState, orientation_of, turning};

use super::accelerometer::Accelerometer;
use super::common_methods::common_methods;
use super::saved_robot::SavedRobot;
use super::{RobotModel, spatial_observation, spatial_state};
use crate::environment::action::spatial_entries;
use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::motion::Motion;
use crate::environment::observation::BlockRow;
use crate::environment::perception::LinkPose;
use crate::environment::quantity::Quantity;
use crate::environment::raised_chain::RaisedChain;
use crate::environment::reference::{Held, ReferenceGenerator};
use crate::environment::signal::{Signal, float, integer};
use crate::environment::start::Start;

/// Simulation and references of a robot of the spatial model.
#[derive(Debug, Clone)]
pub struct SpatialRobot {
    pub simulation: SpatialSimulation,
    pub reference: ReferenceGenerator<2>,
    /// (yaw, pitch) of the joints at the start \[rad\].
    posture: Vec<Vector2<f64>>,
    period: f64,
    accelerometer: Accelerometer,
    /// The link with the inertial sensors, from 0.
    pub imu_link: usize,
}

/// All that a run changes about a robot of the spatial model.
pub type SpatialRobotState = SavedRobot<SpatialSnapshot>;

/// Attitude of the body as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Mean of the links' turns about their own axes, positive: the left side comes up; in \[-pi, pi\] \[rad\].
    pub roll: f64,
    /// Angle by which the mean direction of the body points up \[rad\].
    pub pitch: f64,
}

impl RobotModel for SpatialRobot {
    const KIND: ModelKind = ModelKind::Spatial;
    type Model = Spatial;
    type State = SpatialRobotState;

    const OBSERVATION: [&'static [BlockRow<Self>]; 3] =
        [spatial_observation::BODY, spatial_observation::CONTACT_AND_REFERENCE, spatial_observation::SENSING];

    const STATE: &'static [Quantity<Self>] = spatial_state::STATE;

    const SIGNALS: &'static [Signal<Self>] = &[
        float("height", "m", "height of the CG above the ground", SpatialRobot::height),
        float("roll", "rad", "mean turn of the links about their axes; positive: the left side comes up", |robot| {
            robot.attitude().roll
        }),
        float("pitch", "rad", "angle by which the body direction points up", |robot| robot.attitude().pitch),
        integer("grounded", "links that the ground or a top face carried in this step", |robot| {
            robot.force_from_below().filter(|force| *force > 0.0).count() as f64
        }),
        integer("self_contacts", "pairs of links pressed on each other at the end of this step", |robot| {
            robot.simulation.body().warm_start.last.contacts.pressed_pairs(robot.robot().link_count()) as f64
        }),
        float("self_contact_force", "N", "largest mean force of the other links on a link in this step", |robot| {
            robot.largest_self_contact_force()
        }),
        integer("overbent", "joints bent beyond a right angle: none unless `joint_limit` allows it", |robot| {
            robot.overbent() as f64
        }),
    ];

    fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        let scene = config.scene(Vec::new());
        let simulation = SpatialSimulation::new(&config.robot, &scene, &config.controller(), &config.integrator)?;
        let robot = simulation.robot();
        let gait = config.default_gait();
        let entries = spatial_entries(config.action_mode, &gait, &robot.axes, config.reach());
        Ok(Self {
            reference: ReferenceGenerator::new(entries, gait, config.control_period).on(&robot.axes),
            posture: vec![Vector2::zeros(); robot.joint_count()],
            simulation,
            period: config.control_period,
            accelerometer: Accelerometer::default(),
            imu_link: config.imu_link,
        })
    }

    common_methods!();

    fn reset(&mut self, start: &Start, joint_angle: &[f64]) {
        let Start { position, angle, phase, has_own_posture } = start;
        for (posture, yaw) in self.posture.iter_mut().zip(joint_angle) {
            *posture = Vector2::new(*yaw, 0.0);
        }
        let head = Pose { position: position.push(0.0), orientation: orientation_of(*angle, 0.0, 0.0) };
        self.simulation.place_chain(head, &self.posture);
        self.simulation.rest_on_ground();
        self.reference.rest_in_posture(*phase);
        if *has_own_posture {
            self.reference.rest_bent(|joint, axis| self.posture[joint][axis]);
        }
        self.lock_joints();
        self.accelerometer = Accelerometer::default();
    }

    fn raise(&mut self, chain: &RaisedChain) {
        self.simulation.place_chain(chain.pose[0], &chain.joint_angle);
        if !chain.has_own_height {
            self.simulation.rest_on_ground();
        }
        if chain.has_own_posture {
            self.reference.rest_bent(|joint, axis| chain.joint_angle[joint][axis]);
        }
        if let Some(grip) = chain.grip {
            self.reference.rest_wound(|joint, axis| grip * chain.joint_angle[joint][axis]);
        }
        self.lock_joints();
    }

    fn strike(&mut self, link: usize, impulse: &Vector3<f64>) {
        let mass = self.simulation.body().parameters.mass * self.simulation.robot().links[link].mass;
        let mut velocity = self.simulation.body_mut().state.twist[link].fixed_rows_mut::<3>(0);
        velocity += impulse / mass;
    }

    fn finish_period(&mut self) {
        self.reference.finish_period();
        let velocity = self.simulation.state().twist[self.imu_link].fixed_rows::<3>(0).into();
        self.accelerometer.finish_period(velocity, self.period);
    }

    fn height(&self, link: usize) -> f64 {
        self.simulation.state().pose[link].position.z
    }

    fn motion(&self) -> Motion {
        let (robot, state) = (self.robot(), self.simulation.state());
        let (mut position, mut velocity) = (Vector2::zeros(), Vector2::zeros());
        let mut yaw_rate = 0.0;
        for ((link, pose), u) in robot.links.iter().zip(&state.pose).zip(&state.twist) {
            position += link.mass * pose.position.xy();
            velocity += link.mass * Vector2::new(u.x, u.y);
            yaw_rate += (pose.orientation * turning(u)).z;
        }
        let mass = robot.total_mass();
        let ahead = ahead(state);
        Motion {
            position: position / mass,
            velocity: velocity / mass,
            heading: ahead.y.atan2(ahead.x),
            yaw_rate: yaw_rate / robot.link_count() as f64,
        }
    }

    fn joint_coordinates(&self) -> usize {
        self.robot().axis_list().count()
    }

    fn read_joints(&self, angle: &mut [f64], rate: &mut [f64]) {
        let robot = self.robot();
        angle.iter_mut().zip(robot.of_axes(self.joint_angles())).for_each(|(angle, present)| *angle = present);
        rate.iter_mut().zip(robot.of_axes(self.joint_rates())).for_each(|(rate, present)| *rate = present);
    }

    fn link(&self, index: usize) -> LinkPose {
        let pose = &self.simulation.state().pose[index];
        let axis = pose.axis();
        LinkPose { x: pose.position.x, y: pose.position.y, angle: axis.y.atan2(axis.x) }
    }
}

impl SpatialRobot {
    /// Mean acceleration of the link with the sensor over the last control period, less gravity, world frame \[m/s^2\].
    pub fn specific_force(&self) -> Vector3<f64> {
        self.accelerometer.acceleration - self.simulation.system().gravity
    }

    /// Mean normal force of the ground on each link over the last control period \[N\].
    pub fn normal_force(&self) -> impl Iterator<Item = f64> + '_ {
        self.simulation.ground_impulse().iter().map(|impulse| impulse / self.period)
    }

    /// The same with that of top faces: what a sensor under the link feels \[N\].
    pub fn force_from_below(&self) -> impl Iterator<Item = f64> + '_ {
        self.normal_force().zip(&self.simulation.body().impulses.top).map(|(ground, top)| ground + top / self.period)
    }

    /// Angles of the joints, zero about axes that they do not have \[rad\].
    pub fn joint_angles(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..self.robot().joint_count()).map(|joint| self.simulation.joint_angle(joint))
    }

    /// And their rates \[rad/s\].
    pub fn joint_rates(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..self.robot().joint_count()).map(|joint| self.simulation.joint_rate(joint))
    }

    /// Locked joints keep their present angles.
    fn lock_joints(&mut self) {
        let angle = |joint: usize| self.simulation.joint_angle(joint);
        let locked = self.simulation.robot().locked();
        self.reference.lock(locked.map(|joint| Held { joint, angle: angle(joint) }));
    }

    /// Keeps references that integrate rates near the joints.
    fn limit_windup(&mut self) {
        let angle = |joint: usize, axis: usize| self.simulation.joint_angle(joint)[axis];
        self.reference.limit_windup(self.simulation.system().gains(), angle);
    }

    /// Height of the CG above the ground \[m\].
    pub fn height(&self) -> f64 {
        let robot = self.robot();
        let links = robot.links.iter().zip(&self.simulation.state().pose);
        links.map(|(link, pose)| link.mass * pose.position.z).sum::<f64>() / robot.total_mass()
    }

    /// Number of joints whose yaw or pitch is beyond a right angle, where the stop of a joint is by default.
    pub fn overbent(&self) -> usize {
        self.joint_angles().filter(|[a, b]| a.abs().max(b.abs()) > FRAC_PI_2 + AT_STOP).count()
    }

    pub fn attitude(&self) -> Attitude {
        let state = self.simulation.state();
        // Heights of e_x^B, the right side going forward, and e_y^B: (0, 1) for a link that lies flat and unrolled.
        let up = state.pose.iter().fold(Vector2::zeros(), |sum, pose| {
            let seen = pose.orientation.inverse_transform_vector(&Vector3::z());
            sum + seen.xy()
        });
        let ahead = ahead(state);
        Attitude { roll: (-up.x).atan2(up.y), pitch: ahead.z.atan2(ahead.xy().norm()) }
    }
}

/// How far a joint that is pressed against its stop may be beyond it, by the tolerance of the solver \[rad\].
const AT_STOP: f64 = 1e-6;

/// Sum of the links' forward directions; link 1 leads, so they are -e_z^B.
fn ahead(state: &SpatialState) -> Vector3<f64> {
    state.pose.iter().fold(Vector3::zeros(), |sum, pose| sum - pose.axis())
}
