//! What A. A. Transeth, *Modelling and Control of Snake Robots* (NTNU 2007), prints and [`snake_core`] does differently:
//! the minimal model of chapter 6, and the time stepping of chapters 3 and 4. Equations are tagged `(T 3.66)` with the
//! thesis's numbers. SI units and radians everywhere.

mod config;
pub mod minimal;
pub mod planar;
mod scheme;
pub mod spatial;

pub use config::{IntegratorConfig, ThesisConfig};
