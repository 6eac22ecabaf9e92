//! Sections of the configuration: checked one by one, their defaults, and what each model has.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pythonize::pythonize;
use serde::de::DeserializeOwned;
use snake_core::ConfigError;
use snake_core::capabilities::{CAPABILITIES, Feature, ModelName, Support};
use snake_core::control::ControllerConfig;
use snake_core::environment::{EnvConfig, Randomization};
use snake_core::laws::Stribeck;
use snake_core::noise::NoiseConfig;
use snake_core::obstacles::{Obstacle, Patch};
use snake_core::robot::{Motor, Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::stepping::ImplicitConfig;
use snake_thesis::{IntegratorConfig, ThesisConfig};

use crate::ffi::CoreError;
use crate::from_python::{field_of, from_python};
use crate::gait::GaitConfig;
use crate::run::{default_controller, default_scene};
use crate::start::StartConfig;

/// Checks one section of a configuration.
///
/// # Errors
/// ConfigError, with the section's name before the field.
#[pyfunction]
pub fn check(section: &str, config: &Bound<'_, PyAny>) -> PyResult<()> {
    let outcome = match section {
        "robot" => read::<RobotConfig>(section, config).and_then(|c| Robot::new(&c).map(drop)),
        "motor" => read::<Motor>(section, config).and_then(|c| c.validate()),
        "obstacle" => read::<Obstacle>(section, config).and_then(|c| c.validate()),
        "scene" => read::<SceneConfig>(section, config).and_then(|c| Scene::new(&c).map(drop)),
        "stribeck" => read::<Stribeck>(section, config).and_then(|c| c.validate()),
        "patch" => read::<Patch>(section, config).and_then(|c| c.validate()),
        "gait" => read::<GaitConfig>(section, config).and_then(|c| c.validate()),
        "controller" => read::<ControllerConfig>(section, config).and_then(|c| c.validate()),
        "integrator" => read::<IntegratorConfig>(section, config).and_then(|c| c.validate()),
        "noise" => read::<NoiseConfig>(section, config).and_then(|c| c.validate()),
        "randomization" => read::<Randomization>(section, config).and_then(|c| c.validate()),
        other => return Err(unknown(other)),
    };
    outcome.map_err(|error| CoreError::Config(error.inside(section)).into())
}

/// An error about the whole section has no field of its own.
fn read<T: DeserializeOwned>(section: &str, config: &Bound<'_, PyAny>) -> Result<T, ConfigError> {
    from_python(config).map_err(|error| match error.field.as_str() {
        "" => ConfigError { field: section.to_owned(), ..error },
        _ => error,
    })
}

/// The configuration of an environment.
///
/// # Errors
/// Names the field that is not admissible, also where the method of time stepping is not that of environments.
pub fn environment_config(config: &Bound<'_, PyAny>) -> Result<EnvConfig, ConfigError> {
    if let Some(integrator) = field_of(config, "integrator") {
        let chosen: IntegratorConfig = from_python(&integrator).map_err(|e| e.inside("integrator"))?;
        let method = chosen.method();
        let on = (ModelName::Planar, method);
        Feature::Environments.require(on, true, "integrator.method", format!("\"{}\"", method.name()))?;
    }
    from_python(config)
}

/// The defaults of a section, for a model where they depend on it.
///
/// # Errors
/// ConfigError: there is no such section or model.
#[pyfunction]
#[pyo3(signature = (section, model = None))]
pub fn defaults<'py>(py: Python<'py>, section: &str, model: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
    let model = model.map_or(Ok(ModelName::Planar), from_python::<ModelName>).map_err(CoreError::from)?;
    let plain = match section {
        "environment" => pythonize(py, &EnvConfig::default()),
        "robot" => pythonize(py, &RobotConfig::default()),
        "motor" => pythonize(py, &Motor::default()),
        "scene" => pythonize(py, &default_scene(model)),
        "stribeck" => pythonize(py, &Stribeck::default()),
        "gait" => pythonize(py, &GaitConfig::default()),
        "controller" => pythonize(py, &default_controller(model)),
        "io_controller" => pythonize(py, &ControllerConfig::io()),
        "integrator" => pythonize(py, &ImplicitConfig::default()),
        "thesis_integrator" => pythonize(py, &ThesisConfig::default()),
        "noise" => pythonize(py, &NoiseConfig::default()),
        "randomization" => pythonize(py, &Randomization::default()),
        "start" => pythonize(py, &StartConfig::default()),
        other => return Err(unknown(other)),
    };
    Ok(plain?)
}

fn unknown(section: &str) -> PyErr {
    CoreError::Config(ConfigError::new("section", section, "the name of a section")).into()
}

/// What not every model has: per feature "name", "off", the value that switches it off, and for "planar", "spatial"
/// and "minimal" True, False, or "implicit" where the feature needs the method "implicit".
#[pyfunction]
pub fn capabilities(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for capability in &CAPABILITIES {
        let row = PyDict::new(py);
        row.set_item("name", capability.name)?;
        row.set_item("off", capability.off)?;
        for model in ModelName::ALL {
            match capability.of(model) {
                Support::Never => row.set_item(model.name(), false)?,
                Support::Implicit => row.set_item(model.name(), "implicit")?,
                Support::Always => row.set_item(model.name(), true)?,
            }
        }
        rows.append(row)?;
    }
    Ok(rows)
}
