//! Time stepping: what all models share.
//!
//! A [`Model`] provides its state, its stage ([`StageInput`], [`StageKernels`], [`StageOutput`]) and how its steps are
//! divided; *when* and *how often* a stage is solved, in which lanes, and what happens when it is not solved, is decided
//! here. A [`Fleet`] advances robots by their [`StepPlan`]s; a [`group::Group`] takes one step of as many of them as a
//! register has lanes.

mod awake;
mod backlash;
mod body;
mod closing;
mod config;
mod drives;
pub(crate) mod energy;
mod fleet;
mod found_friction;
mod found_rows;
mod friction_shares;
mod group;
mod joint_stops;
mod kernels;
mod lane_count;
pub(crate) mod lanes;
mod link_impulses;
mod model;
mod motors;
mod obstacle_impulses;
pub(crate) mod penetration;
mod plan;
mod plant_parameters;
mod queues;
mod record;
pub mod sdirk;
mod springs;
mod stage;
pub(crate) mod start;
mod state;
mod statistics;
mod verdict;

pub use awake::{AT_REST, Awake, are_within, holding};
pub use backlash::{Backlash, MovedAxis};
pub use body::{Body, Clock, Driven, Scripted};
pub use closing::{Closing, ClosingRow, Closings};
pub use config::{
    Accuracy, ImplicitConfig, ImplicitMethod, MOST_STEPS_PER_PERIOD, Precision, require_steps, steps_in, tolerance,
    validate_iterations,
};
pub use drives::Drives;
pub use energy::EnergyLedger;
pub use fleet::Fleet;
pub(crate) use fleet::group_for;
pub use found_friction::FoundFriction;
pub use found_rows::{FoundRow, FoundRows, SolvedMotion};
pub use friction_shares::{ContactPoint, FrictionShares};
pub use group::AnyGroup;
pub use joint_stops::{JointStops, StageStop};
pub use lane_count::{available_lanes, forced_lanes, widest_lanes};
pub use lanes::Members;
pub use link_impulses::LinkImpulses;
pub use model::{Model, WarmStart};
pub use motors::Motors;
pub use obstacle_impulses::ObstacleImpulses;
pub use plan::StepPlan;
pub use plant_parameters::PlantParameters;
pub use record::{Record, StageRecord};
pub use springs::StageSpring;
pub use stage::{ContactImpulse, SolvedStage, StageInput, StageKernels, StageOutput};
pub use state::{Coordinates, LinkPose, MAX_RATE, MAX_SPEED, RobotState, StateOf};
pub use statistics::StepStatistics;
pub use verdict::{Effort, FallbackResult};
pub(crate) use verdict::{NEARBY, is_worth_an_end, may_fall_back, solves_within};
