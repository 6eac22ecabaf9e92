//! Distance between the centre line of a link and an obstacle of finite height: a vertical cylinder or prism that ends in
//! a top face.
//!
//! The body contains all points below its top face, so its distance is that of a convex set. A pair is described by the
//! distances of some parts of the link to some parts of the body: either end of the centre line to the whole body, and the
//! centre line to each edge of the top face and to what lies below each corner. The least of them is the distance of the
//! pair. No linearisation of one of them overestimates it, and their normals turn continuously: from vertical on the top
//! face over those of an edge to horizontal beside it.
//!
//! An end of a centre line above the top face is the business of the ground: the face carries it as the ground does, with
//! the same friction. All other contacts are those of obstacles.

use nalgebra::{Vector2, Vector3};

use super::{CentreLine, ConvexPolygon, Peg, Rectangle};

/// An obstacle of finite height.
#[derive(Debug, Clone, Copy)]
pub struct Solid<'a> {
    pub outline: Outline<'a>,
    /// Of the top face above the ground \[m\].
    pub height: f64,
}

/// Outline of an obstacle, seen from above.
#[derive(Debug, Clone, Copy)]
pub enum Outline<'a> {
    Circle(&'a Peg),
    Polygon(&'a ConvexPolygon),
}

impl Outline<'_> {
    pub fn rectangle(&self) -> Rectangle {
        match self {
            Self::Circle(peg) => {
                let centre = Vector2::new(peg.x, peg.y);
                Rectangle { low: centre.add_scalar(-peg.radius), high: centre.add_scalar(peg.radius) }
            }
            Self::Polygon(polygon) => polygon.rectangle(),
        }
    }
}

/// The centre line of a link: its middle, and half of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidLine {
    pub middle: Vector3<f64>,
    pub half: Vector3<f64>,
}

/// Nearest points of a centre line and a body, at one of the features that describe the pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolidContact {
    /// Negative where the centre line has entered the body \[m\].
    pub distance: f64,
    /// Unit vector from the body to the line.
    pub normal: Vector3<f64>,
    /// Place on the centre line, from -1 at one end to 1 at the other.
    pub along: f64,
    /// Whether another feature, or the ground, describes the same contact or a truer one.
    pub is_redundant: bool,
}

/// How a centre line that has entered a body leaves it soonest.
#[derive(Debug, Clone, Copy)]
pub(super) enum Exit {
    /// Over the top face, which the line is below between these positions.
    Up([f64; 2]),
    Sideways,
}

impl SolidLine {
    /// Point at a position from -1 at one end to 1 at the other.
    pub fn point(&self, along: f64) -> Vector3<f64> {
        self.middle + self.half * along
    }

    pub fn shadow(&self) -> CentreLine {
        CentreLine { middle: self.middle.xy(), half: self.half.xy() }
    }

    /// Places between which the line is at or below `height`; none where all of it is above.
    fn below(&self, height: f64) -> Option<[f64; 2]> {
        let [first, last] = [-1.0, 1.0].map(|along| self.point(along).z <= height);
        let crossing = || ((height - self.middle.z) / self.half.z).clamp(-1.0, 1.0);
        match (first, last) {
            (true, true) => Some([-1.0, 1.0]),
            (true, false) => Some([-1.0, crossing()]),
            (false, true) => Some([crossing(), 1.0]),
            (false, false) => None,
        }
    }

    /// The shadow of the part between two positions.
    fn shadow_between(&self, [from, to]: [f64; 2]) -> CentreLine {
        CentreLine { middle: self.point(0.5 * (from + to)).xy(), half: self.half.xy() * (0.5 * (to - from)) }
    }
}

impl SolidContact {
    /// Of a line that has entered the body: another feature is its way out.
    pub(super) const NONE: Self =
        Self { distance: 0.0, normal: Vector3::new(0.0, 0.0, 1.0), along: 0.0, is_redundant: true };

    /// The parts of link and body are nowhere nearest to each other.
    pub(super) const AWAY: Self = Self { distance: f64::INFINITY, ..Self::NONE };

    /// Of the point of a line at a position and the point of the body nearest to it; `fallback` is the normal where they
    /// coincide.
    pub(super) fn between(line: &SolidLine, along: f64, nearest: &Vector3<f64>, fallback: Vector3<f64>) -> Self {
        let offset = line.point(along) - nearest;
        let distance = offset.norm();
        let normal = if distance > 0.0 { offset / distance } else { fallback };
        // At its ends the line's contact is that of the end.
        Self { distance, normal, along, is_redundant: along.abs() >= 1.0 }
    }
}

impl Solid<'_> {
    /// Number of features that describe a pair; the first two are the ends of the centre line.
    pub fn features(&self) -> usize {
        ENDS.len()
            + match self.outline {
                Outline::Circle(_) => super::solid_circle::FEATURES,
                Outline::Polygon(polygon) => super::solid_polygon::features(polygon),
            }
    }

    /// Whether a point is above the top face, which is then the ground below it.
    pub fn carries(&self, point: &Vector3<f64>) -> bool {
        point.z > self.height && self.signed_distance(&point.xy()).0 <= 0.0
    }

    /// Calls `visit` with every feature and its contact.
    pub fn visit_contacts(&self, line: &SolidLine, mut visit: impl FnMut(usize, SolidContact)) {
        let exit = self.exit(line);
        (0..self.features()).for_each(|feature| visit(feature, self.contact(line, exit, feature)));
    }

    /// The contact at one feature.
    pub fn contact_at(&self, line: &SolidLine, feature: usize) -> SolidContact {
        self.contact(line, self.exit(line), feature)
    }

    /// Distance of the centre line, negative where it has entered the body \[m\].
    pub fn distance(&self, line: &SolidLine) -> f64 {
        let mut least = f64::INFINITY;
        self.visit_contacts(line, |feature, contact| {
            let is_carried = feature < ENDS.len() && self.carries(&line.point(ENDS[feature]));
            if !contact.is_redundant || is_carried {
                least = least.min(contact.distance);
            }
        });
        least
    }

    fn contact(&self, line: &SolidLine, exit: Option<Exit>, feature: usize) -> SolidContact {
        match (exit, feature.checked_sub(ENDS.len())) {
            (Some(Exit::Up(chord)), None) => {
                let along = chord[feature];
                let distance = line.point(along).z - self.height;
                SolidContact { distance, normal: Vector3::z(), along, is_redundant: false }
            }
            (Some(Exit::Up(_)), Some(_)) => SolidContact::NONE,
            (Some(Exit::Sideways), _) => self.way_out(line, feature),
            (None, None) => self.end_contact(line, ENDS[feature]),
            (None, Some(part)) => match self.outline {
                Outline::Circle(peg) => self.circle_contact(peg, line, part),
                Outline::Polygon(polygon) => self.polygon_contact(polygon, line, part),
            },
        }
    }

    /// Of an end of the centre line and the whole body.
    fn end_contact(&self, line: &SolidLine, end: f64) -> SolidContact {
        let point = line.point(end);
        let above = point.z - self.height;
        let (beside, outward) = self.signed_distance(&point.xy());
        let (distance, normal) = if beside > 0.0 && above > 0.0 {
            let distance = beside.hypot(above);
            (distance, (outward * beside).push(above) / distance)
        } else if above > beside {
            (above, Vector3::z())
        } else {
            (beside, outward.push(0.0))
        };
        SolidContact { distance, normal, along: end, is_redundant: self.carries(&point) }
    }

    /// The way out of a centre line that has entered the body.
    fn exit(&self, line: &SolidLine) -> Option<Exit> {
        let below = line.below(self.height)?;
        let shadow = line.shadow_between(below);
        let (beside, within) = match self.outline {
            Outline::Circle(peg) => super::solid_circle::crossing(peg, &shadow)?,
            Outline::Polygon(polygon) => super::solid_polygon::crossing(polygon, &shadow)?,
        };
        let on_line = within.map(|along| 0.5 * ((below[0] + below[1]) + along * (below[1] - below[0])));
        let up = on_line.map(|along| line.point(along).z - self.height);
        Some(if up[0].min(up[1]) > beside { Exit::Up(on_line) } else { Exit::Sideways })
    }

    /// The contact at a feature of a line that leaves the body sideways.
    fn way_out(&self, line: &SolidLine, feature: usize) -> SolidContact {
        let Some(below) = line.below(self.height) else { return SolidContact::NONE };
        let shadow = line.shadow_between(below);
        let out = match self.outline {
            Outline::Circle(peg) => super::solid_circle::way_out(peg, &shadow, feature),
            Outline::Polygon(polygon) => super::solid_polygon::way_out(polygon, &shadow, feature),
        };
        let on_line = 0.5 * ((below[0] + below[1]) + out.along * (below[1] - below[0]));
        SolidContact {
            distance: out.distance,
            normal: out.normal.push(0.0),
            along: on_line,
            is_redundant: out.is_redundant,
        }
    }

    /// Distance of a point from the outline, negative inside, and the unit vector along which it grows \[m\].
    fn signed_distance(&self, point: &Vector2<f64>) -> (f64, Vector2<f64>) {
        match self.outline {
            Outline::Circle(peg) => {
                let offset = point - Vector2::new(peg.x, peg.y);
                let distance = offset.norm();
                (distance - peg.radius, offset.try_normalize(0.0).unwrap_or_else(Vector2::x))
            }
            Outline::Polygon(polygon) => polygon.signed_distance(point),
        }
    }
}

/// Places of the ends of a centre line.
const ENDS: [f64; 2] = [-1.0, 1.0];
