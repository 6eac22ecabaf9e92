//! Robots in space: error against run time, alone and in lanes, and the throughput of environments.

mod precision;
mod reference;
mod robots;
mod scenes;
mod throughput;

use std::path::Path;

use snake_core::ConfigError;

/// Emits all that is measured of the spatial model.
///
/// # Errors
/// A scene is not admissible.
pub fn measure(quick: bool, cache: Option<&Path>) -> Result<(), ConfigError> {
    precision::measure(quick, cache)?;
    throughput::measure(quick)
}
