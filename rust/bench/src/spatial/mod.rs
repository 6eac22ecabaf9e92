//! The 3D model: error against run time, of one robot and of a fleet in lanes.

mod precision;
mod robots;
mod scenes;

pub use precision::measure;
pub use robots::{Robot, staggered, time_window};
pub use scenes::{SpatialScenario, course, sidewinding};
