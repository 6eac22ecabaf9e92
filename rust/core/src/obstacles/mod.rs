//! Obstacles: what users write, and the geometry that follows, seen from above and of bodies of finite height.

mod body;
mod config;
mod cylinder;
mod fields;
mod grid;
mod height_field;
mod movable;
mod outline;
mod patches;
mod plate;
mod polygon;
mod polyhedron;
mod ray;
mod rectangle;
mod solid;
mod solid_circle;
mod solid_polygon;
mod surface;
mod wall_grid;

pub use body::Body;
pub use config::{Heights, Obstacle, Peg, ROLLING_FRICTION, SavedObstacle, Shape};
pub use cylinder::Cylinder;
pub use grid::ObstacleGrid;
pub use height_field::{GroundFriction, HeightField};
pub use movable::{Ball, Movable, Moved, Node, Nodes, OutOfPlane, PlacedMovable, Spring};
pub use patches::{Patch, Patches};
pub use polygon::{CentreLine, ConvexPolygon, NearestPoint, Separation};
pub use polyhedron::Polyhedron;
pub use rectangle::Rectangle;
pub use solid::{Outline, Solid, SolidContact, SolidLine};
pub use wall_grid::{Wall, WallGrid};
