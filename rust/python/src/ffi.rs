//! Calls into the core: without the GIL, panics caught, errors mapped variant by variant.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::prelude::*;
use snake_core::ConfigError;

use crate::exceptions;

/// Why a call into the core did not succeed.
pub enum CoreError {
    /// Bad input: `snake_env.ConfigError`.
    Config(ConfigError),
    /// A scripted run left the finite numbers at this time \[s\]: `snake_env.DivergenceError`.
    Diverged(f64),
    /// A Python exception on its way, such as KeyboardInterrupt.
    Python(PyErr),
}

impl From<ConfigError> for CoreError {
    fn from(error: ConfigError) -> Self {
        CoreError::Config(error)
    }
}

impl From<PyErr> for CoreError {
    fn from(error: PyErr) -> Self {
        CoreError::Python(error)
    }
}

impl From<CoreError> for PyErr {
    fn from(error: CoreError) -> Self {
        match error {
            CoreError::Config(e) => exceptions::ConfigError::new_err((e.field, e.value, e.expected)),
            CoreError::Diverged(time) => exceptions::DivergenceError::new_err((time,)),
            CoreError::Python(error) => error,
        }
    }
}

/// Does `work` with the GIL released; a panic inside becomes a `snake_env.InternalError`.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, CoreError> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(outcome) => outcome.map_err(PyErr::from),
        Err(panic) => Err(exceptions::InternalError::new_err(format!("the core panicked: {}", text_of(&*panic)))),
    }
}

fn text_of(panic: &(dyn Any + Send)) -> &str {
    let literal = panic.downcast_ref::<&str>().copied();
    literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic")
}
