//! Configuration from JSON text, with errors that name the field as the user writes it.

use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use serde_json::Value;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::minimal::{FeedbackConfig, NoiseConfig};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::stepper::IntegratorConfig;
use snake_core::task::Randomization;

use crate::gait::GaitConfig;
use crate::gate::Fault;
use crate::ground::GroundConfig;

/// Parses a configuration.
///
/// # Errors
/// Names the field that is unknown or of the wrong type.
pub fn decode<T: DeserializeOwned>(json: &str) -> Result<T, ConfigError> {
    let mut deserializer = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        explain(json, path.trim_start_matches('.'), &error.inner().to_string())
    })
}

/// Turns serde's message at `path` into field, value and what is expected.
fn explain(json: &str, path: &str, message: &str) -> ConfigError {
    let message = message.split(" at line ").next().unwrap_or(message);
    let (complaint, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    if let Some(name) = complaint.strip_prefix("unknown field ") {
        let name = name.trim_matches('`');
        let parent = path.strip_suffix(name).unwrap_or(path).trim_end_matches('.');
        let field = if parent.is_empty() { name.to_owned() } else { format!("{parent}.{name}") };
        let value = value_at(json, &field);
        return ConfigError::new(field, value, format!("a known field: {}", expected.trim_start_matches("one of ")));
    }
    let expected = if complaint.starts_with("data did not match any variant") {
        "a number, or a list of numbers"
    } else {
        in_words(expected)
    };
    ConfigError::new(path, value_at(json, path), if expected.is_empty() { complaint } else { expected })
}

fn in_words(kind: &str) -> &str {
    match kind {
        "f64" => "a finite number",
        "usize" | "u32" | "u64" => "an integer >= 0",
        other => other,
    }
}

/// The value at a path such as `scene.obstacles[2][0]`, as the user would write it.
fn value_at(json: &str, path: &str) -> String {
    let pointer: String = path.split(['.', '[']).map(|part| format!("/{}", part.trim_end_matches(']'))).collect();
    let root: Value = serde_json::from_str(json).unwrap_or(Value::Null);
    let value = if path.is_empty() { Some(&root) } else { root.pointer(&pointer) };
    match value {
        Some(Value::String(text)) if ["nan", "inf", "-inf"].contains(&text.as_str()) => text.clone(),
        Some(value) => value.to_string(),
        None => "?".to_owned(),
    }
}

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
