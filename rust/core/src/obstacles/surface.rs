//! Contacts of the centre line of a link with a surface of faces, edges and corners, by local minima of the distance.
//!
//! Two points, one of the line and one of the surface, are a contact where no step along the line or the surface brings
//! them nearer to each other to first order: an end of the line with the face that it projects into, an end or an inner
//! point with an edge or a corner whose faces all lead away from it. Flat and concave edges have no such point, so a line
//! that slides over the edges between the triangles of a smooth ground does not catch on them. The distance at a contact is
//! convex around it, so no linearisation of it overestimates the gap.

use nalgebra::Vector3;

use super::solid::{SolidContact, SolidLine};

/// A part of a surface.
#[derive(Clone, Copy)]
pub(super) enum Part {
    /// Outward normal of a flat part, and a point of it.
    Face { normal: Vector3<f64>, point: Vector3<f64> },
    /// Where two faces meet: from one end to the other.
    Edge([Vector3<f64>; 2]),
    /// Where edges meet.
    Corner(Vector3<f64>),
}

/// The surface of a body, of numbered parts.
pub(super) trait Surface {
    /// Whether a part may lie within `reach` of the line.
    fn is_near(&self, _line: &SolidLine, _reach: f64) -> bool {
        true
    }
    /// Calls `visit` with all parts that may lie within `reach` of the line, except flat and concave edges and corners.
    fn visit_parts(&self, line: &SolidLine, reach: f64, visit: impl FnMut(usize, Part));
    fn part(&self, number: usize) -> Part;
    /// Whether a face has the point `foot` of its plane.
    fn holds(&self, face: usize, foot: &Vector3<f64>) -> bool;
    /// Unit vectors from an edge into its faces, along them, or along the edges of a corner, away from it.
    fn visit_directions(&self, number: usize, visit: impl FnMut(&Vector3<f64>));
    /// Whether links touch a face, or the ground's own law acts there.
    fn touches(&self, _face: usize) -> bool {
        true
    }
    /// The face through which a point that is inside the body leaves it; none outside.
    fn exit(&self, point: &Vector3<f64>) -> Option<usize>;
}

/// The part of a surface that a feature of the pair belongs to.
pub(super) fn part_of(feature: usize) -> usize {
    feature / SITES
}

/// Calls `visit` with every contact whose parts lie within `reach`, of features that are numbered by the parts of the
/// surface, each once where faces and edges meet in one plane. Those of an inner point that has entered the body are
/// redundant: only their depth counts.
pub(super) fn visit_contacts(
    surface: &impl Surface,
    line: &SolidLine,
    reach: f64,
    mut visit: impl FnMut(usize, SolidContact),
) {
    if !surface.is_near(line, reach) {
        return;
    }
    let seen = Seen::new(surface, line, reach);
    let mut found = [SolidContact::NONE; KEPT];
    let mut count = 0;
    // An end may have entered the body farther than the reach.
    for (end, exit) in seen.exits.iter().enumerate() {
        if let Some(face) = exit.filter(|&face| surface.touches(face)) {
            visit(face * SITES + end, seen.end_on_face(&surface.part(face), end));
        }
    }
    surface.visit_parts(line, reach, |number, part| {
        let is_face = matches!(part, Part::Face { .. });
        for site in (0..SITES).filter(|&site| !is_face || seen.exits.get(site) == Some(&None)) {
            let Some(contact) = seen.contact(number, &part, site) else { continue };
            if !found[..count].iter().any(|known| is_same(known, &contact)) {
                if count < KEPT {
                    found[count] = contact;
                    count += 1;
                }
                visit(number * SITES + site, contact);
            }
        }
    });
}

/// The contact at a feature; where there is none, the nearest one of the same place of the line.
pub(super) fn contact_at(surface: &impl Surface, line: &SolidLine, reach: f64, feature: usize) -> SolidContact {
    let (number, site) = (feature / SITES, feature % SITES);
    let seen = Seen::new(surface, line, f64::INFINITY);
    seen.contact(number, &surface.part(number), site).unwrap_or_else(|| {
        let mut nearest = SolidContact::AWAY;
        visit_contacts(surface, line, reach, |other, contact| {
            if other % SITES == site && contact.distance < nearest.distance {
                nearest = contact;
            }
        });
        nearest
    })
}

/// A line in front of a surface.
struct Seen<'a, S> {
    surface: &'a S,
    line: &'a SolidLine,
    reach: f64,
    ends: [Vector3<f64>; 2],
    /// The faces through which ends leave the body that they are in.
    exits: [Option<usize>; 2],
}

impl<'a, S: Surface> Seen<'a, S> {
    fn new(surface: &'a S, line: &'a SolidLine, reach: f64) -> Self {
        let ends = [-1.0, 1.0].map(|along| line.point(along));
        Self { surface, line, reach, ends, exits: [0, 1].map(|end| surface.exit(&ends[end])) }
    }

    #[inline]
    fn contact(&self, number: usize, part: &Part, site: usize) -> Option<SolidContact> {
        match part {
            Part::Face { .. } => {
                let contact = self.end_on_face(part, site);
                let is_here = match self.exits[site] {
                    Some(exit) => exit == number,
                    None => {
                        let foot = self.ends[site] - contact.normal * contact.distance;
                        contact.distance >= 0.0 && self.surface.holds(number, &foot)
                    }
                };
                (contact.distance <= self.reach && is_here).then_some(contact)
            }
            Part::Edge(ends) => self.with_edge(number, ends, site),
            Part::Corner(at) => {
                let along = if site < 2 { ALONG[site] } else { nearest_on_line(self.line, at)? };
                self.between(number, (along, site), at)
            }
        }
    }

    fn end_on_face(&self, face: &Part, end: usize) -> SolidContact {
        let Part::Face { normal, point } = *face else { return SolidContact::AWAY };
        let distance = (self.ends[end] - point).dot(&normal);
        SolidContact { distance, normal, along: ALONG[end], is_redundant: false }
    }

    fn with_edge(&self, number: usize, [from, to]: &[Vector3<f64>; 2], site: usize) -> Option<SolidContact> {
        let direction = to - from;
        let (along, share) = if site < 2 {
            (ALONG[site], (self.ends[site] - from).dot(&direction) / direction.norm_squared())
        } else {
            nearest_of_lines(self.line, from, &direction)?
        };
        (share > 0.0 && share < 1.0).then(|| self.between(number, (along, site), &(from + direction * share))).flatten()
    }

    /// Of a point of the line and one of an edge or a corner.
    fn between(&self, number: usize, (along, site): (f64, usize), nearest: &Vector3<f64>) -> Option<SolidContact> {
        let offset = self.line.point(along) - nearest;
        let distance = offset.norm();
        let is_entered = site < 2 && self.exits[site].is_some();
        if distance > self.reach || is_entered {
            return None;
        }
        let (mut leads_away, mut inward) = (true, Vector3::zeros());
        self.surface.visit_directions(number, |direction| {
            leads_away &= offset.dot(direction) <= ROUNDING * distance;
            inward += direction;
        });
        if leads_away {
            let outward = || (-inward).try_normalize(0.0).unwrap_or_else(Vector3::z);
            let normal = if distance > 0.0 { offset / distance } else { outward() };
            return Some(SolidContact { distance, normal, along, is_redundant: false });
        }
        // Behind the part: a line that is inside there has passed it.
        let is_inside = site == 2 && self.surface.exit(&self.line.point(along)).is_some();
        is_inside.then(|| SolidContact { distance: -distance, normal: -offset / distance, along, is_redundant: true })
    }
}

/// Positions of the nearest points of a centre line and another line: between -1 and 1 on the first, and the share of
/// `direction` on the second. None at an end of the first, and for parallel lines.
fn nearest_of_lines(line: &SolidLine, from: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, f64)> {
    let between = line.middle - from;
    let (a, b, c) = (line.half.norm_squared(), line.half.dot(direction), direction.norm_squared());
    let (d, e) = (line.half.dot(&between), direction.dot(&between));
    let determinant = a * c - b * b;
    if determinant <= PARALLEL * a * c {
        return None;
    }
    let along = (b * e - c * d) / determinant;
    (along.abs() < 1.0).then(|| (along, (a * e - b * d) / determinant))
}

/// Position of the inner point of a centre line that is nearest to a point.
fn nearest_on_line(line: &SolidLine, point: &Vector3<f64>) -> Option<f64> {
    let along = (point - line.middle).dot(&line.half) / line.half.norm_squared();
    (along.abs() < 1.0).then_some(along)
}

fn is_same(one: &SolidContact, other: &SolidContact) -> bool {
    (one.along - other.along).abs() < ROUNDING
        && (one.distance - other.distance).abs() < ROUNDING
        && (one.normal - other.normal).norm_squared() < ROUNDING * ROUNDING
}

/// The ends of a centre line, and its inner points.
const SITES: usize = 3;

/// Positions of the ends.
pub(super) const ALONG: [f64; 2] = [-1.0, 1.0];

/// Contacts of a link that are compared with each other.
const KEPT: usize = 16;

/// Round-off of lengths and directions.
const ROUNDING: f64 = 1e-10;

/// Squared sine between two lines that count as parallel.
const PARALLEL: f64 = 1e-12;
