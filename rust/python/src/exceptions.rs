//! The exceptions of the package.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::{create_exception, ffi::c_str};

create_exception!(
    snake_env,
    ConfigError,
    PyValueError,
    "Bad input, rejected: names the field, the offending value and what is admissible.

Attributes:
    field: path of the field as the user writes it, e.g. ``robot.mass``.
    value: the offending value, as given or as text.
    expected: what is admissible, in words."
);

create_exception!(
    snake_env,
    DivergenceError,
    PyRuntimeError,
    "A scripted run left the finite numbers.

Attributes:
    time: simulated time of the last good state [s]."
);

create_exception!(
    snake_env,
    InternalError,
    PyRuntimeError,
    "A defect of the simulator: the core panicked. The object that was called must not be used any more."
);

/// Gives the exceptions, whose arguments are kept in `args`, their attributes, and the second one its text; that of the
/// first is in `snake_env/errors.py`.
pub fn add_members(py: Python<'_>) -> PyResult<()> {
    let config = py.get_type::<ConfigError>();
    config.setattr("field", py.eval(c_str!("property(lambda self: self.args[0])"), None, None)?)?;
    config.setattr("value", py.eval(c_str!("property(lambda self: self.args[1])"), None, None)?)?;
    config.setattr("expected", py.eval(c_str!("property(lambda self: self.args[2])"), None, None)?)?;
    let divergence = py.get_type::<DivergenceError>();
    divergence.setattr("time", py.eval(c_str!("property(lambda self: self.args[0])"), None, None)?)?;
    let text = c_str!(
        "lambda self: f'the simulation diverged at t = {self.args[0]:g} s: take a smaller step, or the implicit method'"
    );
    divergence.setattr("__str__", py.eval(text, None, None)?)
}
