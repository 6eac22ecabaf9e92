//! Solvers of a planar stage. Their parts are private to this folder: the certificate, a sibling, cannot name them.
//!
//! ```compile_fail,E0603
//! use snake_core::planar::solver::sweep::Quadratic;
//! ```

mod contact_friction;
mod coulomb_fallback;
mod coulomb_laws;
mod coulomb_newton;
mod coulomb_path;
mod coulomb_sweep;
mod fallback;
mod interior_point;
mod kernels;
mod link_term;
mod low_rank;
mod newton;
mod ray;
mod self_contacts;
mod sweep;
mod terms;
mod transfer;
mod unilateral;
mod unsolved;

pub use fallback::Fallback;
pub use interior_point::{Descent, InteriorPoint};
pub use newton::Newton;
