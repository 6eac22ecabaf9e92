//! Physics of wheel-less snake robots with set-valued Coulomb friction and obstacle contact.
//!
//! The models are chapters 3 (planar), 4 (spatial) and 6 (minimal, its "robot model") of A. A. Transeth, *Modelling and
//! Control of Snake Robots* (NTNU 2007); equations are tagged `(T 3.66)` with the thesis's numbers. SI units and
//! radians everywhere.
//!
//! Modules import each other in one direction only:
//! `math <- laws <- contact <- {planar, spatial, minimal} <- stepper <- simulations <- environment <- batch`; the simulations
//! are `simulation`, `spatial_simulation` and `minimal_simulation`.

pub mod batch;
pub mod contact;
pub mod control;
pub mod environment;
pub mod error;
pub mod gait;
pub mod laws;
pub mod math;
pub mod minimal;
pub mod minimal_simulation;
pub mod pegs;
pub mod planar;
pub mod robot;
pub mod scene;
pub mod simulation;
pub mod spatial;
pub mod spatial_simulation;
pub mod stepper;

pub use error::ConfigError;
