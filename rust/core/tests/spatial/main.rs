//! Laws, accuracy and solver of the spatial model.

mod accuracy;
mod allocation;
mod flight;
mod ground_geometry;
mod implicit_laws;
mod joints;
mod lanes;
mod laws;
mod peg_geometry;
mod reference;
mod stage;
mod step;
