//! Rows of contact: the one form in which contacts enter a stage, in the plane and in 3D.
//!
//! A row has a gap that opens at the rate `w . u` of one or two links and an impulse that acts along w. Whoever finds
//! contacts makes rows; solver, certificate and energy know rows and nothing of what they are contacts with. A drive and a
//! motor are rows of a joint axis.

mod drive;
mod in_lane;
mod motor;
mod row;
mod saved;
mod screw;

pub use drive::DriveRow;
pub use in_lane::{InLane, read_friction, read_rows, write_rows};
pub use motor::MotorRow;
pub use row::{ContactRow, FrictionRow, PairRow, Row};
pub(crate) use row::{demanded_speed, relax};
pub use saved::{Saved, SavedStage, is_zero, limit};
pub use screw::Screw;
