//! `layout`: what each element of observation, action and info means.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use pythonize::pythonize;
use snake_core::environment::action::ActionEntry;
use snake_core::environment::observation::ObservationBlock;
use snake_core::environment::quantity::quantities_of;
use snake_core::environment::reward::{RewardTerm, TERMS};
use snake_core::environment::signal::{SignalInfo, signals_of};
use snake_core::environment::{EnvConfig, Environment, ModelKind, PlanarRobot, RobotModel, SpatialRobot, Task};
use snake_core::robot::Robot;

use crate::config::environment_config;
use crate::ffi::{CoreError, detached};

/// Describes the environment of a configuration: "observation", "action", "reward", "signals" and "state" entry by
/// entry, "on_request", the names of the blocks that only `observation_blocks` adds, "control_period" \[s\],
/// "link_half_length" and "link_radius" of the contact shape and "link_cg_offset" \[m\], and "config", the whole
/// configuration with its defaults.
#[pyfunction]
pub fn layout<'py>(py: Python<'py>, config: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let config = environment_config(config).map_err(CoreError::from)?;
    match config.model {
        ModelKind::Planar => describe::<PlanarRobot>(py, &config),
        ModelKind::Spatial => describe::<SpatialRobot>(py, &config),
    }
}

fn describe<'py, M: RobotModel>(py: Python<'py>, config: &EnvConfig) -> PyResult<Bound<'py, PyDict>> {
    let environment = detached(py, || Ok(Environment::<M>::new(config)?))?;
    let dict = PyDict::new(py);
    dict.set_item("observation", list(py, environment.observation_blocks(), describe_block)?)?;
    dict.set_item("on_request", environment.blocks_on_request())?;
    dict.set_item("action", list(py, environment.action_entries(), describe_action)?)?;
    dict.set_item("reward", list(py, TERMS, describe_reward)?)?;
    dict.set_item("signals", list(py, &signals_of::<M>(), describe_signal)?)?;
    dict.set_item("state", describe_state::<M>(py, environment.robot())?)?;
    dict.set_item("control_period", config.control_period)?;
    let links = &environment.robot().links;
    dict.set_item("link_half_length", links.iter().map(|link| link.contact_half_length).collect::<Vec<_>>())?;
    dict.set_item("link_cg_offset", links.iter().map(|link| link.cg_offset).collect::<Vec<_>>())?;
    dict.set_item("link_radius", links.iter().map(|link| link.radius).collect::<Vec<_>>())?;
    dict.set_item("config", pythonize(py, config)?)?;
    Ok(dict)
}

/// The families of scenes, in order: "name", the value of the option `task`; "id", the environment of the planar model;
/// "description"; and "goal", "line" or "disc".
#[pyfunction]
pub fn scenarios(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    list(py, &Task::ALL, |dict, task| {
        let family = task.family();
        dict.set_item("name", family.name)?;
        dict.set_item("id", family.id)?;
        dict.set_item("model", family.model.name().name())?;
        dict.set_item("torque_limit", family.torque_limit)?;
        dict.set_item("description", family.description)?;
        dict.set_item("goal", family.goal.name())
    })
}

fn list<'py, T>(
    py: Python<'py>,
    items: &[T],
    describe: fn(&Bound<'py, PyDict>, &T) -> PyResult<()>,
) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for item in items {
        let dict = PyDict::new(py);
        describe(&dict, item)?;
        list.append(dict)?;
    }
    Ok(list)
}

fn describe_state<'py, M: RobotModel>(py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for quantity in quantities_of::<M>() {
        let dict = PyDict::new(py);
        dict.set_item("name", quantity.name)?;
        dict.set_item("shape", (quantity.shape)(robot))?;
        dict.set_item("unit", quantity.unit)?;
        dict.set_item("description", quantity.description)?;
        list.append(dict)?;
    }
    Ok(list)
}

fn describe_block<M>(dict: &Bound<'_, PyDict>, block: &ObservationBlock<M>) -> PyResult<()> {
    let ObservationBlock { row, start, elements, scale, .. } = block;
    dict.set_item("name", row.name)?;
    dict.set_item("start", start)?;
    dict.set_item("size", block.size())?;
    dict.set_item("elements", elements.iter().map(|element| &element.name).collect::<Vec<_>>())?;
    dict.set_item("mirror", elements.iter().map(|element| element.parity.sign()).collect::<Vec<_>>())?;
    dict.set_item("memory", row.memory)?;
    dict.set_item("unit", row.unit)?;
    dict.set_item("scale", scale)?;
    dict.set_item("low", -row.bound)?;
    dict.set_item("high", row.bound)?;
    dict.set_item("description", row.description)
}

fn describe_action(dict: &Bound<'_, PyDict>, entry: &ActionEntry) -> PyResult<()> {
    dict.set_item("name", &entry.name)?;
    dict.set_item("low", entry.low())?;
    dict.set_item("high", entry.high())?;
    dict.set_item("slew", entry.slew)?;
    dict.set_item("unit", entry.parameter.unit())?;
    dict.set_item("mirror", entry.parameter.parity().sign())?;
    dict.set_item("meaning", entry.meaning)
}

fn describe_reward(dict: &Bound<'_, PyDict>, term: &RewardTerm) -> PyResult<()> {
    dict.set_item("name", term.name)?;
    dict.set_item("weight", term.default_weight)?;
    dict.set_item("unit", term.unit)?;
    dict.set_item("description", term.description)
}

fn describe_signal(dict: &Bound<'_, PyDict>, signal: &SignalInfo) -> PyResult<()> {
    dict.set_item("name", &signal.name)?;
    dict.set_item("kind", signal.kind.name())?;
    dict.set_item("unit", signal.unit)?;
    dict.set_item("description", &signal.description)
}
