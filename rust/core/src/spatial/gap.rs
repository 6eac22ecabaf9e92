//! Gaps between a link's whole surface and an obstacle; pegs are vertical cylinders without end (T 4.2.3).

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{CentreLine, ConvexPolygon, ObstacleGrid, Peg, SolidLine};
use crate::robot::Link;

use super::{LinkAxis, Pose};

/// g_H of one link-peg pair, negative when penetrating (T 4.12), (T 4.13) \[m\].
pub fn peg_gap(link: &Link, pose: &Pose, peg: &Peg) -> f64 {
    nearest_point(link, &pose.position, &pose.axis(), peg).0.norm() - (peg.radius + link.radius)
}

/// Horizontal vector from the peg's axis to the nearest point of the centre line of a link at `position` along `axis`,
/// and that point's coordinate from the CG \[m\].
pub fn nearest_point(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>, peg: &Peg) -> (Vector2<f64>, f64) {
    let shadow = axis.xy();
    let from_peg = position.xy() - Vector2::new(peg.x, peg.y);
    let length = shadow.norm_squared();
    // Along an upright link all points are equally near: take the middle one.
    let along = if length > UPRIGHT { -from_peg.dot(&shadow) / length } else { link.cg_offset };
    let [front, rear] = link.sides();
    let along = along.clamp(front, rear);
    (from_peg + shadow * along, along)
}

/// Gap between a link at `at` and an obstacle of the scene \[m\]; infinite where a body that is not vertical is out of
/// touch.
pub fn obstacle_gap(link: &Link, at: &LinkAxis, obstacles: &ObstacleGrid, obstacle: usize) -> f64 {
    let LinkAxis { position, axis } = at;
    if let Some(body) = obstacles.body(obstacle) {
        return body.distance(&solid_line(link, at), link.radius) - link.radius;
    }
    if let Some(solid) = obstacles.solid(obstacle) {
        return solid.distance(&solid_line(link, at)) - link.radius;
    }
    match obstacles.pegs().get(obstacle) {
        Some(peg) => nearest_point(link, position, axis, peg).0.norm() - (peg.radius + link.radius),
        None => wall_gap(link, position, axis, obstacles.polygon(obstacle)),
    }
}

/// Gap between a link and a vertical wall without end \[m\].
pub fn wall_gap(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>, wall: &ConvexPolygon) -> f64 {
    wall.distance(&centre_line(link, position, axis)) - link.radius
}

/// The centre line of a link seen from above: the distance to a vertical prism is the one to be seen there.
pub fn centre_line(link: &Link, position: &Vector3<f64>, axis: &Vector3<f64>) -> CentreLine {
    let shadow = axis.xy();
    CentreLine { middle: position.xy() + shadow * link.cg_offset, half: shadow * link.contact_half_length }
}

/// The centre line of a link in front of an obstacle of finite height.
pub fn solid_line(link: &Link, at: &LinkAxis) -> SolidLine {
    SolidLine { middle: at.position + at.axis * link.cg_offset, half: at.axis * link.contact_half_length }
}

/// Squared length of e_z^B's shadow below which round-off would place the nearest point.
const UPRIGHT: f64 = 1e-18;
