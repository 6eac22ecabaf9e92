//! The default scheme of the spatial model: implicit stages with exactly eliminated joints.
//!
//! A stage with base q_B, reference momenta p_R and coefficient c solves `M x - p_R = impulses over c`,
//! `q = q_B + c u` (see [`crate::spatial::Stage`]).
//!
//! * Order 1, implicit Euler: one stage (q_A, p_A, h).
//! * Order 2, the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself: stage (q_A, p_A, gamma h)
//!   gives u_1, p_1; stage (q_A + (1 - gamma) h u_1, p_A + (1 - gamma)/gamma (p_1 - p_A), gamma h) gives u_E. The
//!   second reference extrapolates the impulses of the first stage, which is wrong where they change abruptly; such a
//!   step is left undone, halved, and at last taken as Euler steps, as in the planar model.
//!
//! Within [`SpatialFleet::advance`] a robot is a pose of link 1 and joint angles, so that no joint can open. Robots are
//! solved side by side in the lanes of a register; a robot alone is a fleet of one.

mod fleet;
mod group;
mod kernels;
mod motion;
mod pegs;
mod rescue;
mod slots;
mod stage_work;
mod standing;
mod warm_start;
mod way;
mod works;

pub use fleet::SpatialFleet;
pub use motion::Motion;
pub use warm_start::SpatialWarmStart;
