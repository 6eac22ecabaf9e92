//! Time stepping of the planar model: the thesis's scheme and the project's default.

mod body;
mod config;
mod contacts;
pub(crate) mod division;
mod fleet;
mod free_play;
mod group;
mod hardest;
mod io_drive;
pub(crate) mod lanes;
mod pace;
mod plant;
mod rescue;
pub(crate) mod sdirk;
mod stage_kernels;
mod stage_work;
pub(crate) mod start;
mod tally;
mod thesis;
mod variation;
mod weakening;
pub(crate) mod works;

pub use body::{Body, Driven, Scripted, WarmStart};
pub use config::{IntegratorConfig, Method};
pub use fleet::Fleet;
pub use group::Adaptive;
pub use hardest::Hardest;
pub use pace::Pace;
pub use plant::Plant;
pub use tally::Tally;
pub use thesis::Thesis;
pub use variation::Variation;
