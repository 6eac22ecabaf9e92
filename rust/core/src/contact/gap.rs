//! Distance between a stadium-shaped link and an obstacle, with a moving contact point.

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{CentreLine, ConvexPolygon, Movable, Node, ObstacleGrid, Peg};
use crate::robot::Link;

use super::link_pair::PlacedLink;
use super::outline::{features_of_outline, outline_obstacle_contact};

/// Gap and force direction of one link-obstacle pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkContact {
    /// g_H, negative when penetrating \[m\] (T 3.9), (T 3.10).
    pub gap: f64,
    /// w_H with g_H' = w_H^T u_i for the link's twist u_i (T 3.16), (T 3.18).
    pub direction: Vector3<f64>,
    /// Moment about the CG of a unit impulse along the obstacle's surface, to the left of the normal, that acts on the
    /// surface of the link \[m\].
    pub lever: f64,
    /// Whether another contact of the pair covers this one.
    pub is_redundant: bool,
}

impl LinkContact {
    /// Generalised direction of a unit impulse along the obstacle's surface, to the left of the normal.
    pub fn tangent(&self) -> Vector3<f64> {
        Vector3::new(-self.direction.y, self.direction.x, self.lever)
    }
}

/// Moment of a unit impulse across the normal, to its left, on the surface of a link: `radius` from a point of its centre
/// line \[m\].
pub(super) fn lever(along: f64, normal: &Vector2<f64>, axis: &Vector2<f64>, radius: f64) -> f64 {
    along * normal.dot(axis) - radius
}

/// Gap g_H between `link` at `pose` = (x, y, theta) and `peg` \[m\].
pub fn gap(pose: &Vector3<f64>, link: &Link, peg: &Peg) -> f64 {
    let (sin, cos) = pose.z.sin_cos();
    link_peg_gap(pose, cos, sin, link, peg)
}

fn link_peg_gap(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link, peg: &Peg) -> f64 {
    separation(pose, cos, sin, link, peg).0.norm() - (peg.radius + link.radius)
}

/// Gap of a link and an obstacle at one of the features that describe the pair \[m\]; infinite where another one covers
/// it. Arguments as of [`link_obstacle_contact`].
#[inline]
pub fn link_obstacle_gap(
    pose: &Vector3<f64>,
    cos: f64,
    sin: f64,
    link: Node,
    obstacles: &ObstacleGrid,
    at: (usize, usize),
) -> f64 {
    if let Some(peg) = obstacles.pegs().get(at.0).filter(|_| link.outline.is_none()) {
        return link_peg_gap(pose, cos, sin, &link, peg);
    }
    let contact = link_obstacle_contact(pose, cos, sin, link, obstacles, at);
    if contact.is_redundant { f64::INFINITY } else { contact.gap }
}

/// Gap and force direction; `cos` and `sin` are those of the link's angle.
///
/// The nearest point of the link's centre line to the peg's centre lies at
/// `s = clamp((r_H - r_G) . e_x^B, -L_GS, L_GS)`, about the middle of the link. Inside the clamp this is the rectangle case
/// (T 3.8)-(T 3.9), (T 3.16 != D1); on it one of the end caps (T 3.10)-(T 3.12), (T 3.18 != D1). In both, the
/// normal `n` points from the peg to the link, and since moving `s` along the link changes the
/// distance only to second order, g' = n . (v_G + omega s e_y^B).
#[inline]
pub fn link_peg_contact(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link, peg: &Peg) -> LinkContact {
    let (offset, s) = separation(pose, cos, sin, link, peg);
    let distance = offset.norm();
    let lateral = Vector2::new(-sin, cos);
    // A peg centred exactly on the link's centre line leaves the side open: take e_y^B.
    let normal = if distance > 0.0 { offset * (1.0 / distance) } else { lateral };
    LinkContact {
        gap: distance - (peg.radius + link.radius),
        direction: Vector3::new(normal.x, normal.y, s * normal.dot(&lateral)),
        lever: lever(s, &normal, &Vector2::new(cos, sin), link.radius),
        is_redundant: false,
    }
}

/// The contact of a link with one of the features that describe a polygon, see [`ConvexPolygon::separation`].
fn link_wall_contact(
    pose: &Vector3<f64>,
    cos: f64,
    sin: f64,
    link: &Link,
    wall: &ConvexPolygon,
    feature: usize,
) -> LinkContact {
    let at = wall.separation(&centre_line(pose, cos, sin, link), feature);
    let along = at.along * link.contact_half_length + link.cg_offset;
    let lateral = Vector2::new(-sin, cos);
    LinkContact {
        gap: at.distance - link.radius,
        direction: Vector3::new(at.normal.x, at.normal.y, along * at.normal.dot(&lateral)),
        lever: lever(along, &at.normal, &Vector2::new(cos, sin), link.radius),
        is_redundant: at.is_redundant,
    }
}

/// The contact of a disc with its stop: its centre lies within a circle around its start.
fn stop_contact(pose: &Vector3<f64>, movable: &Movable) -> LinkContact {
    let deflection = movable.deflection(&pose.xy());
    let inward = -deflection.try_normalize(0.0).unwrap_or(Vector2::x());
    LinkContact {
        gap: movable.travel() - deflection.norm(),
        direction: Vector3::new(inward.x, inward.y, 0.0),
        lever: -movable.link.radius,
        is_redundant: false,
    }
}

/// Gap between a link, or something that can be pushed, and the fixed obstacles in its reach \[m\]; infinite where there are
/// none.
pub fn obstacle_gap<'a>(pose: &Vector3<f64>, node: impl Into<Node<'a>>, obstacles: &ObstacleGrid) -> f64 {
    let (node, (sin, cos)) = (node.into(), pose.z.sin_cos());
    let walls = obstacles.walls().near(pose.xy(), node.reach()).map(|wall| obstacles.pegs().len() + wall);
    let near = obstacles.near(pose.x, pose.y, node.reach()).chain(walls);
    let features = near.flat_map(|obstacle| (0..features(&node, obstacles, obstacle)).map(move |k| (obstacle, k)));
    features.map(|at| link_obstacle_gap(pose, cos, sin, node, obstacles, at)).fold(f64::INFINITY, f64::min)
}

/// Gap between `link` and the walls in its reach \[m\]; infinite where there are none.
pub fn wall_gap(pose: &Vector3<f64>, link: &Link, obstacles: &ObstacleGrid) -> f64 {
    let (sin, cos) = pose.z.sin_cos();
    let line = centre_line(pose, cos, sin, link);
    let gap = |wall: usize| obstacles.walls().walls()[wall].polygon.distance(&line) - link.radius;
    obstacles.walls().near(pose.xy(), link.reach()).map(gap).fold(f64::INFINITY, f64::min)
}

fn centre_line(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link) -> CentreLine {
    let axis = Vector2::new(cos, sin);
    CentreLine { middle: pose.xy() + axis * link.cg_offset, half: axis * link.contact_half_length }
}

/// Number of features that describe a link, or something that can be pushed, and an obstacle or its stop.
pub fn features(node: &Node, obstacles: &ObstacleGrid, obstacle: usize) -> usize {
    node.outline
        .map_or_else(|| obstacles.features(obstacle), |outline| features_of_outline(outline, obstacles, obstacle))
}

/// The contact of a link, or of something that can be pushed, with an obstacle of a scene at one of the features that describe
/// the pair; a peg has one.
#[inline]
pub fn link_obstacle_contact(
    pose: &Vector3<f64>,
    cos: f64,
    sin: f64,
    link: Node,
    obstacles: &ObstacleGrid,
    (obstacle, feature): (usize, usize),
) -> LinkContact {
    match (link.outline, obstacles.pegs().get(obstacle)) {
        (None, Some(peg)) => link_peg_contact(pose, cos, sin, &link, peg),
        _ => other_contact(pose, cos, sin, link, obstacles, (obstacle, feature)),
    }
}

/// The same of all pairs but links and pegs, which are most.
fn other_contact(
    pose: &Vector3<f64>,
    cos: f64,
    sin: f64,
    link: Node,
    obstacles: &ObstacleGrid,
    (obstacle, feature): (usize, usize),
) -> LinkContact {
    if let Some(outline) = link.outline {
        let placed = PlacedLink { link, pose: *pose, axis: Vector2::new(cos, sin) };
        return outline_obstacle_contact(&placed, outline, obstacles, (obstacle, feature));
    }
    match obstacles.stop(obstacle) {
        Some(movable) => stop_contact(pose, movable),
        None => link_wall_contact(pose, cos, sin, &link, obstacles.polygon(obstacle), feature),
    }
}

/// Distance of the centre line of a link from an obstacle at which they touch \[m\].
pub fn touching_distance(link: &Link, obstacles: &ObstacleGrid, obstacle: usize) -> f64 {
    obstacles.pegs().get(obstacle).map_or(0.0, |peg| peg.radius) + link.radius
}

/// Vector from the peg's centre to the nearest point of the link's centre line, and that point's
/// coordinate `s` along the link.
fn separation(pose: &Vector3<f64>, cos: f64, sin: f64, link: &Link, peg: &Peg) -> (Vector2<f64>, f64) {
    let from_peg = Vector2::new(pose.x - peg.x, pose.y - peg.y);
    let axis = Vector2::new(cos, sin);
    let [front, rear] = link.sides();
    let s = (-from_peg.dot(&axis)).clamp(front, rear);
    (from_peg + axis * s, s)
}
