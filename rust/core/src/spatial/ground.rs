//! The gap between a link's two end spheres and the ground (T 4.2.2).

use crate::robot::Link;

use super::Pose;

/// Which of the two end spheres of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Front,
    Rear,
}

impl End {
    pub const BOTH: [End; 2] = [End::Front, End::Rear];

    /// Coordinate of the sphere's centre along e_z^B, +-L_GS from the middle of the link \[m\].
    pub fn along(self, link: &Link) -> f64 {
        match self {
            End::Front => link.sides()[1],
            End::Rear => link.sides()[0],
        }
    }
}

/// g_N of one end sphere (T 4.8) \[m\].
pub fn ground_gap(link: &Link, pose: &Pose, end: End) -> f64 {
    pose.position.z + end.along(link) * pose.axis().z - link.radius
}
