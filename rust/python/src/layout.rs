//! `layout`: what each element of observation, action and info means.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use snake_core::task::action::ActionEntry;
use snake_core::task::observation::ObservationBlock;
use snake_core::task::signal::{SIGNALS, Signal};
use snake_core::task::{EnvConfig, Environment};

use crate::config::decode;
use crate::gate::detached;

/// Describes the environment of a configuration: "observation", "action" and "signals" entry by entry,
/// "control_period" \[s\], and "config", the JSON text of the whole configuration with its defaults.
#[pyfunction]
pub fn layout<'py>(py: Python<'py>, config_json: &str) -> PyResult<Bound<'py, PyDict>> {
    let (config, environment) = detached(py, || {
        let config: EnvConfig = decode(config_json)?;
        let environment = Environment::new(&config)?;
        Ok((config, environment))
    })?;
    let dict = PyDict::new(py);
    dict.set_item("observation", list(py, environment.observation_blocks(), describe_block)?)?;
    dict.set_item("action", list(py, environment.action_entries(), describe_action)?)?;
    dict.set_item("signals", list(py, &SIGNALS, describe_signal)?)?;
    dict.set_item("control_period", config.control_period)?;
    dict.set_item("config", serde_json::to_string(&config).unwrap_or_default())?;
    Ok(dict)
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

fn describe_block(dict: &Bound<'_, PyDict>, block: &ObservationBlock) -> PyResult<()> {
    dict.set_item("name", block.name)?;
    dict.set_item("start", block.start)?;
    dict.set_item("size", block.size())?;
    dict.set_item("elements", &block.elements)?;
    dict.set_item("unit", block.unit)?;
    dict.set_item("scale", block.scale)?;
    dict.set_item("low", block.low)?;
    dict.set_item("high", block.high)?;
    dict.set_item("description", block.description)
}

fn describe_action(dict: &Bound<'_, PyDict>, entry: &ActionEntry) -> PyResult<()> {
    dict.set_item("name", &entry.name)?;
    dict.set_item("low", entry.low())?;
    dict.set_item("high", entry.high())?;
    dict.set_item("slew", entry.slew)?;
    dict.set_item("unit", entry.unit)?;
    dict.set_item("meaning", entry.meaning)
}

fn describe_signal(dict: &Bound<'_, PyDict>, signal: &Signal) -> PyResult<()> {
    dict.set_item("name", signal.name)?;
    dict.set_item("kind", signal.kind.name())?;
    dict.set_item("unit", signal.unit)?;
    dict.set_item("description", signal.description)
}
