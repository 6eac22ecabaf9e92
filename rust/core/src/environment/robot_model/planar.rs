//! The robot of the planar model with its joint references.

use nalgebra::{Vector2, Vector3};

use crate::error::ConfigError;
use crate::planar::{Heading, Planar};
use crate::simulation::{PlanarSimulation, PlanarSnapshot};

use super::accelerometer::Accelerometer;
use super::common_methods::common_methods;
use super::saved_robot::SavedRobot;
use super::{RobotModel, planar_observation, planar_state};
use crate::environment::action::planar_entries;
use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::motion::Motion;
use crate::environment::observation::BlockRow;
use crate::environment::perception::LinkPose;
use crate::environment::quantity::Quantity;
use crate::environment::reference::{Held, ReferenceGenerator};
use crate::environment::signal::{Signal, float, integer};
use crate::environment::start::Start;

/// Simulation and references of a planar robot.
#[derive(Debug, Clone)]
pub struct PlanarRobot {
    pub simulation: PlanarSimulation,
    pub reference: ReferenceGenerator<1>,
    period: f64,
    accelerometer: Accelerometer,
    /// The link with the inertial sensors, from 0.
    pub imu_link: usize,
}

/// All that a run changes about a planar robot.
pub type PlanarRobotState = SavedRobot<PlanarSnapshot>;

impl RobotModel for PlanarRobot {
    const KIND: ModelKind = ModelKind::Planar;
    const SIGNALS: &'static [Signal<Self>] = &[
        integer("self_contacts", "pairs of links pressed on each other at the end of this step", |robot| {
            robot.simulation.body().warm_start.self_contacts.pressed_pairs(robot.robot().link_count()) as f64
        }),
        float("self_contact_force", "N", "largest mean force of the other links on a link in this step", |robot| {
            robot.largest_self_contact_force()
        }),
    ];
    const STATE: &'static [Quantity<Self>] = planar_state::STATE;
    const OBSERVATION: [&'static [BlockRow<Self>]; 3] =
        [planar_observation::BODY, planar_observation::CONTACT_AND_REFERENCE, planar_observation::SENSING];
    type Model = Planar;
    type State = PlanarRobotState;

    fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        let scene = config.scene(Vec::new());
        let simulation = PlanarSimulation::new(&config.robot, &scene, &config.controller(), &config.integrator)?;
        let robot = simulation.robot();
        let entries = planar_entries(config.action_mode, robot.joint_count(), config.reach());
        let reference = ReferenceGenerator::new(entries, config.default_gait(), config.control_period);
        let (period, accelerometer) = (config.control_period, Accelerometer::default());
        Ok(Self { simulation, reference, period, accelerometer, imu_link: config.imu_link })
    }

    common_methods!();

    fn reset(&mut self, start: &Start, joint_angle: &[f64]) {
        let Start { position, angle, phase, has_own_posture } = start;
        self.simulation.place_chain(position.x, position.y, *angle, joint_angle);
        self.reference.rest_in_posture(*phase);
        if *has_own_posture {
            self.reference.rest_bent(|joint, _| joint_angle[joint]);
        }
        let locked = self.simulation.robot().locked();
        self.reference.lock(locked.map(|joint| Held { joint, angle: [joint_angle[joint], 0.0] }));
        self.accelerometer = Accelerometer::default();
    }

    fn strike(&mut self, link: usize, impulse: &Vector3<f64>) {
        let mass = self.simulation.body().parameters.mass * self.simulation.robot().links[link].mass;
        self.simulation.body_mut().state.twist[link] += impulse.xy().push(0.0) / mass;
    }

    fn finish_period(&mut self) {
        self.reference.finish_period();
        let velocity = self.simulation.state().twist[self.imu_link].xy().push(0.0);
        self.accelerometer.finish_period(velocity, self.period);
    }

    fn motion(&self) -> Motion {
        Motion::of(self.simulation.robot(), self.simulation.state())
    }

    fn joint_coordinates(&self) -> usize {
        self.robot().joint_count()
    }

    fn read_joints(&self, angle: &mut [f64], rate: &mut [f64]) {
        let state = self.simulation.state();
        angle.iter_mut().enumerate().for_each(|(joint, value)| *value = state.joint_angle(joint));
        rate.iter_mut().enumerate().for_each(|(joint, value)| *value = state.joint_rate(joint));
    }

    fn link(&self, index: usize) -> LinkPose {
        let pose = &self.simulation.state().pose[index];
        LinkPose { x: pose.x, y: pose.y, angle: pose.z }
    }
}

impl PlanarRobot {
    /// Mean acceleration of the link with the sensor over the last control period, less gravity, world frame \[m/s^2\].
    pub fn specific_force(&self) -> Vector2<f64> {
        self.accelerometer.acceleration.xy() - self.simulation.system().pull()
    }

    /// Mean force of the pegs on each link over the last control period, to its left \[N\].
    pub fn lateral_force(&self) -> impl Iterator<Item = f64> + '_ {
        let links = self.contact_force().zip(&self.simulation.state().pose);
        // The left of a link that moves along -e_x^B is -e_y^B.
        let lateral = |force: Vector3<f64>, angle| -force.xy().dot(&Heading::of(angle).lateral());
        links.map(move |(force, pose)| if force == Vector3::zeros() { 0.0 } else { lateral(force, pose.z) })
    }

    /// Keeps references that integrate rates near the joints.
    fn limit_windup(&mut self) {
        let (state, gains) = (self.simulation.state(), self.simulation.system().gains());
        self.reference.limit_windup(gains, |joint, _| state.joint_angle(joint));
    }
}
