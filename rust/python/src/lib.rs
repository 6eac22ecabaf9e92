//! Python bindings of `snake_core`: thin, with one gate for the GIL, panics and errors.

mod batch;
mod config;
mod core;
mod courses;
mod decode;
mod gait;
mod gate;
mod ground;
mod layout;
mod minimal;
mod numbers;
mod planar;
mod plants;
mod run;
mod samples;
mod sheet;
mod snapshot;
mod spatial;
mod start;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::config::{check, defaults};
    #[pymodule_export]
    use super::courses::courses;
    #[pymodule_export]
    use super::gait::gait_reference;
    #[pymodule_export]
    use super::layout::{layout, scenarios};
    #[pymodule_export]
    use super::minimal::simulate_minimal;
    #[pymodule_export]
    use super::planar::simulate;
    #[pymodule_export]
    use super::plants::{control_plant, process_plant};
    #[pymodule_export]
    use super::spatial::simulate_spatial;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
