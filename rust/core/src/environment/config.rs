//! What a user may choose about an environment; read by constructors only.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};

use crate::capabilities::{Feature, Method, ModelName};
use crate::control::{ControlLaw, ControllerConfig, Treatment};
use crate::error::{ConfigError, integer_in, require, within};
use crate::laws::Stribeck;
use crate::obstacles::Obstacle;
use crate::robot::{MAX_LINKS, Motor, NO_PLAY, PerAxis, RobotConfig};
use crate::scene::{Scene, SceneConfig};
use crate::slope::Slope;
use crate::stepping::{ImplicitConfig, MOST_STEPS_PER_PERIOD, require_steps};

use super::action::Reach;
use super::default_gait::DefaultGait;
use super::perturbation::Perturbation;
use super::randomization::Randomization;
use super::reward::RewardWeights;
use super::scenarios::{GoalKind, Task};

/// Which model of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelKind {
    /// Links that slide in the plane (T ch. 3).
    Planar,
    /// Links in 3D on cardan joints, which lift and roll (T ch. 4).
    Spatial,
}

impl ModelKind {
    /// Its column in the table of capabilities.
    pub fn name(self) -> ModelName {
        match self {
            ModelKind::Planar => ModelName::Planar,
            ModelKind::Spatial => ModelName::Spatial,
        }
    }
}

/// What an action prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ActionMode {
    /// Amplitude, frequency, phase shift and offset of the travelling wave.
    Gait,
    /// The n - 1 joint angles.
    Joints,
    /// The wave, and an offset at each joint.
    Residual,
    /// The rates of the n - 1 joint angles.
    Velocities,
    /// The n - 1 torques of the actuators; gains are not used.
    Torques,
}

impl ActionMode {
    /// Whether joints follow a travelling wave.
    pub fn has_wave(self) -> bool {
        matches!(self, ActionMode::Gait | ActionMode::Residual)
    }

    /// Whether joints follow reference angles of their own.
    pub fn has_references(self) -> bool {
        matches!(self, ActionMode::Joints | ActionMode::Velocities)
    }
}

/// Whether the robot locates pegs, and from where, or feels contact forces only (T 5.4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Perception {
    /// The nearest ones from the leading link.
    Pegs,
    /// These, and from each link the nearest one.
    Body,
    Blind,
}

/// Generator of the random field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FieldKind {
    /// One of the others, drawn again each episode with equal chances.
    Mixed,
    /// Pegs alternating along the natural path of the gait, as in the thesis's courses.
    Track,
    /// A staggered lattice.
    Lattice,
    /// Pegs thrown at random, never closer than a passage's width.
    Poisson,
}

/// Kind of uneven ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TerrainKind {
    /// One of the others, drawn again each episode with equal chances.
    Mixed,
    /// Waves of all directions.
    Rough,
    /// Squares of different heights.
    Blocks,
    /// Steps up and down.
    Stairs,
    /// Slopes up and down.
    Ramps,
}

/// An environment's configuration; the keys are the keyword arguments of the Python class.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EnvConfig {
    pub model: ModelKind,
    pub task: Task,
    pub action_mode: ActionMode,
    pub perception: Perception,
    /// Number of pegs the robot locates at a time, nearest first.
    #[serde(deserialize_with = "integer_in::<_, 1, MAX_NEAREST_PEGS>")]
    pub nearest_pegs: usize,
    /// Time between two actions \[s\].
    pub control_period: f64,
    /// Steps after which an episode is cut off.
    pub max_episode_steps: u32,
    /// Distance of the goal line from the start of the robot's CG \[m\].
    pub goal_distance: f64,
    /// Distance of the corridor's walls from its centre line \[m\]; an episode ends where the CG leaves it.
    pub corridor_half_width: f64,
    /// Radius of the goal, where it is a point \[m\].
    pub goal_radius: f64,
    /// Largest turn of the way to a goal point, or of a commanded direction, at difficulty one \[rad\].
    pub turn: f64,
    /// Interval of the commanded speed \[m/s\].
    pub speed: [f64; 2],
    /// Irregularity of a random field in \[0, 1\].
    pub difficulty: f64,
    /// Kind of random field.
    pub field: FieldKind,
    /// Kind of uneven ground.
    pub terrain: TerrainKind,
    /// Random fields and mazes are drawn again until every body length of the way has so many push-points; 0: as they
    /// come.
    #[serde(deserialize_with = "integer_in::<_, 0, MOST_PUSH_POINTS>")]
    pub push_points: usize,
    /// What happens to the pegs of a perturbed course.
    pub perturbation: Perturbation,
    /// What differs from episode to episode beside the scene.
    pub randomization: Randomization,
    /// A scene of the user's, whose ground replaces that of the task; the obstacles of each episode are prescribed.
    pub scene: Option<SceneConfig>,
    /// Names of the observation's blocks; `None`: all that the task and the action mode have.
    pub observation_blocks: Option<Vec<String>>,
    /// Whether the observation also has what a robot cannot sense, for critics.
    pub privileged: bool,
    /// Amplitudes of uniform noise on the blocks of the observation, by name and in their units.
    pub observation_noise: BTreeMap<String, f64>,
    /// Delays of the blocks of the observation, by name \[s\].
    pub observation_delay: BTreeMap<String, f64>,
    /// The link with accelerometer, gyroscope and sense of gravity, from 0.
    #[serde(deserialize_with = "integer_in::<_, 0, MAX_LINKS>")]
    pub imu_link: usize,
    /// The link with the range finder, from 0.
    #[serde(deserialize_with = "integer_in::<_, 0, MAX_LINKS>")]
    pub range_link: usize,
    /// Angle between two marks of the joint encoders; zero: joint angles are read exactly \[rad\].
    pub encoder_resolution: f64,
    /// What the energy and the cost of transport count.
    pub energy: Energy,
    /// What ends an episode.
    pub termination: Termination,
    /// Of the task's ground: friction coefficients along and across a link; `None`: the task's own.
    pub friction: Option<[f64; 2]>,
    /// Its coefficient along a link that slides backward; none: as forward.
    pub friction_backward: Option<f64>,
    /// How its friction falls in sliding.
    pub stribeck: Stribeck,
    /// Its inclination of the ground \[rad\], and the direction in which it rises \[rad\].
    pub slope: Slope,
    pub controller: ControllerConfig,
    pub integrator: ImplicitConfig,
    pub robot: RobotConfig,
    pub reward_weights: RewardWeights,
    /// Scale of the random start pose and phase in \[0, 1\]; zero: always the same start.
    pub start_jitter: f64,
}

/// What the energy of an episode counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The positive work of the actuators.
    #[default]
    Mechanical,
    /// What the motors draw.
    Electrical,
}

/// Which events end an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Termination {
    /// The goal has been reached.
    pub is_success: bool,
    /// The CG has left the corridor, or strayed from the goal point.
    pub left_corridor: bool,
}

impl Default for Termination {
    fn default() -> Self {
        Self { is_success: true, left_corridor: true }
    }
}

impl Default for EnvConfig {
    fn default() -> Self {
        Self {
            model: ModelKind::Planar,
            task: Task::FIELD,
            action_mode: ActionMode::Gait,
            perception: Perception::Pegs,
            nearest_pegs: 5,
            control_period: 0.05,
            max_episode_steps: 600,
            goal_distance: 2.0,
            corridor_half_width: 0.8,
            goal_radius: 0.25,
            turn: FRAC_PI_2,
            speed: [0.05, 0.2],
            difficulty: 0.5,
            field: FieldKind::Mixed,
            terrain: TerrainKind::Mixed,
            push_points: 0,
            perturbation: Perturbation::default(),
            randomization: Randomization::default(),
            scene: None,
            observation_blocks: None,
            privileged: false,
            observation_noise: BTreeMap::new(),
            observation_delay: BTreeMap::new(),
            imu_link: 0,
            range_link: 0,
            encoder_resolution: 0.0,
            energy: Energy::default(),
            termination: Termination::default(),
            friction: None,
            friction_backward: None,
            stribeck: Stribeck::default(),
            slope: Slope::default(),
            controller: ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() },
            integrator: ImplicitConfig::default(),
            robot: RobotConfig::default(),
            reward_weights: RewardWeights::default(),
            start_jitter: 1.0,
        }
    }
}

impl EnvConfig {
    /// Checks what the physics does not: everything but robot, controller and integrator.
    ///
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let is_in_space = self.task.family().model == ModelKind::Spatial;
        let expected = format!("\"spatial\" for the task \"{}\"", self.task.family().name);
        require(self.model == ModelKind::Spatial || !is_in_space, "model", "\"planar\"", &expected)?;
        let pegs = self.nearest_pegs;
        require((1..=MAX_NEAREST_PEGS).contains(&pegs), "nearest_pegs", pegs, "an integer in [1, 64]")?;
        within("control_period", self.control_period, 0.001, 1.0)?;
        require_steps(self.control_period, self.integrator.step(), MOST_STEPS_PER_PERIOD, "control_period")?;
        let steps = self.max_episode_steps;
        require(steps >= 1, "max_episode_steps", steps, "an integer >= 1")?;
        within("goal_distance", self.goal_distance, 0.1, 20.0)?;
        within("corridor_half_width", self.corridor_half_width, 0.1, 5.0)?;
        self.validate_goal_radius()?;
        within("turn", self.turn, 0.0, FRAC_PI_2)?;
        within("speed[0]", self.speed[0], 0.0, FASTEST_COMMAND)?;
        within("speed[1]", self.speed[1], self.speed[0], FASTEST_COMMAND)?;
        self.perturbation.validate().map_err(|e| e.inside("perturbation"))?;
        let points = self.push_points;
        require(points <= MOST_PUSH_POINTS, "push_points", points, "an integer in [0, 4]")?;
        self.randomization.validate_for(self.control_period).map_err(|e| e.inside("randomization"))?;
        within("difficulty", self.difficulty, 0.0, 1.0)?;
        let links = self.robot.links;
        for (name, link) in [("imu_link", self.imu_link), ("range_link", self.range_link)] {
            require(link < links, name, link, &format!("a link, an integer in [0, {}]", links.saturating_sub(1)))?;
        }
        within("encoder_resolution", self.encoder_resolution, 0.0, COARSEST_ENCODER)?;
        within("start_jitter", self.start_jitter, 0.0, 1.0)?;
        Scene::new(&self.ground())?;
        self.validate_features()?;
        self.reward_weights.validate().map_err(|e| e.inside("reward_weights"))?;
        (self.task.family().validate)(self)
    }

    /// Whether there may be pegs.
    pub fn has_pegs(&self) -> bool {
        self.task.family().has_pegs || self.scene.is_some()
    }

    /// The ground, a scene without obstacles.
    pub fn ground(&self) -> SceneConfig {
        let Self { friction_backward, stribeck, slope, .. } = *self;
        match &self.scene {
            Some(scene) => SceneConfig { obstacles: Vec::new(), ..scene.clone() },
            None => {
                let family = self.task.family();
                let friction = self.friction.unwrap_or_else(|| (family.friction)(self.model));
                let slope = if slope == Slope::default() { family.slope } else { slope };
                SceneConfig { friction, friction_backward, stribeck, slope, ..SceneConfig::default() }
            }
        }
    }

    /// The ground with the given obstacles.
    pub fn scene(&self, obstacles: Vec<Obstacle>) -> SceneConfig {
        SceneConfig { obstacles, ..self.ground() }
    }

    /// The controller of the joints. Where actions are torques, k_D alone is left, as the damping of the actuators: like
    /// motors they have a no-load speed, the largest torque over k_D.
    pub fn controller(&self) -> ControllerConfig {
        let controller = self.controller.driving(&self.robot);
        match self.action_mode {
            ActionMode::Torques => ControllerConfig { kp: 0.0, ..controller },
            _ => controller,
        }
    }

    /// What bounds the actions.
    pub fn reach(&self) -> Reach {
        let torque = self.controller().torque_limit.unwrap_or(f64::INFINITY);
        let rates = self.robot.motor.iter().flat_map(PerAxis::values).map(|motor| motor.no_load_speed);
        Reach { torque, rate: rates.fold(f64::INFINITY, f64::min) }
    }

    /// The gait of action zero.
    pub fn default_gait(&self) -> DefaultGait {
        (self.task.family().gait)(self.model)
    }

    /// What torques as actions cannot go with.
    fn validate_torques(&self) -> Result<(), ConfigError> {
        if self.action_mode != ActionMode::Torques {
            return Ok(());
        }
        let mode = "with action_mode=\"torques\"";
        let limited = self.controller().torque_limit.is_some();
        require(limited, "controller.torque_limit", "None", &format!("a number, the largest torque, {mode}"))?;
        let law = self.controller.law;
        require(law == ControlLaw::Pd, "controller.law", "\"io\"", &format!("\"pd\" {mode}"))?;
        require(self.robot.kp.is_none(), "robot.kp", "gains", &format!("None {mode}, which have no reference"))?;
        let play = self.robot.backlash.largest().max(self.randomization.backlash[1]);
        require(play == 0.0, "robot.backlash", play, &format!("0 {mode}"))
    }

    /// A robot does not start inside the disc it has to reach.
    fn validate_goal_radius(&self) -> Result<(), ConfigError> {
        let largest = match self.task.family().goal {
            GoalKind::Disc => 0.9 * self.goal_distance,
            GoalKind::Line | GoalKind::Direction => LARGEST_GOAL,
        };
        within("goal_radius", self.goal_radius, 0.01, largest)?;
        Ok(())
    }

    /// What the model does not have, and backlash and the Stribeck effect on top of the configured ones.
    fn validate_features(&self) -> Result<(), ConfigError> {
        let on = (self.model.name(), Method::Implicit);
        let drop = self.ground().stribeck.drop;
        let treatment = self.controller.treatment;
        let held = treatment != Treatment::Implicit;
        Feature::HeldTorques.require(on, held, "controller.treatment", treatment)?;
        self.validate_torques()?;
        let is_drawn = self.energy == Energy::Electrical;
        let expected = "\"mechanical\" where robot.motor is None";
        require(!is_drawn || self.robot.motor.is_some(), "energy", "\"electrical\"", expected)?;
        let (play, law, drawn) = (self.robot.backlash.largest(), self.controller.law, self.randomization.backlash);
        let is_tight = !self.robot.motor.iter().flat_map(PerAxis::values).any(Motor::needs_tight_gear);
        require(is_tight || drawn[1] == 0.0, "randomization.backlash", format!("{drawn:?}"), NO_PLAY)?;
        self.randomization.validate_beyond(play, law, drop).map_err(|e| e.inside("randomization"))
    }
}

/// A tenth of a turn \[rad\].
const COARSEST_ENCODER: f64 = TAU / 10.0;

/// A body length is that of seven quarter waves; few fields have more.
const MOST_PUSH_POINTS: usize = 4;

/// \[m\]
const LARGEST_GOAL: f64 = 18.0;

/// \[m/s\]
const FASTEST_COMMAND: f64 = 2.0;

/// Most pegs that a robot locates at a time.
const MAX_NEAREST_PEGS: usize = 64;
