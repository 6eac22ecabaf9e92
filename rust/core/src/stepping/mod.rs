//! Time stepping: what all models share.

mod config;
pub(crate) mod energy;
pub(crate) mod lanes;
pub(crate) mod sdirk;
pub(crate) mod start;
mod statistics;

pub use config::{IntegratorConfig, Method};
pub use statistics::{StepReport, Tally};
