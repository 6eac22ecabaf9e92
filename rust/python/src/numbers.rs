//! Arrays for Python.

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Puts `values`, row-major, into `dict` as a float64 array of the given shape.
pub fn set_array(dict: &Bound<'_, PyDict>, name: &str, values: Vec<f64>, shape: &[usize]) -> PyResult<()> {
    dict.set_item(name, values.into_pyarray(dict.py()).reshape(shape.to_vec())?)
}
