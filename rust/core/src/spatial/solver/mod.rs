//! Solvers of a spatial stage. Their parts are private to this folder: the certificate, a sibling, cannot name them.
//!
//! ```compile_fail,E0603
//! use snake_core::spatial::solver::sweep::Affine;
//! ```

mod anderson;
mod coulomb_friction;
mod coulomb_laws;
mod coulomb_newton;
mod coulomb_sweep;
mod fallback;
mod friction_term;
mod lagged;
mod link_term;
mod newton;
mod obstacle_friction;
mod progress;
mod ray;
mod ray_laws;
mod self_contacts;
mod sweep;
mod terms;
mod transfer;

pub use coulomb_newton::CoulombNewton;
pub use fallback::Fallback;
pub use newton::Newton;
