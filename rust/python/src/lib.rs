//! Python bindings of `snake_core` and `snake_thesis`: thin; one module releases the GIL, catches panics and maps errors.
//!
//! # Threads
//!
//! The module declares `gil_used = false`: a free-threaded interpreter keeps its lock off. What threads could share:
//!
//! * [`batch::Batch`], the only class, is `Send + Sync`, which PyO3 has the compiler prove. Whatever changes it takes
//!   `&mut self`, which PyO3 lends to one call at a time, by an atomic flag; a call beside it is a `RuntimeError`.
//! * Arrays are lent by rust-numpy, whose table of borrows is behind a mutex; a second borrow that does not fit is an error.
//!   The table knows nothing of writes by Python itself: who writes to an array during a call that reads it races, as with
//!   NumPy's own functions.
//! * `Scenes` looks scenes up by address. The caller holds those that it passes, and the dead are forgotten first, so that
//!   no two that are looked up have had the same address. It belongs to a batch.
//! * Thread locals of [`ffi`] are of one call. Python hears signals on its main thread alone.
//! * Statics, here and in the core, are constants and `OnceLock`s; `Interrupt` is atomic; `unsafe` code of the core is
//!   arithmetic on registers.
//! * Mappings and sequences are read by PyO3's checked access: one that another thread changes gives an error or a mixture
//!   of values, which is validated as any other.
//!
//! In Python `_buffers` reuses arrays by reference counts only where there is a GIL.

mod batch;
mod config;
mod core;
mod courses;
mod exceptions;
mod ffi;
mod from_python;
mod gait;
mod joint_trajectory;
mod layout;
mod memory;
mod minimal;
mod numbers;
mod parameters;
mod planar;
mod plants;
mod records;
mod run;
mod samples;
mod scenes;
mod scripted;
mod spatial;
mod start;
mod step_buffers;
mod world;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
mod _native {
    use pyo3::prelude::*;
    use snake_core::stepping::{forced_lanes, widest_lanes};

    use super::exceptions::add_members;
    use super::ffi::CoreError;

    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::config::{capabilities, check, defaults};
    #[pymodule_export]
    use super::courses::courses;
    #[pymodule_export]
    use super::exceptions::{ConfigError, DivergenceError, InternalError};
    #[pymodule_export]
    use super::gait::gait_reference;
    #[pymodule_export]
    use super::joint_trajectory::sampled_reference;
    #[pymodule_export]
    use super::layout::{layout, scenarios};
    #[pymodule_export]
    use super::plants::{control_plant, process_plant};
    #[pymodule_export]
    use super::run::simulate;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// Robots that are stepped side by side in a large batch: as SNAKE_ENV_LANES prescribes, or as many as the widest
    /// registers of the processor hold.
    #[pyfunction]
    fn lanes() -> PyResult<usize> {
        forced_lanes().map_err(CoreError::from)?;
        Ok(widest_lanes(usize::MAX))
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        add_members(module.py())
    }
}
