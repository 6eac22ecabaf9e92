//! Numbers: one robot, or several side by side in the lanes of a vector register.

mod real;
mod trig;
mod vector;
#[cfg(target_arch = "x86_64")]
mod wide;

pub use real::{Kernel, MAX_LANES, Mask, Real};
pub(crate) use vector::{add_scaled, dot, select_into};
#[cfg(target_arch = "x86_64")]
pub(crate) use wide::{Wide4, Wide8};
