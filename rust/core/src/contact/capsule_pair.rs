//! Distance between two links as capsules in 3D: the points within `radius` of a centre line.
//!
//! The centre lines of skew links are nearest to each other inside both, all others at an end of one of them, and
//! parallel ones at two ends at once. A pair is therefore described by the distances of the ends of either centre line
//! to the other line, and by the distance of the two straight lines where its points lie inside both: at most five
//! contacts, the least of which is the distance of the capsules. Each is a convex function of the relative translation
//! of the links: that of an end is the distance to a segment, that of the lines the distance to a plane. Its tangent
//! plane never overestimates it.

use nalgebra::Vector3;

use crate::robot::Link;

/// Contacts of a pair: 0 and 1 are the first link's ends, 2 and 3 the second's, 4 the crossing of the lines.
pub const CAPSULE_CONTACTS: usize = 5;

/// A link in 3D.
#[derive(Debug, Clone, Copy)]
pub struct Capsule<'a> {
    pub link: &'a Link,
    /// CG \[m\].
    pub centre: Vector3<f64>,
    /// e_z^B.
    pub axis: Vector3<f64>,
}

/// A point of either centre line, and the distance between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CapsuleContact {
    /// Distance of the surfaces around these points, negative where they overlap \[m\].
    pub gap: f64,
    /// Unit vector from the second link to the first.
    pub normal: Vector3<f64>,
    /// Coordinates of the points along the centre lines \[m\].
    pub along: [f64; 2],
}

impl Capsule<'_> {
    /// Point of the centre line at the coordinate `s`.
    pub fn point(&self, s: f64) -> Vector3<f64> {
        self.centre + self.axis * s
    }

    /// Coordinate of the point of the centre line that is nearest to `point`.
    fn nearest(&self, point: &Vector3<f64>) -> f64 {
        let [front, rear] = self.link.sides();
        (point - self.centre).dot(&self.axis).clamp(front, rear)
    }

    fn end(&self, end: usize) -> f64 {
        self.link.sides()[end % 2]
    }

    fn reaches(&self, s: f64) -> bool {
        (s - self.link.cg_offset).abs() < self.link.contact_half_length
    }
}

/// The contacts of a pair with their numbers; one of two ends is listed once, as the first link's.
pub fn capsule_contacts(links: [&Capsule; 2]) -> impl Iterator<Item = (usize, CapsuleContact)> {
    let of_ends = [0, 1, 2, 3].map(|end| nearest_points(links, end));
    let is_listed = move |end: usize| end < 2 || !of_ends[..2].contains(&of_ends[end]);
    let ends = (0..4).filter(move |&end| is_listed(end)).map(move |end| (end, of_ends[end]));
    ends.chain(crossing(links).map(|along| (4, along))).map(move |(contact, along)| (contact, contact_at(links, along)))
}

/// One contact of a pair; that of the lines only where they cross inside both links.
pub fn capsule_contact(links: [&Capsule; 2], contact: usize) -> Option<CapsuleContact> {
    let along = if contact < 4 { Some(nearest_points(links, contact)) } else { crossing(links) };
    along.map(|along| contact_at(links, along))
}

/// The nearest points of two links.
pub fn closest_capsule_contact(links: [&Capsule; 2]) -> CapsuleContact {
    let first = contact_at(links, nearest_points(links, 0));
    capsule_contacts(links).fold(first, |closest, (_, other)| if other.gap < closest.gap { other } else { closest })
}

/// Distance of the surfaces of two links, negative where they overlap \[m\].
pub fn capsule_gap(links: [&Capsule; 2]) -> f64 {
    closest_capsule_contact(links).gap
}

/// Coordinates along both centre lines of an end of one and the nearest point of the other.
fn nearest_points([first, second]: [&Capsule; 2], end: usize) -> [f64; 2] {
    if end < 2 {
        let s = first.end(end);
        [s, second.nearest(&first.point(s))]
    } else {
        let s = second.end(end);
        [first.nearest(&second.point(s)), s]
    }
}

/// Coordinates of the nearest points of the straight lines, where both lie inside the links.
fn crossing([first, second]: [&Capsule; 2]) -> Option<[f64; 2]> {
    let (offset, cosine) = (first.centre - second.centre, first.axis.dot(&second.axis));
    let squared_sine = 1.0 - cosine * cosine;
    // Of nearly parallel lines no point is nearest, and the ends describe them.
    if squared_sine < PARALLEL {
        return None;
    }
    let (a, b) = (first.axis.dot(&offset), second.axis.dot(&offset));
    let along = [(cosine * b - a) / squared_sine, (b - cosine * a) / squared_sine];
    (first.reaches(along[0]) && second.reaches(along[1])).then_some(along)
}

fn contact_at([first, second]: [&Capsule; 2], along: [f64; 2]) -> CapsuleContact {
    let offset = first.point(along[0]) - second.point(along[1]);
    let distance = offset.norm();
    // Points that coincide leave the side open: take that across both links.
    let across = || first.axis.cross(&second.axis).try_normalize(0.0).unwrap_or_else(Vector3::z);
    let normal = if distance > 0.0 { offset / distance } else { across() };
    CapsuleContact { gap: distance - (first.link.radius + second.link.radius), normal, along }
}

/// Squared sine of the angle between two links below which they count as parallel: the ends are then the nearest points
/// to within a nanometre.
const PARALLEL: f64 = 1e-6;
