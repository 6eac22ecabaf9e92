//! Contact of a link's whole surface with an obstacle; pegs are vertical cylinders without end (T 4.2.3), (T 4.3.2).

use nalgebra::{Vector2, Vector3, Vector6};

use crate::obstacles::{CentreLine, ConvexPolygon, Peg, SolidLine};
use crate::pegs::PegGrid;
use crate::robot::Link;

use super::{Frame, Pose, force_direction};

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

/// g_H of one pair \[m\].
pub fn peg_gap(link: &Link, pose: &Pose, peg: &Peg) -> f64 {
    nearest_point(link, &pose.position, &pose.axis(), peg).0.norm() - (peg.radius + link.radius)
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

/// Horizontal vector from the peg's axis to the nearest point of the centre line of a link at `position` along `axis`,
/// and that point's coordinate \[m\].
pub fn nearest_point(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>, peg: &Peg) -> (Vector2<f64>, f64) {
    let shadow = axis.xy();
    let from_peg = position.xy() - Vector2::new(peg.x, peg.y);
    let length = shadow.norm_squared();
    // Along an upright link all points are equally near: take the middle one.
    let along = if length > UPRIGHT { -from_peg.dot(&shadow) / length } else { 0.0 };
    let along = along.clamp(-link.contact_half_length, link.contact_half_length);
    (from_peg + shadow * along, along)
}

/// Gap between a link at `frame` and an obstacle of the scene, a vertical body with or without end \[m\].
pub fn obstacle_gap(link: &Link, frame: &Frame, obstacles: &PegGrid, obstacle: usize) -> f64 {
    let (position, axis) = (&frame.position, &frame.axes[2]);
    if let Some(solid) = obstacles.solid(obstacle) {
        return solid.distance(&solid_line(link, frame)) - link.radius;
    }
    match obstacles.pegs().get(obstacle) {
        Some(peg) => nearest_point(link, position, axis, peg).0.norm() - (peg.radius + link.radius),
        None => {
            let wall = &obstacles.walls().walls()[obstacle - obstacles.pegs().len()];
            wall_gap(link, position, axis, &wall.polygon)
        }
    }
}

/// Gap between a link and a vertical wall without end \[m\].
pub fn wall_gap(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>, wall: &ConvexPolygon) -> f64 {
    wall.distance(&centre_line(link, position, axis)) - link.radius
}

/// The centre line of a link seen from above: the distance to a vertical prism is the one to be seen there.
pub fn centre_line(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>) -> CentreLine {
    CentreLine { middle: position.xy(), half: axis.xy() * link.contact_half_length }
}

/// The centre line of a link in front of an obstacle of finite height.
pub fn solid_line(link: &Link, frame: &Frame) -> SolidLine {
    SolidLine { middle: frame.position, half: frame.axes[2] * link.contact_half_length }
}

/// A horizontal direction perpendicular to the centre line.
fn across(pose: &Pose) -> Vector2<f64> {
    let shadow = pose.axis().xy();
    Vector2::new(-shadow.y, shadow.x).try_normalize(0.0).unwrap_or_else(Vector2::x)
}

/// Squared length of e_z^B's shadow below which round-off would place the nearest point.
const UPRIGHT: f64 = 1e-18;
