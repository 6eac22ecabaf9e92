//! Verification: how far forces and velocities are from obeying a law, and from balance.
//!
//! The certificates of the models are built from these functions and the data of a stage. The arithmetic is written
//! independently of [`crate::laws`] and of the solvers, whose parts are private to the `solver` folders of the models,
//! so that an error there cannot hide itself. Violations of laws are impulses, which [`Mobility`] turns into velocities.
//! A NaN among velocities or impulses reaches the residual through the balance of momentum; single laws need not pass it
//! on.

mod balance;
mod clamp;
mod disc;
mod half_line;
mod limit_surface;
mod mobility;
mod motor;
mod rows;

pub use balance::{BalancedLink, ChainBalance};
pub use clamp::clamp;
pub(crate) use disc::disc;
pub use disc::{FrictionViolation, ellipse, ground};
pub(crate) use half_line::half_line;
pub use limit_surface::limit_surface;
pub use mobility::Mobility;
pub(crate) use motor::{drive, motor_impulse, turning};
pub(crate) use rows::rows;

use crate::math::Real;

/// The larger of two violations, NaN if either is: no broken solution passes.
#[inline(always)]
pub fn worse<T: Real>(a: T, b: T) -> T {
    T::select(b.le(a), a, T::select(a.lt(b), b, a + b))
}

#[inline(always)]
pub(crate) fn norm<T: Real>(x: T, y: T) -> T {
    (x * x + y * y).sqrt()
}
