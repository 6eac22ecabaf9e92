//! The one way into the core: without the GIL, panics caught, errors mapped variant by variant.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::PyRuntimeError;
use pyo3::import_exception;
use pyo3::prelude::*;
use snake_core::ConfigError;

mod python {
    use super::import_exception;
    import_exception!(snake_env.errors, ConfigError);
    import_exception!(snake_env.errors, DivergenceError);
}

/// Why a call did not succeed.
pub enum Fault {
    /// Bad input: `snake_env.ConfigError`.
    Config(ConfigError),
    /// A scripted run left the finite numbers at this time \[s\]: `snake_env.DivergenceError`.
    Diverged(f64),
    /// A Python exception on its way, such as KeyboardInterrupt.
    Python(PyErr),
}

impl From<ConfigError> for Fault {
    fn from(error: ConfigError) -> Self {
        Fault::Config(error)
    }
}

impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Self {
        Fault::Python(error)
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Config(e) => python::ConfigError::new_err((e.field, e.value, e.expected)),
            Fault::Diverged(time) => python::DivergenceError::new_err((time,)),
            Fault::Python(error) => error,
        }
    }
}

/// Does `work` with the GIL released; a panic inside becomes a RuntimeError.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, Fault> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(outcome) => outcome.map_err(PyErr::from),
        Err(panic) => Err(PyRuntimeError::new_err(format!("internal error of the core: {}", text_of(&*panic)))),
    }
}

fn text_of(panic: &(dyn Any + Send)) -> &str {
    let literal = panic.downcast_ref::<&str>().copied();
    literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic")
}
