//! All tests of this crate in one program, so that long ones run beside each other.

mod geometry;
mod scenes;
mod short;
