//! The environment: actions, observations, rewards and episodes around a simulation.
//!
//! One control period: [`action`] maps an action to gait parameters, [`reference`] turns them into smooth joint
//! references, which are [`filtered_parameter`]s, the simulation advances, [`episode`] evaluates reward and
//! termination, [`observation`] reports what a policy may observe and [`signal`] everything else. At the start of an
//! episode one of the [`scenarios`] places the robot ([`start`], [`path`]), the pegs and the goal. All this is the same
//! for every model; a [`RobotModel`] does what is not.

pub mod action;
pub mod config;
pub mod default_gait;
pub mod env;
pub mod episode;
pub mod filtered_parameter;
pub mod goal;
mod latency;
pub mod motion;
pub mod observation;
pub mod path;
pub mod perception;
pub mod perturbation;
pub mod polyline;
pub mod quantity;
pub mod raised_chain;
pub mod randomization;
pub mod reference;
pub mod reward;
pub mod rng;
pub mod robot_model;
pub mod scenarios;
mod sensors;
pub mod signal;
pub mod start;
pub mod symmetry;

pub use config::{ActionMode, EnvConfig, FieldKind, ModelKind, Perception};
pub use env::{Environment, EnvironmentState, Outcome};
pub use perturbation::{Course, Perturbation};
pub use raised_chain::Raised;
pub use randomization::Randomization;
pub use reward::RewardWeights;
pub use robot_model::{PlanarRobot, PlanarRobotState, RobotModel, SpatialRobot, SpatialRobotState};
pub use scenarios::{OwnGoal, OwnStart, Task, World};
