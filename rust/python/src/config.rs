//! Sections of the configuration: checked one by one, and their defaults.

use pyo3::prelude::*;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::environment::Randomization;
use snake_core::laws::Stribeck;
use snake_core::minimal::{FeedbackConfig, NoiseConfig};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::stepping::IntegratorConfig;

use crate::decode::decode;
use crate::gait::GaitConfig;
use crate::gate::Fault;
use crate::ground::GroundConfig;

/// Checks one section of a configuration.
///
/// # Errors
/// ConfigError, with the section's name before the field.
#[pyfunction]
pub fn check(section: &str, config_json: &str) -> PyResult<()> {
    let outcome = match section {
        "robot" => decode::<RobotConfig>(config_json).and_then(|c| Robot::new(&c).map(drop)),
        "scene" => decode::<SceneConfig>(config_json).and_then(|c| Scene::new(&c).map(drop)),
        "controller" => decode::<ControllerConfig>(config_json).and_then(|c| c.validate()),
        "ground" => decode::<GroundConfig>(config_json).and_then(|c| c.validate()),
        "feedback" => decode::<FeedbackConfig>(config_json).and_then(|c| c.validate()),
        "noise" => decode::<NoiseConfig>(config_json).and_then(|c| c.validate()),
        "stribeck" => decode::<Stribeck>(config_json).and_then(|c| c.validate()),
        "randomization" => decode::<Randomization>(config_json).and_then(|c| c.validate()),
        "integrator" => decode::<IntegratorConfig>(config_json).and_then(|c| c.validate()),
        "gait" => decode::<GaitConfig>(config_json).and_then(|c| c.validate()),
        other => Err(ConfigError::new("section", other, "the name of a section")),
    };
    let written = match section {
        "ground" => "scene",
        "feedback" => "controller",
        other => other,
    };
    outcome.map_err(|error| Fault::Config(error.inside(written)).into())
}

/// The defaults of a section as JSON text.
#[pyfunction]
pub fn defaults(section: &str) -> Option<String> {
    match section {
        "robot" => serde_json::to_string(&RobotConfig::default()),
        "scene" => serde_json::to_string(&SceneConfig::default()),
        "controller" => serde_json::to_string(&ControllerConfig::default()),
        "integrator" => serde_json::to_string(&IntegratorConfig::default()),
        "gait" => serde_json::to_string(&GaitConfig::default()),
        _ => return None,
    }
    .ok()
}
