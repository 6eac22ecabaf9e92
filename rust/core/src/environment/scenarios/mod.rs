//! Families of scenes: where an episode starts, which pegs stand there and what the goal is.
//!
//! A family is one type that implements [`Scenario`] and one row, a [`Family`], which [`Task`] registers. Nothing
//! outside of a family's file depends on which one it is.

mod climb;
mod clutter;
mod command;
mod corridor;
mod course;
mod course_layout;
mod field;
mod free;
mod helix;
mod maze;
mod open_ground;
mod peg_region;
mod perturbed;
mod pipe;
mod placement;
mod push_points;
mod sampler;
mod terrain;
mod world;

use std::fmt;
use std::sync::Arc;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::ConfigError;
use crate::robot::Robot;
use crate::slope::Slope;

use super::config::{EnvConfig, ModelKind};
use super::default_gait::DefaultGait;
use super::goal::Target;
use super::rng::Rng;
use super::start::{Start, StartJitter};

pub use course_layout::continued;
pub use placement::Placement;
pub use push_points::PushPointCounter;
pub use sampler::ScenarioSampler;
pub use world::{OwnGoal, OwnStart, World};

/// Draws the episodes of one environment.
pub trait Scenario: fmt::Debug + Send + Sync {
    /// Draws start, goal and pegs of an episode and leaves the robot at its start; `difficulty` in \[0, 1\]. The
    /// start deviates by `jitter` as far as the pegs allow.
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart;
}

/// What was drawn for an episode, beside the pegs.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeStart {
    pub start: Start,
    pub target: Target,
    /// Commanded speed, if one is commanded \[m/s\].
    pub speed: Option<f64>,
}

/// What has to be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalKind {
    /// A line across the corridor along +x.
    Line,
    /// A disc around a point.
    Disc,
    /// None: a direction and a speed are commanded.
    Direction,
}

impl GoalKind {
    pub fn name(self) -> &'static str {
        match self {
            GoalKind::Line => "line",
            GoalKind::Disc => "disc",
            GoalKind::Direction => "direction",
        }
    }
}

/// Builds the scenario of a family from a configuration.
type BuildScenario = fn(&EnvConfig, &Robot) -> Result<Arc<dyn Scenario>, ConfigError>;

/// A family of scenes: one row of the registry.
pub struct Family {
    /// Value of the option `task`.
    pub name: &'static str,
    /// Id of the environment.
    pub id: &'static str,
    /// Model of that environment.
    pub model: ModelKind,
    pub description: &'static str,
    pub goal: GoalKind,
    pub has_pegs: bool,
    /// Blocks on request that its observation has without one.
    pub on_request: &'static [&'static str],
    /// Friction coefficients along and across a link, unless the configuration sets them.
    pub friction: fn(ModelKind) -> [f64; 2],
    /// Inclination of the ground, unless the configuration sets one.
    pub slope: Slope,
    /// Torque limit of the joints of its environment, see `snake_env.registration` \[N m\].
    pub torque_limit: f64,
    /// The gait of action zero.
    pub gait: fn(ModelKind) -> DefaultGait,
    /// Checks what only this family requires of a configuration.
    pub validate: fn(&EnvConfig) -> Result<(), ConfigError>,
    pub scenario: BuildScenario,
}

impl Family {
    /// Pegs on isotropic ground, lateral undulation and a goal line; each family states the rest.
    const DEFAULT: Self = Self {
        name: "",
        id: "",
        model: ModelKind::Planar,
        description: "",
        goal: GoalKind::Line,
        has_pegs: true,
        on_request: &[],
        friction: |_| ISOTROPIC,
        slope: Slope { angle: 0.0, direction: 0.0 },
        torque_limit: 10.0,
        gait: |_| DefaultGait::undulation(),
        validate: |_| Ok(()),
        scenario: |config, robot| Ok(Arc::new(free::Free::new(config, robot)?)),
    };
}

const ISOTROPIC: [f64; 2] = [0.2, 0.2];

/// Ground that resists sliding across a link more than along it.
const ORTHOTROPIC: [f64; 2] = [0.2, 0.5];

/// Which family of scenes; its name in a configuration.
#[derive(Clone, Copy)]
pub struct Task(&'static Family);

/// The registry.
impl Task {
    pub const COURSE: Task = Task(&course::FAMILY);
    pub const FIELD: Task = Task(&field::FAMILY);
    pub const FREE: Task = Task(&free::FAMILY);
    pub const PERTURBED: Task = Task(&perturbed::FAMILY);
    pub const MAZE: Task = Task(&maze::FAMILY);
    pub const CORRIDOR: Task = Task(&corridor::FAMILY);
    pub const COMMAND: Task = Task(&command::FAMILY);
    pub const TERRAIN: Task = Task(&terrain::FAMILY);
    pub const PIPE: Task = Task(&pipe::FAMILY);
    pub const CLIMB: Task = Task(&climb::FAMILY);
    pub const CLUTTER: Task = Task(&clutter::FAMILY);

    pub const ALL: [Task; 11] = [
        Task::COURSE,
        Task::FIELD,
        Task::FREE,
        Task::PERTURBED,
        Task::MAZE,
        Task::CORRIDOR,
        Task::COMMAND,
        Task::TERRAIN,
        Task::PIPE,
        Task::CLIMB,
        Task::CLUTTER,
    ];

    pub fn family(self) -> &'static Family {
        self.0
    }
}

impl PartialEq for Task {
    fn eq(&self, other: &Self) -> bool {
        self.0.name == other.0.name
    }
}

impl fmt::Debug for Task {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(self.0.name)
    }
}

impl Serialize for Task {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name)
    }
}

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TaskName)
    }
}

/// Reads a family by its name.
struct TaskName;

static NAMES: [&str; Task::ALL.len()] = {
    let mut names = [""; Task::ALL.len()];
    let mut task = 0;
    while task < names.len() {
        names[task] = Task::ALL[task].0.name;
        task += 1;
    }
    names
};

impl Visitor<'_> for TaskName {
    type Value = Task;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "one of \"{}\"", NAMES.join("\", \""))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Task, E> {
        let found = Task::ALL.into_iter().find(|task| task.0.name == name);
        found.ok_or_else(|| E::unknown_variant(name, &NAMES))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_are_read_by_their_names() {
        for task in Task::ALL {
            let text = serde_json::to_string(&task).unwrap();
            assert_eq!(text, format!("\"{}\"", task.family().name));
            assert_eq!(serde_json::from_str::<Task>(&text).unwrap(), task);
            assert!(!task.family().description.is_empty() && task.family().id.starts_with("Snake"));
        }
        let unknown = serde_json::from_str::<Task>("\"swamp\"").unwrap_err().to_string();
        assert!(unknown.contains("`swamp`, expected one of `course`, `field`"), "{unknown}");
    }

    #[test]
    fn names_and_ids_are_distinct() {
        for (k, a) in Task::ALL.iter().enumerate() {
            assert!(Task::ALL[..k].iter().all(|b| a != b && a.family().id != b.family().id));
        }
    }
}
