//! Solver of a stage of the minimal model. Its parts are private to this folder: the certificate, a sibling, cannot
//! name them.
//!
//! ```compile_fail,E0603
//! use snake_thesis::minimal::solver::chain::ChainFactor;
//! ```

mod chain;
mod newton;
mod ray;

pub(super) use chain::{ChainFactor, Curvature};
pub use newton::Newton;
