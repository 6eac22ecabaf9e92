//! Python bindings of `snake_core` and `snake_thesis`: thin; one module releases the GIL, catches panics and maps errors.

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
mod spatial;
mod start;
mod step_buffers;
mod world;

use pyo3::prelude::*;

#[pymodule]
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
        Ok(widest_lanes())
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        add_members(module.py())
    }
}
