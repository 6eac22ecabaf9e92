//! Time stepping: what all models share.
//!
//! A [`Model`] brings its state, its stage ([`StageWork`]) and how its steps are divided; everything about *when* and
//! *how often* a stage is solved, in which lanes, and what happens when it is not solved, is decided here. A [`Fleet`]
//! advances robots by their [`StepPlan`]s, a [`group::Group`] takes one step of as many of them as a register has
//! lanes.

mod body;
mod config;
pub(crate) mod energy;
mod fleet;
mod group;
mod growing;
mod halving;
pub(crate) mod kernels;
pub(crate) mod lanes;
mod model;
mod plan;
mod plant_parameters;
pub(crate) mod sdirk;
pub(crate) mod start;
mod statistics;
mod verdict;

pub use body::{Body, Clock, HasBody, Scripted};
pub use config::{ImplicitConfig, IntegratorConfig, Method, ThesisConfig};
pub use energy::EnergyLedger;
pub use fleet::Fleet;
pub use growing::Growing;
pub use halving::Halving;
pub use kernels::CompiledModel;
pub use lanes::Members;
pub use model::{ContactImpulse, Driven, Model, Reference, RobotState, SolvedStage, StageWork, WarmStart};
pub use plan::StepPlan;
pub use plant_parameters::PlantParameters;
pub use statistics::StepStatistics;
pub use verdict::FallbackResult;
