//! Physics of wheel-less snake robots with set-valued Coulomb friction and obstacle contact.
//!
//! The models are chapters 3 (planar) and 4 (spatial) of A. A. Transeth, *Modelling and Control of Snake Robots* (NTNU
//! 2007); equations are tagged `(T 3.66)` with the thesis's numbers. Chapter 6 and the schemes as printed are in the crate
//! `snake-thesis`. SI units and radians everywhere.
//!
//! Modules import each other in one direction only:
//! `math <- rows <- {laws, judge} <- contact <- solver <- stepping <- {planar, spatial} <- simulation <- environment <- batch`.

pub mod batch;
pub mod capabilities;
pub mod contact;
pub mod control;
pub mod environment;
pub mod error;
pub mod gait;
pub mod interrupt;
pub mod judge;
pub mod laws;
pub mod math;
pub mod noise;
pub mod obstacles;
pub mod planar;
pub mod robot;
pub mod rows;
pub mod scene;
pub mod simulation;
pub mod slope;
pub mod solver;
pub mod spatial;
pub mod stepping;

pub use error::ConfigError;
