//! Distance between a stadium-shaped link and an obstacle, with a moving contact point.

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{ConvexPolygon, Movable, Node, ObstacleGrid, Peg};
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
    link_peg_gap(&PlacedLink::new(link, *pose), peg)
}

fn link_peg_gap(placed: &PlacedLink, peg: &Peg) -> f64 {
    separation(placed, peg).0.norm() - (peg.radius + placed.link.radius)
}

/// Gap of a link and an obstacle at one of the features that describe the pair \[m\]; infinite where another one covers
/// it. Arguments as of [`link_obstacle_contact`].
#[inline]
pub fn link_obstacle_gap(placed: &PlacedLink, obstacles: &ObstacleGrid, at: (usize, usize)) -> f64 {
    if let Some(peg) = obstacles.pegs().get(at.0).filter(|_| placed.link.outline.is_none()) {
        return link_peg_gap(placed, peg);
    }
    let contact = link_obstacle_contact(placed, obstacles, at);
    if contact.is_redundant { f64::INFINITY } else { contact.gap }
}

/// Gap and force direction.
///
/// The nearest point of the link's centre line to the peg's centre lies at
/// `s = clamp((r_H - r_G) . e_x^B, -L_GS, L_GS)`, about the middle of the link. Inside the clamp this is the rectangle case
/// (T 3.8)-(T 3.9), (T 3.16 != D1); on it one of the end caps (T 3.10)-(T 3.12), (T 3.18 != D1). In both, the
/// normal `n` points from the peg to the link, and since moving `s` along the link changes the
/// distance only to second order, g' = n . (v_G + omega s e_y^B).
#[inline]
pub fn link_peg_contact(placed: &PlacedLink, peg: &Peg) -> LinkContact {
    let (offset, s) = separation(placed, peg);
    let distance = offset.norm();
    let lateral = placed.lateral();
    // A peg centred exactly on the link's centre line leaves the side open: take e_y^B.
    let normal = if distance > 0.0 { offset * (1.0 / distance) } else { lateral };
    LinkContact {
        gap: distance - (peg.radius + placed.link.radius),
        direction: placed.impulse_direction(&normal, s),
        lever: lever(s, &normal, &placed.axis, placed.link.radius),
        is_redundant: false,
    }
}

/// The contact of a link with one of the features that describe a polygon, see [`ConvexPolygon::separation`].
fn link_wall_contact(placed: &PlacedLink, wall: &ConvexPolygon, feature: usize) -> LinkContact {
    let link = placed.link;
    let at = wall.separation(&placed.centre_line(), feature);
    let along = at.along * link.contact_half_length + link.cg_offset;
    LinkContact {
        gap: at.distance - link.radius,
        direction: placed.impulse_direction(&at.normal, along),
        lever: lever(along, &at.normal, &placed.axis, link.radius),
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
    let placed = PlacedLink::new(node, *pose);
    let node = placed.link;
    let walls = obstacles.walls().near(pose.xy(), node.reach()).map(|wall| obstacles.pegs().len() + wall);
    let near = obstacles.near(pose.x, pose.y, node.reach()).chain(walls);
    let features = near.flat_map(|obstacle| (0..features(&node, obstacles, obstacle)).map(move |k| (obstacle, k)));
    features.map(|at| link_obstacle_gap(&placed, obstacles, at)).fold(f64::INFINITY, f64::min)
}

/// Gap between `link` and the walls in its reach \[m\]; infinite where there are none.
pub fn wall_gap(pose: &Vector3<f64>, link: &Link, obstacles: &ObstacleGrid) -> f64 {
    let line = PlacedLink::new(link, *pose).centre_line();
    let gap = |wall: usize| obstacles.walls().walls()[wall].polygon.distance(&line) - link.radius;
    obstacles.walls().near(pose.xy(), link.reach()).map(gap).fold(f64::INFINITY, f64::min)
}

/// Number of features that describe a link, or something that can be pushed, and an obstacle or its stop.
pub fn features(node: &Node, obstacles: &ObstacleGrid, obstacle: usize) -> usize {
    node.outline
        .map_or_else(|| obstacles.features(obstacle), |outline| features_of_outline(outline, obstacles, obstacle))
}

/// The contact of a link, or of something that can be pushed, with an obstacle of a scene at one of the features that describe
/// the pair; a peg has one.
#[inline]
pub fn link_obstacle_contact(placed: &PlacedLink, obstacles: &ObstacleGrid, at: (usize, usize)) -> LinkContact {
    match (placed.link.outline, obstacles.pegs().get(at.0)) {
        (None, Some(peg)) => link_peg_contact(placed, peg),
        _ => other_contact(placed, obstacles, at),
    }
}

/// The same of all pairs but links and pegs, which are most.
fn other_contact(placed: &PlacedLink, obstacles: &ObstacleGrid, (obstacle, feature): (usize, usize)) -> LinkContact {
    match (placed.link.outline, obstacles.stop(obstacle)) {
        (Some(outline), _) => outline_obstacle_contact(placed, outline, obstacles, (obstacle, feature)),
        (None, Some(movable)) => stop_contact(&placed.pose, movable),
        (None, None) => link_wall_contact(placed, obstacles.polygon(obstacle), feature),
    }
}

/// Distance of the centre line of a link from an obstacle at which they touch \[m\].
pub fn touching_distance(link: &Link, obstacles: &ObstacleGrid, obstacle: usize) -> f64 {
    obstacles.pegs().get(obstacle).map_or(0.0, |peg| peg.radius) + link.radius
}

/// Vector from the peg's centre to the nearest point of the link's centre line, and that point's
/// coordinate `s` along the link.
fn separation(PlacedLink { link, pose, axis }: &PlacedLink, peg: &Peg) -> (Vector2<f64>, f64) {
    let from_peg = Vector2::new(pose.x - peg.x, pose.y - peg.y);
    let [front, rear] = link.sides();
    let s = (-from_peg.dot(axis)).clamp(front, rear);
    (from_peg + axis * s, s)
}
