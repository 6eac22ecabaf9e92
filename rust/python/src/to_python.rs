//! Configurations as Python's dicts, lists, numbers and text.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use serde::Serialize;

/// A configuration as Python has it, fields in their order.
///
/// # Errors
/// `value` has a map whose keys are not text.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|error| PyTypeError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}
