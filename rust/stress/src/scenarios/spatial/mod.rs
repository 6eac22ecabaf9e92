//! Scenarios of the spatial model.

pub mod fall;
pub mod gaits;
pub mod neighbours;
pub mod rest;
