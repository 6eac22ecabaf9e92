//! One environment: a robot, an arena, and the rules of the task.

use std::sync::Arc;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, require, within};
use crate::gait::{JointReference, JointTarget, Wave};
use crate::planar::{Heading, PlanarState};
use crate::robot::Robot;
use crate::scene::{Peg, SceneConfig};
use crate::simulation::{PlanarSimulation, SimulationState, StepReport};
use crate::stepper::{Body, Driven, Plant};

use super::action::ActionEntry;
use super::arena::Arena;
use super::config::EnvConfig;
use super::episode::{Episode, Rules};
use super::goal::Goal;
use super::latency::Latency;
use super::motion::Motion;
use super::observation::{ObservationBlock, ObservationLayout, View};
use super::perception::PegSensor;
use super::random::Stream;
use super::randomization::{Drawn, Randomization};
use super::reference::{ReferenceGenerator, ReferenceState};
use super::senses::Senses;
use super::signal::{SignalRow, Summary};

/// A robot with a task, stepped by actions.
#[derive(Debug, Clone)]
pub struct Environment {
    rules: Rules,
    arena: Arena,
    /// Shared by all environments of a batch.
    layout: Arc<ObservationLayout>,
    /// Unscaled observation.
    values: Vec<f64>,
    simulation: PlanarSimulation,
    reference: ReferenceGenerator,
    randomization: Randomization,
    latency: Latency,
    senses: Senses,
    sensor: PegSensor,
    source: Source,
    drawn: Drawn,
    episode: Episode,
    action: Vec<f64>,
    /// Mean squared change of the action in the present step.
    action_change: f64,
    /// Mean obstacle force on each link over the last control period, to its left \[N\].
    contact_force: Vec<f64>,
}

/// Where the next episode's random numbers come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct Source {
    seed: u64,
    next_episode: u64,
    /// Episode that is running.
    episode: u64,
}

/// What a reset or a step returns beside the observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    pub reward: f64,
    pub terminated: bool,
    pub truncated: bool,
    pub signals: SignalRow,
}

/// Everything that changes while an environment runs; enough to continue it bit for bit (with the method
/// `implicit`; `thesis` starts its iteration from zero impulses) in another one
/// of the same configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnvironmentState {
    source: Source,
    difficulty: f64,
    drawn: Drawn,
    latency: Latency,
    episode: Episode,
    simulation: SimulationState,
    reference: ReferenceState,
    pegs: Vec<Peg>,
    action: Vec<f64>,
    contact_force: Vec<f64>,
}

impl Environment {
    /// An environment at the start of episode 0 of seed 0.
    ///
    /// # Errors
    /// Names the field of the configuration, its value and the admissible range.
    pub fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let scene = SceneConfig { friction: config.friction(), ..SceneConfig::default() };
        let simulation = PlanarSimulation::new(&config.robot, &scene, &config.controller, &config.integrator)?;
        let robot = simulation.robot().clone();
        let (links, joints) = (robot.link_count(), robot.joint_count());
        let arena = Arena::new(config, &robot)?;
        let rules = Rules::new(config, robot.total_mass() * robot.gravity);
        let reference = ReferenceGenerator::new(config.action_mode, joints, config.control_period);
        let sensor = PegSensor::new(config.nearest_pegs, robot.total_length());
        let motion = Motion::of(&robot, simulation.state());
        let episode = Episode::begin(arena.nominal_target(), motion, 1.0);
        let size = reference.entries().len();
        let layout = ObservationLayout::new(config, links, &sensor, reference.entries());
        let mut environment = Self {
            values: vec![0.0; layout.size()],
            layout: Arc::new(layout),
            action: vec![0.0; size],
            action_change: 0.0,
            contact_force: vec![0.0; links],
            source: Source { seed: 0, next_episode: 0, episode: 0 },
            drawn: Drawn::default(),
            randomization: config.randomization,
            latency: latency(config, size),
            senses: Senses::new(config.randomization, joints, motion),
            rules,
            arena,
            simulation,
            reference,
            sensor,
            episode,
        };
        environment.begin(0, 0);
        Ok(environment)
    }

    /// The difficulty of the episodes to come; the one that runs stays as it is.
    ///
    /// # Errors
    /// It is not in \[0, 1\].
    pub fn set_difficulty(&mut self, difficulty: f64) -> Result<(), ConfigError> {
        within("difficulty", difficulty, 0.0, 1.0)?;
        self.arena.set_difficulty(difficulty);
        Ok(())
    }

    /// What the episode has drawn beside the scene.
    pub fn drawn(&self) -> &Drawn {
        &self.drawn
    }

    /// Starts an episode: with a seed its episode 0, without one the next episode of the last seed.
    /// Writes the observation (`observation_size` elements).
    pub fn reset(&mut self, seed: Option<u64>, observation: &mut [f32]) -> Outcome {
        if let Some(seed) = seed {
            self.source = Source { seed, next_episode: 0, episode: 0 };
        }
        let Source { seed, next_episode, .. } = self.source;
        self.begin(seed, next_episode);
        self.source.next_episode = next_episode.wrapping_add(1);
        self.observe(observation);
        self.outcome()
    }

    /// One control period under `action` (finite numbers, clipped to [-1, 1]); writes the observation.
    pub fn step(&mut self, action: &[f64], observation: &mut [f32]) -> Outcome {
        self.begin_step(action);
        self.advance();
        self.end_step(observation)
    }

    /// First part of a step: turns the action into joint references.
    pub fn begin_step(&mut self, action: &[f64]) {
        self.action_change = self.take_action(action);
        let time = self.simulation.state().time;
        match self.latency.pass(&self.action) {
            Some(action) => self.reference.command(action, time),
            None => self.reference.coast(time),
        }
    }

    /// Middle part of a step: advances the robot by a control period. With the implicit method a
    /// [`crate::stepper::Fleet`] can do it for many environments at once instead.
    pub fn advance(&mut self) {
        self.simulation.advance(self.rules.period, &self.reference);
    }

    /// Last part of a step, after the robot was advanced by a control period: keeps the books and writes
    /// the observation.
    pub fn end_step(&mut self, observation: &mut [f32]) -> Outcome {
        let report = StepReport::of(self.simulation.body());
        self.reference.elapse();
        let contacts = self.read_contact_force();
        let motion = if report.diverged { self.episode.motion } else { self.motion() };
        self.episode.record(&self.rules, motion, &report, self.action_change, contacts);
        self.observe(observation);
        self.outcome()
    }

    /// Writes the current observation.
    pub fn observe(&mut self, observation: &mut [f32]) {
        let state = self.simulation.state();
        let Source { seed, episode, .. } = self.source;
        let steps = self.episode.steps;
        self.senses.measure(state, &self.episode, || Stream::of_step(seed, episode, steps));
        self.sensor.scan(&state.pose[0], self.senses.pegs(self.simulation.pegs()));
        let view = View {
            senses: &self.senses,
            bearing: self.episode.bearing(),
            contact_force: &self.contact_force,
            reference: &self.reference,
            previous_action: &self.action,
            sensor: &self.sensor,
        };
        self.layout.write(&view, &mut self.values, observation);
    }

    /// Reward, flags and signals of the last step or reset.
    pub fn outcome(&self) -> Outcome {
        Outcome {
            reward: self.episode.summary.reward.total(),
            terminated: self.episode.is_terminated(),
            truncated: self.episode.is_truncated(&self.rules),
            signals: self.episode.summary.signals(),
        }
    }

    pub fn observation_size(&self) -> usize {
        self.layout.size()
    }

    pub fn action_size(&self) -> usize {
        self.action.len()
    }

    pub fn observation_blocks(&self) -> &[ObservationBlock] {
        self.layout.blocks()
    }

    pub fn action_entries(&self) -> &[ActionEntry] {
        self.reference.entries()
    }

    pub fn robot(&self) -> &Robot {
        self.simulation.robot()
    }

    pub fn plant(&self) -> &Plant {
        self.simulation.plant()
    }

    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    pub fn summary(&self) -> &Summary {
        &self.episode.summary
    }

    pub fn state(&self) -> &PlanarState {
        self.simulation.state()
    }

    pub fn pegs(&self) -> &[Peg] {
        self.simulation.pegs()
    }

    /// The simulation, for rendering and tests.
    pub fn simulation(&self) -> &PlanarSimulation {
        &self.simulation
    }

    /// The joints' reference generator, for rendering and tests.
    pub fn reference(&self) -> &ReferenceGenerator {
        &self.reference
    }

    /// Mean force of the pegs on each link over the last control period, world frame \[N\] (T 7.6).
    pub fn obstacle_force(&self) -> impl Iterator<Item = Vector2<f64>> + '_ {
        self.simulation.contact_impulse().iter().map(|impulse| impulse / self.rules.period)
    }

    /// Where the robot has to go.
    pub fn goal(&self) -> &Goal {
        &self.episode.goal
    }

    /// The smallest number of push-points in any body length on the way to the goal, see [`super::field::Reach`].
    pub fn push_points(&self) -> usize {
        self.arena.push_points(&self.episode.goal, self.simulation.pegs())
    }

    /// Everything that changes.
    pub fn save(&self) -> EnvironmentState {
        EnvironmentState {
            source: self.source,
            difficulty: self.arena.difficulty(),
            drawn: self.drawn,
            latency: self.latency.clone(),
            episode: self.episode,
            simulation: self.simulation.snapshot(),
            reference: self.reference.state().clone(),
            pegs: self.simulation.pegs().to_vec(),
            action: self.action.clone(),
            contact_force: self.contact_force.clone(),
        }
    }

    /// Continues from a saved state.
    ///
    /// # Errors
    /// The state is of an environment with another number of links or another action mode.
    pub fn restore(&mut self, state: &EnvironmentState) -> Result<(), ConfigError> {
        let fits = state.action.len() == self.action.len()
            && state.contact_force.len() == self.contact_force.len()
            && state.simulation.fits(self.contact_force.len(), state.pegs.len())
            && self.latency.restore(&state.latency)
            && self.reference.restore(&state.reference);
        let size = format!("{} links, {} action elements", state.contact_force.len(), state.action.len());
        let expected = format!("{} links, {} action elements", self.contact_force.len(), self.action.len());
        require(fits, "state", size, &expected)?;
        self.source = state.source;
        self.arena.set_difficulty(state.difficulty);
        self.episode = state.episode;
        self.simulation.set_scene_pegs(&state.pegs);
        self.take_drawn(state.drawn);
        self.simulation.restore(&state.simulation);
        self.action.copy_from_slice(&state.action);
        self.contact_force.copy_from_slice(&state.contact_force);
        Ok(())
    }

    /// Becomes a fresh environment after a panic, but goes on with the episodes of its own seed.
    pub fn recover(&mut self, prototype: &Environment) {
        let (source, difficulty) = (self.source, self.arena.difficulty());
        self.clone_from(prototype);
        self.source = source;
        self.arena.set_difficulty(difficulty);
    }

    fn begin(&mut self, seed: u64, episode: u64) {
        let mut stream = Stream::new(seed, episode);
        let scene = self.arena.prepare(&mut stream, &mut self.simulation);
        self.source.episode = episode;
        self.take_drawn(self.randomization.draw(&mut stream));
        self.latency.begin((self.drawn.delay / self.rules.period).round() as u32);
        self.reference.rest_in_posture(&Wave::default(), scene.start.phase);
        self.episode = Episode::begin(scene.target, self.motion(), self.drawn.variation.mass);
        self.action.fill(0.0);
        self.contact_force.fill(0.0);
    }

    /// Makes the robot the one that was drawn; its sensors err about the pegs as they stand.
    fn take_drawn(&mut self, drawn: Drawn) {
        self.drawn = drawn;
        self.simulation.body_mut().variation = drawn.variation;
        let mut stream = Stream::of_step(self.source.seed, self.source.episode, u32::MAX);
        self.senses.begin(self.simulation.pegs(), &mut stream);
    }

    fn motion(&self) -> Motion {
        Motion::of(self.simulation.robot(), self.simulation.state())
    }

    /// Clips and keeps the action; returns its mean squared change.
    fn take_action(&mut self, action: &[f64]) -> f64 {
        let mut change = 0.0;
        for (kept, value) in self.action.iter_mut().zip(action) {
            let value = value.clamp(-1.0, 1.0);
            change += (value - *kept).powi(2);
            *kept = value;
        }
        change / self.action.len() as f64
    }

    /// Mean lateral contact forces of the last period; returns the number of links that were pushed.
    fn read_contact_force(&mut self) -> u32 {
        let mut contacts = 0;
        let links = self.simulation.contact_impulse().iter().zip(&self.simulation.state().pose);
        for (force, (impulse, pose)) in self.contact_force.iter_mut().zip(links) {
            let pushed = *impulse != Vector2::zeros();
            // The left of a link that moves along -e_x^B is -e_y^B.
            let to_left = |impulse: &Vector2<f64>| -impulse.dot(&Heading::of(pose.z).lateral());
            *force = if pushed { to_left(impulse) / self.rules.period } else { 0.0 };
            contacts += u32::from(pushed);
        }
        contacts
    }
}

/// The link between policy and references that a configuration asks for.
fn latency(config: &EnvConfig, action_size: usize) -> Latency {
    let periods = |time: f64| (time / config.control_period).round() as u32;
    let every = config.randomization.reference_rate.map_or(1, |rate| periods(1.0 / rate));
    Latency::new(action_size, every, periods(config.randomization.reference_delay[1]))
}

/// An environment is a robot with its reference: a fleet can advance many between `begin_step` and
/// `end_step`.
impl Driven for Environment {
    fn body(&self) -> &Body {
        self.simulation.body()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.simulation.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.reference.targets(time, targets);
    }
}
