//! Obstacles, seen from above: what users write, and the geometry that follows.

mod config;
mod polygon;
mod wall_grid;

pub use config::{Obstacle, Peg, SavedObstacle, Shape};
pub use polygon::{CentreLine, ConvexPolygon, Separation};
pub use wall_grid::{Wall, WallGrid};
