//! Places at which a centre line touches a prism: its vertical edges, each up to its corner, and the edges of its top
//! face.

use nalgebra::{Vector2, Vector3};

use super::solid::{Solid, SolidContact, SolidLine};
use super::{CentreLine, ConvexPolygon, Separation};

/// The corners, then the edges of the top face; a wall without thickness has one.
pub(super) fn features(polygon: &ConvexPolygon) -> usize {
    let count = polygon.vertices().len();
    count + if count > 2 { count } else { 1 }
}

/// Depth, negative, of a line that crosses the polygon, and the positions between which it does.
pub(super) fn crossing(polygon: &ConvexPolygon, shadow: &CentreLine) -> Option<(f64, [f64; 2])> {
    let depth = polygon.distance(shadow);
    (depth < 0.0).then(|| (depth, polygon.within(shadow)))
}

/// How a crossing line leaves the polygon at one of the features of a body.
pub(super) fn way_out(polygon: &ConvexPolygon, shadow: &CentreLine, feature: usize) -> Separation {
    if feature < polygon.features() {
        polygon.separation(shadow, feature)
    } else {
        Separation { distance: 0.0, normal: Vector2::x(), along: 0.0, is_redundant: true }
    }
}

impl Solid<'_> {
    pub(super) fn polygon_contact(&self, polygon: &ConvexPolygon, line: &SolidLine, part: usize) -> SolidContact {
        let vertices = polygon.vertices();
        let corner = |vertex: usize| vertices[vertex % vertices.len()].push(self.height);
        match part.checked_sub(vertices.len()) {
            None => self.corner_contact(line, &corner(part)),
            Some(edge) => edge_contact(line, &corner(edge), &corner(edge + 1)),
        }
    }

    /// With the vertical edge below a corner: where the line passes it below the corner, the distance seen from above.
    fn corner_contact(&self, line: &SolidLine, corner: &Vector3<f64>) -> SolidContact {
        let beside = line.shadow().nearest(&corner.xy());
        let passes_below = line.point(beside).z <= self.height;
        let along = if passes_below { beside } else { nearest(line, corner) };
        let point = line.point(along);
        let across = Vector3::new(-line.half.y, line.half.x, 0.0).try_normalize(0.0).unwrap_or_else(Vector3::x);
        SolidContact::between(line, along, &corner.xy().push(point.z.min(self.height)), across)
    }
}

/// With an edge of the top face, where the nearest points lie inside both.
fn edge_contact(line: &SolidLine, start: &Vector3<f64>, end: &Vector3<f64>) -> SolidContact {
    let (half, along, offset) = (line.half, end - start, line.middle - start);
    let (aa, ab, bb) = (half.norm_squared(), half.dot(&along), along.norm_squared());
    let determinant = aa * bb - ab * ab;
    // Of nearly parallel lines no point is nearest, and the ends and corners describe them.
    if determinant <= PARALLEL * aa * bb {
        return SolidContact::AWAY;
    }
    let (a, b) = (half.dot(&offset), along.dot(&offset));
    let (nearest, share) = ((ab * b - bb * a) / determinant, (aa * b - ab * a) / determinant);
    if nearest.abs() >= 1.0 || share <= 0.0 || share >= 1.0 {
        return SolidContact::AWAY;
    }
    SolidContact::between(line, nearest, &(start + along * share), Vector3::z())
}

fn nearest(line: &SolidLine, point: &Vector3<f64>) -> f64 {
    let squared = line.half.norm_squared();
    if squared > 0.0 { ((point - line.middle).dot(&line.half) / squared).clamp(-1.0, 1.0) } else { 0.0 }
}

/// Squared sine of the angle between a link and an edge below which they count as parallel.
const PARALLEL: f64 = 1e-6;
