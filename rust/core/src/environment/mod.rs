//! The environment: actions, observations, rewards and episodes around a simulation.
//!
//! One control period: [`action`] maps an action to gait parameters, [`reference`] turns them into
//! smooth joint references made of [`channel`]s, the simulation advances, [`episode`] keeps the books by
//! its rules, [`observation`] reports what a policy may sense, [`signal`] everything else. At the start
//! of an episode [`arena`] places the robot ([`start`], [`path`]) and lays out the pegs ([`field`]).
//! All this is the same for every model; what is not, a [`Machine`] does.

pub mod action;
mod arena;
pub mod cardan_reference;
pub mod channel;
pub mod config;
pub mod env;
pub mod episode;
pub mod field;
pub mod goal;
mod latency;
pub mod machine;
pub mod motion;
pub mod nominal;
pub mod observation;
pub mod path;
pub mod perception;
pub mod perturbation;
mod planar_machine;
pub mod random;
pub mod randomization;
pub mod reference;
pub mod reward;
mod senses;
pub mod signal;
mod spatial_machine;
mod spatial_senses;
pub mod start;

pub use config::{ActionMode, EnvConfig, FieldKind, Model, Perception, RewardWeights, Task};
pub use env::{Environment, EnvironmentState, Outcome};
pub use machine::Machine;
pub use perturbation::{Course, Perturbation};
pub use planar_machine::{PlanarMachine, PlanarMachineState};
pub use randomization::Randomization;
pub use spatial_machine::{SpatialMachine, SpatialMachineState};
