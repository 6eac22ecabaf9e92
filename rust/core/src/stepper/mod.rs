//! Time stepping of the planar model: the thesis's scheme and the project's default.

mod config;
mod implicit;
mod stage_builder;
mod tally;
mod thesis;

pub use config::{IntegratorConfig, Method};
pub use implicit::{Implicit, WarmStart};
pub use stage_builder::Plant;
pub use tally::Tally;
pub use thesis::Thesis;
