//! Python bindings of `snake_core`: thin, with one gate for the GIL, panics and errors.

mod batch;
mod config;
mod core;
mod courses;
mod gait;
mod gate;
mod layout;
mod minimal;
mod numbers;
mod run;
mod sheet;
mod snapshot;
mod spatial;

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
    use super::layout::layout;
    #[pymodule_export]
    use super::minimal::{control_plant, gait_reference, process_plant, simulate_minimal};
    #[pymodule_export]
    use super::run::simulate;
    #[pymodule_export]
    use super::spatial::simulate_spatial;

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
