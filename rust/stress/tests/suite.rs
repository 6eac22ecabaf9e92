//! All tests of this crate in one program, so that the long one runs beside the others.

mod geometry;
mod scenes;
mod short;
