//! Contact of a link's whole surface with a peg (T 4.3.2).

use nalgebra::{Vector2, Vector3, Vector6};
use snake_core::obstacles::Peg;
use snake_core::robot::Link;
use snake_core::spatial::{Pose, nearest_point};

use super::force_direction;

/// Gap and force direction of one link-peg pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PegContact {
    /// g_H, negative when penetrating \[m\] (T 4.12), (T 4.13).
    pub gap: f64,
    /// w_H with g_H' = w_H^T u_i (T 4.53), (T 4.57).
    pub direction: Vector6<f64>,
    /// Unit vector from the peg to the link: horizontal, frame I.
    pub normal: Vector3<f64>,
    /// Coordinate along e_z^B of the nearest point of the link's centre line \[m\].
    pub along: f64,
}

/// Gap and force direction.
///
/// The link is the set of points within `radius` of the centre line between its end spheres' centres, so the distance
/// to the peg is that between this segment and the peg's axis. Seen from above the segment has the direction `a`, the
/// shadow of e_z^B, and its nearest point lies at `s = clamp(-(r_G - r_H) . a / a . a, -L_GS, L_GS)`. Inside the clamp
/// this is the cylinder case: (r_G - r_H) + s a is then the d_ij n_ij of (T 4.10)-(T 4.12), (T 4.53); on it one of the
/// end spheres (T 4.13)-(T 4.15), (T 4.57). Moving s changes the distance to second order only, so in both cases
/// g' = n . (v_G + omega x s e_z^B).
pub fn peg_contact(link: &Link, pose: &Pose, peg: &Peg) -> PegContact {
    let rotation = pose.rotation();
    let (offset, along) = nearest_point(link, &pose.position, &pose.axis(), peg);
    let distance = offset.norm();
    // A peg centred exactly on the link's centre line leaves the side open.
    let normal = offset.try_normalize(0.0).unwrap_or_else(|| across(pose));
    let normal = normal.push(0.0);
    PegContact {
        gap: distance - (peg.radius + link.radius),
        direction: force_direction(&rotation, &normal, &(rotation.column(2) * along)),
        normal,
        along,
    }
}

/// A horizontal direction perpendicular to the centre line.
fn across(pose: &Pose) -> Vector2<f64> {
    let shadow = pose.axis().xy();
    Vector2::new(-shadow.y, shadow.x).try_normalize(0.0).unwrap_or_else(Vector2::x)
}
