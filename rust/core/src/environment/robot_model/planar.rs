//! The robot of the planar model with its joint references.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::gait::{JointReference, JointTarget, WaveJets};
use crate::planar::{Body, Heading, Planar};
use crate::robot::Robot;
use crate::scene::{Peg, SceneConfig};
use crate::simulation::{PlanarSimulation, PlanarSnapshot};
use crate::stepping::{Driven, PlantParameters, StepStatistics};

use super::{RobotModel, planar_observation};
use crate::environment::action::{ActionEntry, planar_entries};
use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::motion::Motion;
use crate::environment::observation::BlockRow;
use crate::environment::perception::LinkPose;
use crate::environment::reference::{ReferenceGenerator, ReferenceState};
use crate::environment::signal::Signal;
use crate::environment::start::Start;

/// Simulation and references of a planar robot.
#[derive(Debug, Clone)]
pub struct PlanarRobot {
    pub simulation: PlanarSimulation,
    pub reference: ReferenceGenerator<1>,
    /// Mean obstacle force on each link over the last control period, to its left \[N\].
    contact_force: Vec<f64>,
}

/// All that a run changes about a planar robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanarRobotState {
    simulation: PlanarSnapshot,
    reference: ReferenceState,
    pegs: Vec<Peg>,
    contact_force: Vec<f64>,
}

impl RobotModel for PlanarRobot {
    const KIND: ModelKind = ModelKind::Planar;
    const SIGNALS: &'static [Signal<Self>] = &[];
    const OBSERVATION: [&'static [BlockRow<Self>]; 2] =
        [planar_observation::BODY, planar_observation::CONTACT_AND_REFERENCE];
    type State = PlanarRobotState;

    fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        let scene = SceneConfig { friction: config.friction(), stribeck: config.stribeck, ..SceneConfig::default() };
        let simulation = PlanarSimulation::new(&config.robot, &scene, &config.controller, &config.integrator)?;
        let robot = simulation.robot();
        let entries = planar_entries(config.action_mode, robot.joint_count());
        let reference = ReferenceGenerator::new(entries, config.default_gait(), config.control_period);
        Ok(Self { contact_force: vec![0.0; robot.link_count()], simulation, reference })
    }

    fn robot(&self) -> &Robot {
        self.simulation.robot()
    }

    fn pegs(&self) -> &[Peg] {
        self.simulation.pegs()
    }

    fn action_entries(&self) -> &[ActionEntry] {
        self.reference.entries()
    }

    fn reset(&mut self, start: &Start, joint_angle: &[f64], pegs: &[Peg]) {
        let Start { position, angle, phase } = start;
        self.simulation.set_scene_pegs(pegs);
        self.simulation.place_chain(position.x, position.y, *angle, joint_angle);
        self.reference.rest_in_posture(*phase);
        self.contact_force.fill(0.0);
    }

    fn set_action(&mut self, action: &[f64]) {
        self.reference.set_action(action, self.simulation.state().time);
    }

    fn hold_reference(&mut self) {
        self.reference.hold_reference(self.simulation.state().time);
    }

    fn set_parameters(&mut self, parameters: PlantParameters) {
        self.simulation.body_mut().parameters = parameters;
    }

    fn advance(&mut self, period: f64) {
        self.simulation.advance(period, &self.reference);
    }

    fn finish_period(&mut self, period: f64) -> u32 {
        self.reference.finish_period();
        self.read_contact_force(period)
    }

    fn report(&self) -> StepStatistics {
        self.simulation.body().statistics
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

    fn save(&self) -> PlanarRobotState {
        PlanarRobotState {
            simulation: self.simulation.snapshot(),
            reference: self.reference.state().clone(),
            pegs: self.pegs().to_vec(),
            contact_force: self.contact_force.clone(),
        }
    }

    fn restore(&mut self, state: &PlanarRobotState) -> bool {
        let links = self.contact_force.len();
        let fits = state.contact_force.len() == links
            && state.simulation.fits(links, state.pegs.len())
            && self.reference.restore(&state.reference);
        if fits {
            self.simulation.set_scene_pegs(&state.pegs);
            self.simulation.restore(&state.simulation);
            self.contact_force.copy_from_slice(&state.contact_force);
        }
        fits
    }

    fn links_of(state: &PlanarRobotState) -> usize {
        state.contact_force.len()
    }
}

impl PlanarRobot {
    /// Mean force of the pegs on each link over the last control period, to its left \[N\].
    pub fn lateral_force(&self) -> &[f64] {
        &self.contact_force
    }

    /// Mean lateral contact forces of the last period; returns the number of links that were pushed.
    fn read_contact_force(&mut self, period: f64) -> u32 {
        let mut contacts = 0;
        let links = self.simulation.contact_impulse().iter().zip(&self.simulation.state().pose);
        for (force, (impulse, pose)) in self.contact_force.iter_mut().zip(links) {
            let pushed = *impulse != Vector2::zeros();
            // The left of a link that moves along -e_x^B is -e_y^B.
            let to_left = |impulse: &Vector2<f64>| -impulse.dot(&Heading::of(pose.z).lateral());
            *force = if pushed { to_left(impulse) / period } else { 0.0 };
            contacts += u32::from(pushed);
        }
        contacts
    }
}

impl Driven for PlanarRobot {
    type Model = Planar;

    fn body(&self) -> &Body {
        self.simulation.body()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.simulation.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.reference.targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.reference.travelling_wave(time)
    }
}
