//! Obstacles: what users write, and the geometry that follows, seen from above and of bodies of finite height.

mod config;
mod grid;
mod outline;
mod polygon;
mod ray;
mod rectangle;
mod solid;
mod solid_circle;
mod solid_polygon;
mod wall_grid;

pub use config::{Obstacle, Peg, SavedObstacle, Shape};
pub use grid::ObstacleGrid;
pub use polygon::{CentreLine, ConvexPolygon, Separation};
pub use rectangle::Rectangle;
pub use solid::{Outline, Solid, SolidContact, SolidLine};
pub use wall_grid::{Wall, WallGrid};
