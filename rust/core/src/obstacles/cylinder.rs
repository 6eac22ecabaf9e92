//! Cylinders in any direction: poles, which are solid, and pipes, walls without thickness that links touch on both sides.

use nalgebra::Vector3;

use crate::error::{ConfigError, coordinate, length, require};

use super::Rectangle;
use super::solid::{SolidContact, SolidLine};
use super::surface::ALONG;

/// A cylinder between the centres of its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    pub(super) start: Vector3<f64>,
    /// Unit vector to the other end.
    pub(super) axis: Vector3<f64>,
    pub(super) length: f64,
    pub(super) radius: f64,
    pub(super) is_pipe: bool,
}

impl Cylinder {
    /// # Errors
    /// Names the field that is not admissible.
    pub fn new(start: [f64; 3], end: [f64; 3], radius: f64, is_pipe: bool) -> Result<Self, ConfigError> {
        for (field, point) in [("start", start), ("end", end)] {
            for (axis, &value) in point.iter().enumerate() {
                coordinate(&format!("{field}[{axis}]"), value)?;
            }
        }
        length("radius", radius)?;
        let way = Vector3::from(end) - Vector3::from(start);
        require(way.norm() > SHORTEST, "end", format!("{end:?}"), "another point than the start")?;
        Ok(Self { start: start.into(), axis: way.normalize(), length: way.norm(), radius, is_pipe })
    }

    pub fn rectangle(&self) -> Rectangle {
        let end = self.start + self.axis * self.length;
        let around = Rectangle::around([self.start.xy(), end.xy()]);
        let room = self.axis.xy().map(|share| self.radius * (1.0 - share * share).max(0.0).sqrt());
        Rectangle { low: around.low - room, high: around.high + room }
    }

    /// Calls `visit` with every contact.
    pub fn visit_contacts(&self, line: &SolidLine, mut visit: impl FnMut(usize, SolidContact)) {
        for feature in 0..FEATURES {
            let contact = self.contact_at(line, feature);
            if contact.distance < f64::INFINITY {
                visit(feature, contact);
            }
        }
    }

    /// The contact at a feature: the ends of the line, an inner part of it, or a rim.
    pub fn contact_at(&self, line: &SolidLine, feature: usize) -> SolidContact {
        match (feature, self.is_pipe) {
            (0 | 1, false) => self.solid_contact(line, ALONG[feature]),
            (0 | 1, true) => self.wall_contact(line, ALONG[feature]),
            (2 | 3, false) => self.inner_contact(line, feature == 3),
            (2, true) => self.outside_contact(line),
            (3, true) => self.crossing(line),
            (4.., true) => self.rim_contact(line, feature >= 6, feature % 2 == 1),
            _ => SolidContact::AWAY,
        }
    }

    /// Coordinate along the axis, distance from it, and the unit vector away from it.
    fn coordinates(&self, point: &Vector3<f64>) -> (f64, f64, Vector3<f64>) {
        let offset = point - self.start;
        let along = offset.dot(&self.axis);
        let across = offset - self.axis * along;
        let outward = across.try_normalize(0.0).unwrap_or_else(|| self.any_direction_across());
        (along, across.norm(), outward)
    }

    fn any_direction_across(&self) -> Vector3<f64> {
        let other = if self.axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
        self.axis.cross(&other).normalize()
    }

    /// Of a point and the solid cylinder: the distance, negative inside, and the direction in which it grows.
    fn signed_distance(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let (along, from_axis, outward) = self.coordinates(point);
        let beside = from_axis - self.radius;
        let (beyond, end) =
            if along > 0.5 * self.length { (along - self.length, self.axis) } else { (-along, -self.axis) };
        if beside > 0.0 && beyond > 0.0 {
            let distance = beside.hypot(beyond);
            return (distance, (outward * beside + end * beyond) / distance);
        }
        if beyond > beside { (beyond, end) } else { (beside, outward) }
    }

    /// Where the distance from the mantle falls and rises with the slope `level` \[m\], if the mantle is nearer than the ends
    /// all along the line: the slope is `s / |s h / h^2 + r|`, `s` being h^2 times the way from the place nearest to the axis,
    /// `r` the offset there and `h` the part of the line across the axis.
    fn level_beside(&self, line: &SolidLine, level: f64) -> Option<[f64; 2]> {
        let across = |v: &Vector3<f64>| v - self.axis * v.dot(&self.axis);
        let (offset, half) = (line.middle - self.start, across(&line.half));
        let along = offset.dot(&self.axis);
        let to_end = along.min(self.length - along) - line.half.dot(&self.axis).abs();
        let squared = half.norm_squared();
        let nearest = -half.dot(&offset) / squared;
        let from_axis = (across(&offset) + half * nearest).norm();
        let is_beside = to_end > 0.0 && from_axis - self.radius > -to_end;
        let way = level * from_axis / (squared * (1.0 - level * level / squared).sqrt());
        (is_beside && way.is_finite()).then_some([nearest - way, nearest + way])
    }

    fn solid_contact(&self, line: &SolidLine, along: f64) -> SolidContact {
        let (distance, normal) = self.signed_distance(&line.point(along));
        SolidContact { distance, normal, along, is_redundant: false }
    }

    /// Of the inner part of the line that is nearest to the solid cylinder, its first or its last point: the distance
    /// from a convex body is convex along a line.
    fn inner_contact(&self, line: &SolidLine, is_last: bool) -> SolidContact {
        let slope = |along: f64| self.signed_distance(&line.point(along)).1.dot(&line.half);
        let level = LEVEL * line.half.norm();
        let falls = |along: f64| slope(along) < if is_last { level } else { -level };
        if !falls(-1.0) || falls(1.0) {
            return SolidContact::AWAY;
        }
        if let Some([first, last]) = self.level_beside(line, level) {
            return match is_last {
                true if last - first <= SAME => SolidContact::AWAY,
                true => self.solid_contact(line, last),
                false => self.solid_contact(line, first),
            };
        }
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if falls(middle) { low = middle } else { high = middle }
        }
        // The last point of a part that is no longer than a point is the first.
        if is_last && !(slope(high - SAME) < level && slope(high - SAME) > -level) {
            return SolidContact::AWAY;
        }
        self.solid_contact(line, high)
    }

    /// Whether a line is inside the pipe: its middle, or, where that is before or behind the pipe, the point at which the
    /// line passes the plane of the mouth.
    fn is_inside(&self, line: &SolidLine) -> bool {
        let (along, from_axis, _) = self.coordinates(&line.middle);
        let to_mouth = along.clamp(0.0, self.length) - along;
        if to_mouth == 0.0 {
            return from_axis < self.radius;
        }
        self.coordinates(&line.point(to_mouth / line.half.dot(&self.axis))).1 < self.radius
    }

    /// Of an end of the line and the wall of a pipe.
    fn wall_contact(&self, line: &SolidLine, place: f64) -> SolidContact {
        let point = line.point(place);
        let (along, from_axis, outward) = self.coordinates(&point);
        let beyond = (-along).max(along - self.length);
        if beyond > 0.0 {
            let rim = self.start + self.axis * along.clamp(0.0, self.length) + outward * self.radius;
            return SolidContact { is_redundant: false, ..SolidContact::between(line, place, &rim, outward) };
        }
        let (distance, normal) =
            if self.is_inside(line) { (self.radius - from_axis, -outward) } else { (from_axis - self.radius, outward) };
        SolidContact { distance, normal, along: place, is_redundant: false }
    }

    /// Of a line that crosses the wall of a pipe, as deep as the end that is nearer to the wall; other features are its ways
    /// out.
    fn crossing(&self, line: &SolidLine) -> SolidContact {
        let across = |v: &Vector3<f64>| v - self.axis * v.dot(&self.axis);
        let (half, offset) = (across(&line.half), across(&(line.middle - self.start)));
        let (squared, towards) = (half.norm_squared(), half.dot(&offset));
        let root = (towards * towards - squared * (offset.norm_squared() - self.radius * self.radius)).sqrt();
        // Not numbers for a line that misses the wall, or is parallel to it.
        let crosses = [-root, root].iter().any(|root| {
            let place = (root - towards) / squared;
            place.abs() < 1.0 && (0.0..=self.length).contains(&self.coordinates(&line.point(place)).0)
        });
        let from_wall = |end: f64| (self.coordinates(&line.point(end)).1 - self.radius).abs();
        let depth = from_wall(-1.0).min(from_wall(1.0));
        if crosses { SolidContact { distance: -depth, ..SolidContact::NONE } } else { SolidContact::AWAY }
    }

    /// Of an inner point of the line and the outside of a pipe.
    fn outside_contact(&self, line: &SolidLine) -> SolidContact {
        let between = line.middle - self.start;
        let across = |v: &Vector3<f64>| v - self.axis * v.dot(&self.axis);
        let (half, offset) = (across(&line.half), across(&between));
        let place = -half.dot(&offset) / half.norm_squared();
        // Not a number for a parallel line, whose ends are as near.
        if place.is_nan() || place.abs() >= 1.0 {
            return SolidContact::AWAY;
        }
        let (along, from_axis, outward) = self.coordinates(&line.point(place));
        let is_beside = along > 0.0 && along < self.length && !self.is_inside(line);
        let contact =
            SolidContact { distance: from_axis - self.radius, normal: outward, along: place, is_redundant: false };
        if is_beside { contact } else { SolidContact::AWAY }
    }

    /// Of an inner point of the line and a rim: of those nearest to both ends of the line, each once.
    fn rim_contact(&self, line: &SolidLine, is_far: bool, is_second: bool) -> SolidContact {
        let (centre, into_wall) =
            if is_far { (self.start + self.axis * self.length, -self.axis) } else { (self.start, self.axis) };
        let middle = line.middle - centre;
        let lowest = middle.dot(&into_wall) - line.half.dot(&into_wall).abs();
        if lowest > ROUNDING * (middle.norm() + line.half.norm() + self.radius) {
            // Beside the wall, which is nearer than its rim.
            return SolidContact::AWAY;
        }
        let [first, second] = ALONG.map(|end| self.nearest_to_rim(line, &centre, end));
        let place = if is_second { second } else { first };
        if place.abs() >= 1.0 || (is_second && (first - second).abs() < SAME) {
            return SolidContact::AWAY;
        }
        let contact = SolidContact::between(line, place, &self.on_rim(line, &centre, place), into_wall);
        // Elsewhere the wall is nearer than its rim.
        if contact.normal.dot(&into_wall) > ROUNDING { SolidContact::AWAY } else { contact }
    }

    /// The place of the line that is nearest to a rim, from one of its ends on.
    fn nearest_to_rim(&self, line: &SolidLine, centre: &Vector3<f64>, end: f64) -> f64 {
        let squared = line.half.norm_squared().max(f64::MIN_POSITIVE);
        let nearest = |place: f64| (self.on_rim(line, centre, place) - line.middle).dot(&line.half) / squared;
        let mut place = end;
        for _ in 0..ROUNDS {
            let next = nearest(place).clamp(-1.0, 1.0);
            if next == place {
                break;
            }
            place = next;
        }
        place
    }

    /// The point of a rim that is nearest to a point of the line.
    fn on_rim(&self, line: &SolidLine, centre: &Vector3<f64>, place: f64) -> Vector3<f64> {
        centre + self.coordinates(&line.point(place)).2 * self.radius
    }
}

/// Two ends, two inner parts or the outside and the wall of a pipe, and two places at either rim.
const FEATURES: usize = 8;

/// Shortest cylinder \[m\].
const SHORTEST: f64 = 1e-9;

/// Bisections of a centre line: to round-off.
const HALVINGS: u32 = 52;

/// Iterations of the nearest points of a line and a rim.
const ROUNDS: u32 = 64;

/// Cosine between a line and the direction of growing distance from which on it keeps its distance.
const LEVEL: f64 = 1e-9;

/// Share of a line between two points that count as one.
const SAME: f64 = 1e-6;

const ROUNDING: f64 = 1e-10;
