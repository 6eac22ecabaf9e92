//! Distance between two stadium-shaped links that are not neighbours.
//!
//! Two centre lines that do not cross are nearest to each other at an end of one of them, and parallel ones at two ends
//! at once. A pair of links is therefore described by the distances of the ends of either centre line to the other
//! line, at most four contacts. Each is a convex function of the relative translation of the links, like the distance
//! of a link to a peg, so that its tangent plane never overestimates it.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};

use crate::obstacles::{CentreLine, Node, ObstacleGrid};

use super::gap::lever;
use super::outline::{features_of_pair, outline_pair_contact};

/// A link in the plane, or something that can be pushed.
#[derive(Debug, Clone, Copy)]
pub struct PlacedLink<'a> {
    pub link: Node<'a>,
    /// (x, y, theta) of the CG.
    pub pose: Vector3<f64>,
    /// e_x^B = (cos theta, sin theta).
    pub axis: Vector2<f64>,
}

/// An end of one centre line and the nearest point of the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPairContact {
    /// Distance of the surfaces around these points, negative where they overlap \[m\].
    pub gap: f64,
    /// Unit vector from the second link to the first.
    pub normal: Vector2<f64>,
    /// Coordinates of the points along the centre lines \[m\].
    pub along: [f64; 2],
    /// w of both links: `gap' = w[0] . u_0 + w[1] . u_1` for their twists (T 3.16), (T 3.18).
    pub direction: [Vector3<f64>; 2],
}

impl LinkPairContact {
    /// Generalised directions of unit impulses along the surfaces between links of these axes and radii, to the left of the
    /// normal on the first and against it on the second. Both act halfway between the surfaces, so that they turn nothing together.
    pub fn tangent(&self, axis: &[Vector2<f64>; 2], radius: &[f64; 2]) -> [Vector3<f64>; 2] {
        let into = [self.normal, -self.normal];
        [0, 1].map(|k| {
            let lever = lever(self.along[k], &into[k], &axis[k], radius[k] + 0.5 * self.gap);
            Vector3::new(-into[k].y, into[k].x, lever)
        })
    }
}

/// The contacts of a pair of links whose gap is below `margin`, each with the end that it belongs to: 0 and 1 are the first
/// link's ends in front and behind, 2 and 3 the second's. A contact of two ends is listed once, as the first link's.
pub fn link_pair_contacts<'a>(
    links: [&'a PlacedLink<'a>; 2],
    margin: f64,
) -> impl Iterator<Item = (usize, LinkPairContact)> + 'a {
    let along = [0, 1, 2, 3].map(|end| nearest_points(links, end));
    let is_own = move |end: usize| end < 2 || !along[..2].contains(&along[end]);
    // Rules out most ends without a root; the gap itself decides.
    let close = margin + links[0].link.radius + links[1].link.radius + ROUNDING;
    let is_close = move |along: [f64; 2]| offset(links, along).norm_squared() < close * close;
    (0..4).filter(move |&end| is_close(along[end]) && is_own(end)).filter_map(move |end| {
        let contact = contact_at(links, along[end]);
        (contact.gap < margin).then_some((end, contact))
    })
}

/// The contact of one end, numbered as in [`link_pair_contacts`]; with a polygon at one of the features of that pair, see
/// [`super::outline`].
pub fn link_pair_contact(links: [&PlacedLink; 2], end: usize) -> LinkPairContact {
    outline_pair_contact(links, end).unwrap_or_else(|| contact_at(links, nearest_points(links, end)))
}

/// The contacts whose gap is below `margin` of a pair of which the second can be pushed, with their features: with a disc, a
/// line without length, one of its ends.
pub fn movable_contacts<'a>(
    links: [&'a PlacedLink<'a>; 2],
    margin: f64,
) -> impl Iterator<Item = (usize, LinkPairContact)> + 'a {
    let contacts = movable_features(links).map(move |feature| (feature, link_pair_contact(links, feature)));
    contacts.filter(move |(_, contact)| contact.gap < margin)
}

/// The features that describe a pair of which the second can be pushed.
pub fn movable_features(links: [&PlacedLink; 2]) -> Range<usize> {
    features_of_pair(links.map(|link| link.link.outline)).unwrap_or(CENTRE..CENTRE + 1)
}

/// The number of features that describe a pair of a robot of `links` links and what it can push; `of_links` describe two
/// links, or a link and a disc.
pub fn pair_features(pair: [usize; 2], links: usize, obstacles: &ObstacleGrid, of_links: usize) -> usize {
    let outline = |node: usize| obstacles.movables().get(node.checked_sub(links)?)?.outline.as_deref();
    features_of_pair(pair.map(outline)).map_or(of_links, |features| features.end)
}

/// Coordinates along both centre lines of an end of one and the nearest point of the other.
fn nearest_points([first, second]: [&PlacedLink; 2], end: usize) -> [f64; 2] {
    let end_of = |link: &PlacedLink| link.link.sides()[end % 2];
    if end < 2 {
        let s = end_of(first);
        [s, second.nearest(&first.point(s))]
    } else {
        let s = end_of(second);
        [first.nearest(&second.point(s)), s]
    }
}

/// Distance of the surfaces of two links, negative where they overlap \[m\]; links whose centre lines cross overlap by the
/// sum of their radii.
pub fn link_pair_gap(links: [&PlacedLink; 2]) -> f64 {
    if centre_lines_cross(links) {
        return -(links[0].link.radius + links[1].link.radius);
    }
    let features = features_of_pair(links.map(|link| link.link.outline)).unwrap_or(0..4);
    features.map(|end| link_pair_contact(links, end).gap).fold(f64::INFINITY, f64::min)
}

/// Whether the centre lines of two links cross: the distances do not measure how deep the links then overlap.
pub fn centre_lines_cross(links: [&PlacedLink; 2]) -> bool {
    let [first, second] = links;
    if links.iter().any(|one| one.link.outline.is_some()) {
        return false;
    }
    let sides = |of: &PlacedLink, line: &PlacedLink| {
        of.link.sides().map(|s| (of.point(s) - line.pose.xy()).dot(&line.lateral()))
    };
    let apart = |[a, b]: [f64; 2]| a * b > 0.0 || (a == 0.0 && b == 0.0);
    !apart(sides(first, second)) && !apart(sides(second, first))
}

/// From the point of the second centre line to that of the first.
fn offset([first, second]: [&PlacedLink; 2], along: [f64; 2]) -> Vector2<f64> {
    first.point(along[0]) - second.point(along[1])
}

fn contact_at(links: [&PlacedLink; 2], along: [f64; 2]) -> LinkPairContact {
    let [first, second] = links;
    let offset = offset(links, along);
    let distance = offset.norm();
    // An end exactly on the other centre line leaves the side open: take e_y^B of the second link.
    let normal = if distance > 0.0 { offset / distance } else { second.lateral() };
    LinkPairContact {
        gap: distance - (first.link.radius + second.link.radius),
        normal,
        along,
        direction: [first.impulse_direction(&normal, along[0]), -second.impulse_direction(&normal, along[1])],
    }
}

impl<'a> PlacedLink<'a> {
    pub fn new(link: impl Into<Node<'a>>, pose: Vector3<f64>) -> Self {
        let (sin, cos) = pose.z.sin_cos();
        Self { link: link.into(), pose, axis: Vector2::new(cos, sin) }
    }

    pub(super) fn centre_line(&self) -> CentreLine {
        let half = self.axis * self.link.contact_half_length;
        CentreLine { middle: self.point(self.link.cg_offset), half }
    }

    /// Point of the centre line at the coordinate `s`.
    fn point(&self, s: f64) -> Vector2<f64> {
        self.pose.xy() + self.axis * s
    }

    /// Coordinate of the point of the centre line that is nearest to `point`.
    fn nearest(&self, point: &Vector2<f64>) -> f64 {
        let [front, rear] = self.link.sides();
        (point - self.pose.xy()).dot(&self.axis).clamp(front, rear)
    }

    /// e_y^B.
    pub(super) fn lateral(&self) -> Vector2<f64> {
        Vector2::new(-self.axis.y, self.axis.x)
    }

    /// Generalised direction of a unit impulse `normal` at the coordinate `s`.
    pub(super) fn impulse_direction(&self, normal: &Vector2<f64>, s: f64) -> Vector3<f64> {
        Vector3::new(normal.x, normal.y, s * normal.dot(&self.lateral()))
    }
}

/// The end of a disc.
const CENTRE: usize = 2;

/// Contacts that describe a pair of links.
pub const LINK_PAIR_CONTACTS: usize = 4;

/// More than the rounding of a distance \[m\].
const ROUNDING: f64 = 1e-9;

/// Contacts between links reserved for each link of a robot; one that is more tightly folded grows the lists once.
pub const LINK_CONTACTS_PER_LINK: usize = 4;
