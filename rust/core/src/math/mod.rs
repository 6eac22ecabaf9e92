//! Numbers: one robot, or several side by side in the lanes of vector registers.

#[cfg(target_arch = "x86_64")]
mod avx;
mod laned;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "aarch64")]
mod pair;
mod real;
mod trig;
mod vector;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod wide;

#[cfg(target_arch = "x86_64")]
pub(crate) use avx::{Wide4, Wide8};
pub(crate) use laned::laned;
pub use laned::{Laned, read_lane, replace_by_lane, write_lane};
#[cfg(target_arch = "aarch64")]
pub(crate) use neon::Wide4;
#[cfg(target_arch = "aarch64")]
pub(crate) use pair::Pair;
pub use real::{Kernel, MAX_LANES, Mask, Real};
pub(crate) use vector::{add_scaled, dot, keep, select_into};
