//! Calls into the core: without the GIL, panics caught, errors mapped variant by variant.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use snake_core::ConfigError;

use crate::exceptions;

/// Why a call into the core did not succeed.
pub enum CoreError {
    /// Bad input: `snake_env.ConfigError`.
    Config(ConfigError),
    /// A scripted run left the finite numbers at this time \[s\]: `snake_env.DivergenceError`.
    Diverged(f64),
    /// A signal handler of Python has raised, see [`interruptible`].
    Interrupted,
}

impl From<ConfigError> for CoreError {
    fn from(error: ConfigError) -> Self {
        CoreError::Config(error)
    }
}

impl From<CoreError> for PyErr {
    fn from(error: CoreError) -> Self {
        match error {
            CoreError::Config(e) => exceptions::ConfigError::new_err((e.field, e.value, e.expected)),
            CoreError::Diverged(time) => exceptions::DivergenceError::new_err((time,)),
            CoreError::Interrupted => exceptions::InternalError::new_err("interrupted by no signal"),
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

/// As [`detached`], but a signal handler of Python that raises ends the work where that asks [`signal_raised`].
pub fn interruptible<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, CoreError> + Send) -> PyResult<T> {
    LAST_LOOK.set(Some(Instant::now()));
    let outcome = detached(py, work);
    LAST_LOOK.set(None);
    RAISED.take().map_or(outcome, Err)
}

/// Lets Python's signal handlers run, about every 50 ms and on the thread of an [`interruptible`] call; whether one has
/// raised.
pub fn signal_raised() -> bool {
    if LAST_LOOK.get().is_some_and(|last| last.elapsed() > LONGEST_DEAFNESS) {
        LAST_LOOK.set(Some(Instant::now()));
        if let Err(error) = Python::attach(|py| py.check_signals()) {
            RAISED.set(Some(error));
        }
    }
    RAISED.with_borrow(Option::is_some)
}

const LONGEST_DEAFNESS: Duration = Duration::from_millis(50);

thread_local! {
    /// When signals were last heard, in an interruptible call.
    static LAST_LOOK: Cell<Option<Instant>> = const { Cell::new(None) };
    /// What a signal handler has raised.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

fn text_of(panic: &(dyn Any + Send)) -> &str {
    let literal = panic.downcast_ref::<&str>().copied();
    literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic")
}
