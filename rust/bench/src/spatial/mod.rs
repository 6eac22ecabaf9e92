//! Robots in space: error against run time, alone and in lanes.

mod precision;
mod reference;
mod robots;
mod scenes;

pub use precision::measure;
