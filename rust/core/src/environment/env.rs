//! One environment: a robot, a sampler of scenarios, and the rules of the task.

mod state;

pub use state::EnvironmentState;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, require, within};
use crate::obstacles::{Obstacle, PlacedMovable};
use crate::planar::{PlanarState, PlanarSystem};
use crate::robot::Robot;
use crate::scene::Peg;
use crate::simulation::PlanarSimulation;
use crate::stepping::PlantParameters;

use super::action::ActionEntry;
use super::config::{EnvConfig, Perception};
use super::episode::{Episode, Rules};
use super::goal::{Goal, Target};
use super::latency::Latency;
use super::observation::{Delay, ObservationBlock, ObservationLayout, Setup, View};
use super::perception::{PegView, Surroundings};
use super::randomization::{EpisodeParameters, Randomization};
use super::reference::ReferenceGenerator;
use super::rng::Rng;
use super::robot_model::PlanarRobot;
use super::robot_model::RobotModel;
use super::scenarios::{ScenarioSampler, World};
use super::sensors::Sensors;
use super::signal::{SignalRow, Summary};

/// A robot with a task, stepped by actions.
#[derive(Debug, Clone)]
pub struct Environment<M: 'static = PlanarRobot> {
    rules: Rules,
    sampler: ScenarioSampler,
    /// Shared by all environments of a batch.
    layout: Arc<ObservationLayout<M>>,
    /// Unscaled observation.
    values: Vec<f64>,
    model: M,
    randomization: Randomization,
    latency: Latency,
    sensors: Sensors,
    peg_view: PegView,
    /// The pegs without error, scanned where critics observe them.
    true_pegs: PegView,
    sees_true_pegs: bool,
    /// Friction coefficients along and across a link.
    friction: [f64; 2],
    /// What late sensors have reported.
    delay: Delay,
    /// Where the next episode takes place, if it is prescribed.
    next_world: Option<Box<World>>,
    source: Source,
    drawn: EpisodeParameters,
    episode: Episode,
    action: Vec<f64>,
    /// Mean squared change of the action in the present step.
    action_change: f64,
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

impl<M: RobotModel> Environment<M> {
    /// An environment at the start of episode 0 of seed 0.
    ///
    /// # Errors
    /// Names the field of the configuration, its value and the admissible range.
    pub fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        require(config.model == M::KIND, "model", format!("{:?}", config.model), &format!("{:?}", M::KIND))?;
        let model = M::new(config)?;
        let robot = model.robot();
        let sampler = ScenarioSampler::new(config, robot)?;
        let rules = Rules::new(config, robot.total_mass() * robot.gravity);
        let peg_view = PegView::new(config.perception, config.nearest_pegs, robot.links.len(), robot.total_length());
        let (links, length) = (robot.links.len(), robot.total_length());
        let true_pegs = PegView::new(Perception::Pegs, config.nearest_pegs, links, length);
        let motion = model.motion();
        // The first episode, begun below, has a target of its own.
        let goal_line = Target::Line { distance: config.goal_distance, centre_line: 0.0 };
        let episode = Episode::begin(goal_line, None, motion, 1.0);
        let setup = Setup { config, robot, actions: model.action_entries(), peg_view: &peg_view };
        let layout = ObservationLayout::new(&setup)?;
        let size = model.action_entries().len();
        let mut environment = Self {
            values: vec![0.0; layout.size()],
            sees_true_pegs: layout.blocks().iter().any(|block| block.row.name == "privileged_pegs"),
            true_pegs,
            friction: config.ground().friction,
            delay: Delay::new(&layout),
            layout: Arc::new(layout),
            action: vec![0.0; size],
            action_change: 0.0,
            source: Source { seed: 0, next_episode: 0, episode: 0 },
            drawn: EpisodeParameters::default(),
            randomization: config.randomization,
            latency: latency(config, size),
            next_world: None,
            sensors: Sensors::new(config, model.joint_coordinates(), motion),
            rules,
            sampler,
            model,
            peg_view,
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
        self.sampler.set_difficulty(difficulty);
        Ok(())
    }

    /// The difficulty of the episodes to come.
    pub fn difficulty(&self) -> f64 {
        self.sampler.difficulty()
    }

    /// Whether an episode can take place in a world.
    ///
    /// # Errors
    /// The robot has no room there.
    pub fn check_world(&mut self, world: &World) -> Result<(), ConfigError> {
        self.sampler.check(world)
    }

    /// Prescribes where the next episode takes place; the ones after it draw it again. The world has been checked.
    pub fn set_next_world(&mut self, world: World) {
        self.next_world = Some(Box::new(world));
    }

    /// Seed and number of the next episode.
    pub fn next_episode(&self) -> (u64, u64) {
        (self.source.seed, self.source.next_episode)
    }

    /// What the episode has drawn beside the scene.
    pub fn drawn(&self) -> &EpisodeParameters {
        &self.drawn
    }

    /// Changes how the robot of this episode differs from the configured one.
    pub fn set_parameters(&mut self, parameters: PlantParameters) {
        self.drawn.parameters = parameters;
        self.model.set_parameters(parameters);
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
        self.model.advance();
        self.end_step(observation)
    }

    /// First part of a step: turns the action into joint references. A [`crate::stepping::Fleet`] may then advance the
    /// robots of many environments together.
    pub fn begin_step(&mut self, action: &[f64]) {
        self.action_change = self.take_action(action);
        match self.latency.pass(&self.action) {
            Some(action) => self.model.set_action(action),
            None => self.model.hold_reference(),
        }
    }

    /// Last part of a step, after the robot was advanced by a control period: updates the episode and writes
    /// the observation.
    pub fn end_step(&mut self, observation: &mut [f32]) -> Outcome {
        let report = self.model.report();
        self.model.finish_period();
        let contacts = (0..self.robot().link_count()).filter(|&link| self.model.is_pressed(link)).count() as u32;
        let motion = if report.diverged { self.episode.motion } else { self.model.motion() };
        self.episode.record(&self.rules, motion, &report, self.action_change, contacts);
        self.observe(observation);
        self.outcome()
    }

    /// Writes the current observation.
    pub fn observe(&mut self, observation: &mut [f32]) {
        let Source { seed, episode, .. } = self.source;
        let steps = self.episode.steps;
        self.sensors.measure(&self.model, &self.episode, || Rng::of_step(seed, episode, steps));
        let obstacles = &self.model.simulation().body().obstacles;
        let around = Surroundings {
            obstacles: self.sensors.obstacles(obstacles),
            walls: obstacles.walls(),
            movables: self.model.movables(),
        };
        self.peg_view.scan(|link| self.model.link(link), &around);
        if self.sees_true_pegs {
            self.true_pegs.scan(|link| self.model.link(link), &Surroundings { obstacles, ..around });
        }
        let view = View {
            model: &self.model,
            sensors: &self.sensors,
            bearing: self.episode.bearing(),
            speed: self.episode.goal.speed.unwrap_or(0.0),
            previous_action: &self.action,
            peg_view: &self.peg_view,
            true_pegs: &self.true_pegs,
            friction: self.friction,
        };
        // Another stream than that of the sensors.
        let rng = || Rng::of_step(seed, episode, steps ^ 1 << 31);
        self.layout.write(&view, &mut self.values, observation, rng);
        self.delay.pass(&self.layout, steps, observation);
    }

    /// Reward, flags and signals of the last step or reset.
    pub fn outcome(&self) -> Outcome {
        Outcome {
            reward: self.episode.summary.reward.total(),
            terminated: self.episode.is_terminated(&self.rules),
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

    /// Names of the blocks that only the option `observation_blocks` adds.
    pub fn blocks_on_request(&self) -> &[&'static str] {
        self.layout.on_request()
    }

    pub fn observation_blocks(&self) -> &[ObservationBlock<M>] {
        self.layout.blocks()
    }

    pub fn action_entries(&self) -> &[ActionEntry] {
        self.model.action_entries()
    }

    /// The robot with its references.
    pub fn model(&self) -> &M {
        &self.model
    }

    pub fn model_mut(&mut self) -> &mut M {
        &mut self.model
    }

    pub fn robot(&self) -> &Robot {
        self.model.robot()
    }

    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    pub fn summary(&self) -> &Summary {
        &self.episode.summary
    }

    pub fn pegs(&self) -> &[Peg] {
        self.model.pegs()
    }

    /// All obstacles of the episode, in the order of its scene.
    pub fn obstacles(&self) -> Vec<Obstacle> {
        self.model.simulation().body().obstacles.obstacles()
    }

    /// The obstacles that can be pushed, in the order of the scene, where they are now.
    pub fn movables(&self) -> impl Iterator<Item = PlacedMovable<'_>> {
        self.model.movables()
    }

    /// Mean force of each obstacle on the robot over the last control period, world frame, in the order of
    /// [`Self::obstacles`]; without a z part in the plane \[N\].
    pub fn obstacle_force(&self) -> Vec<[f64; 3]> {
        let body = self.model.simulation().body();
        let mut force = vec![[0.0; 3]; body.obstacles.total()];
        for (obstacle, impulse) in body.obstacle_impulse.sums().iter().enumerate() {
            force[body.obstacles.index_in_scene(obstacle)] = (impulse / self.rules.period).into();
        }
        force
    }

    /// Where the robot has to go.
    pub fn goal(&self) -> &Goal {
        &self.episode.goal
    }

    /// Angle from +x to the goal direction \[rad\].
    pub fn goal_direction(&self) -> f64 {
        self.episode.bearing()
    }

    /// The smallest number of push-points in any body length on the way to the goal, see
    /// [`super::scenarios::PushPointCounter`].
    pub fn push_points(&self) -> usize {
        self.sampler.push_points(&self.episode.goal, self.model.pegs())
    }

    /// Resets everything after a panic, but continues with the episodes of its own seed.
    pub fn recover(&mut self, prototype: &Self) {
        let (source, difficulty) = (self.source, self.sampler.difficulty());
        self.clone_from(prototype);
        self.source = source;
        self.sampler.set_difficulty(difficulty);
    }

    fn begin(&mut self, seed: u64, episode: u64) {
        let mut rng = Rng::new(seed, episode);
        let world = self.next_world.take();
        let scene = self.sampler.draw(world.as_deref(), &mut rng);
        let simulation = self.model.simulation_mut();
        match self.sampler.scene() {
            None => simulation.set_scene_pegs(self.sampler.pegs()),
            Some(scene) => simulation.set_obstacles(Arc::clone(scene)),
        }
        self.model.reset(&scene.start, self.sampler.joint_angle());
        if let Some(chain) = self.sampler.raised() {
            self.model.raise(chain);
        }
        self.source.episode = episode;
        self.take_drawn(self.randomization.draw(&mut rng));
        self.latency.begin((self.drawn.delay / self.rules.period).round() as u32);
        self.episode = Episode::begin(scene.target, scene.speed, self.model.motion(), self.drawn.parameters.mass);
        self.action.fill(0.0);
    }

    /// Sets the drawn parameters of the robot and the errors of its sensors for the present pegs.
    fn take_drawn(&mut self, drawn: EpisodeParameters) {
        self.drawn = drawn;
        self.model.set_parameters(drawn.parameters);
        let mut rng = Rng::of_step(self.source.seed, self.source.episode, u32::MAX);
        self.sensors.begin(&self.model.simulation().body().obstacles, &mut rng);
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
}

/// The latency between policy and references that a configuration selects.
fn latency(config: &EnvConfig, action_size: usize) -> Latency {
    let periods = |time: f64| (time / config.control_period).round() as u32;
    let every = config.randomization.reference_rate.map_or(1, |rate| periods(1.0 / rate));
    Latency::new(action_size, every, periods(config.randomization.reference_delay[1]))
}

impl Environment<PlanarRobot> {
    pub fn system(&self) -> &PlanarSystem {
        self.model.simulation.system()
    }

    pub fn state(&self) -> &PlanarState {
        self.model.simulation.state()
    }

    /// The simulation, for rendering and tests.
    pub fn simulation(&self) -> &PlanarSimulation {
        &self.model.simulation
    }

    /// The joints' reference generator, for rendering and tests.
    pub fn reference(&self) -> &ReferenceGenerator<1> {
        &self.model.reference
    }
}
