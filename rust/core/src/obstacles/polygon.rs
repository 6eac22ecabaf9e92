//! Distance between the centre line of a link and a convex polygon, seen from above.
//!
//! A link is the set of points within its radius of its centre line, hence its distance to an obstacle is that of the
//! centre line less the radius. A centre line that does not cross a convex polygon is nearest to it at an end of the
//! line, or at a vertex of the polygon; where line and edge are parallel, at two such places at once. A pair is
//! therefore described by the distances of both ends to the polygon and of all vertices to the line. Each is a convex
//! function of the translation of the link, like the distance to a peg, so that its tangent plane never overestimates
//! it. A wall is a polygon of two vertices, whose two edges face either side.

use nalgebra::Vector2;

use super::Rectangle;

/// A convex polygon, its vertices in counter-clockwise order, or a wall with two of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexPolygon {
    vertices: Vec<Vector2<f64>>,
    /// Outward normal of the edge from each vertex to the next.
    normals: Vec<Vector2<f64>>,
}

/// The centre line of a link, seen from above: its middle, and half of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentreLine {
    pub middle: Vector2<f64>,
    pub half: Vector2<f64>,
}

/// Nearest points of a centre line and a polygon, at one of the features that describe the pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// Negative where the centre line has entered the polygon \[m\].
    pub distance: f64,
    /// Unit vector from the polygon to the line.
    pub normal: Vector2<f64>,
    /// Place on the centre line, from -1 at one end to 1 at the other.
    pub along: f64,
    /// Whether another feature describes the same contact, or a truer one.
    pub is_redundant: bool,
}

/// Where a point is nearest to a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPoint {
    /// Negative inside \[m\].
    pub distance: f64,
    /// Unit vector along which the distance grows.
    pub normal: Vector2<f64>,
    /// Whether it is a vertex of the polygon.
    pub is_corner: bool,
}

/// How a centre line that crosses a polygon leaves it soonest.
#[derive(Debug, Clone, Copy)]
enum Crossing {
    Edge(usize),
    /// Past the vertex, along the normal of the line.
    Vertex {
        nearest: usize,
        normal: Vector2<f64>,
    },
}

impl CentreLine {
    /// Unit vector to the left of the line; `None` seen along it.
    fn lateral(&self) -> Option<Vector2<f64>> {
        Vector2::new(-self.half.y, self.half.x).try_normalize(0.0)
    }

    /// Point at a position from -1 at one end to 1 at the other.
    pub fn point(&self, along: f64) -> Vector2<f64> {
        self.middle + self.half * along
    }

    /// Place of the point that is nearest to `point`.
    pub(super) fn nearest(&self, point: &Vector2<f64>) -> f64 {
        let squared = self.half.norm_squared();
        // All points of an upright link are equally near.
        if squared > UPRIGHT { ((point - self.middle).dot(&self.half) / squared).clamp(-1.0, 1.0) } else { 0.0 }
    }
}

impl ConvexPolygon {
    /// Of vertices in counter-clockwise order, no two neighbours of them equal.
    pub fn new(vertices: Vec<Vector2<f64>>) -> Self {
        let count = vertices.len();
        let normal = |i: usize| {
            let edge = vertices[(i + 1) % count] - vertices[i];
            Vector2::new(edge.y, -edge.x).normalize()
        };
        Self { normals: (0..count).map(normal).collect(), vertices }
    }

    pub fn vertices(&self) -> &[Vector2<f64>] {
        &self.vertices
    }

    /// The rectangle around it.
    pub fn rectangle(&self) -> Rectangle {
        Rectangle::around(self.vertices.iter().copied())
    }

    /// Number of features that describe a pair: the ends of the centre line, then the vertices.
    pub fn features(&self) -> usize {
        ENDS.len() + self.vertices.len()
    }

    /// The nearest points at one of the [`Self::features`].
    ///
    /// Where the centre line crosses the polygon, only the features through which it leaves soonest count: both ends over
    /// an edge, or a vertex beside the line.
    pub fn separation(&self, line: &CentreLine, feature: usize) -> Separation {
        let crossing = self.crossing(line);
        let vertex = feature.checked_sub(ENDS.len());
        match (crossing, vertex) {
            (None, None) => self.end_separation(line, ENDS[feature]),
            (None, Some(vertex)) => self.vertex_separation(line, vertex),
            (Some(Crossing::Edge(edge)), None) => Separation {
                distance: self.height(edge, &line.point(ENDS[feature])),
                normal: self.normals[edge],
                along: ENDS[feature],
                is_redundant: false,
            },
            (Some(Crossing::Vertex { nearest, normal }), Some(vertex)) if nearest == vertex => Separation {
                distance: normal.dot(&(line.middle - self.vertices[vertex])),
                normal,
                along: line.nearest(&self.vertices[vertex]),
                is_redundant: false,
            },
            (Some(_), _) => Separation { distance: 0.0, normal: Vector2::x(), along: 0.0, is_redundant: true },
        }
    }

    /// Distance of the centre line, negative where it crosses the polygon \[m\].
    pub fn distance(&self, line: &CentreLine) -> f64 {
        let features = (0..self.features()).map(|feature| self.separation(line, feature));
        features.filter(|at| !at.is_redundant).map(|at| at.distance).fold(f64::INFINITY, f64::min)
    }

    fn end_separation(&self, line: &CentreLine, end: f64) -> Separation {
        let (distance, normal) = self.signed_distance(&line.point(end));
        Separation { distance, normal, along: end, is_redundant: false }
    }

    /// A vertex nearest to an end of the line is the end's own contact.
    fn vertex_separation(&self, line: &CentreLine, vertex: usize) -> Separation {
        let along = line.nearest(&self.vertices[vertex]);
        let offset = line.point(along) - self.vertices[vertex];
        let normal = offset.try_normalize(0.0).or(line.lateral()).unwrap_or_else(Vector2::x);
        Separation { distance: offset.norm(), normal, along, is_redundant: along.abs() == 1.0 }
    }

    /// Distance of a point, negative inside, and the unit vector along which it grows \[m\].
    pub fn signed_distance(&self, point: &Vector2<f64>) -> (f64, Vector2<f64>) {
        let NearestPoint { distance, normal, .. } = self.nearest_point(point);
        (distance, normal)
    }

    /// The point of the outline that is nearest to a point.
    pub fn nearest_point(&self, point: &Vector2<f64>) -> NearestPoint {
        let facing = self.highest_edge(|edge| self.height(edge, point));
        let height = self.height(facing, point);
        if height <= 0.0 {
            return NearestPoint { distance: height, normal: self.normals[facing], is_corner: false };
        }
        let nearest = |edge: usize| {
            let (start, end) = (self.vertices[edge], self.vertices[(edge + 1) % self.vertices.len()]);
            let along = end - start;
            let share = ((point - start).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (point - (start + along * share), share == 0.0 || share == 1.0)
        };
        let offsets = (0..self.vertices.len()).map(nearest);
        let nearest = offsets.min_by(|a, b| a.0.norm_squared().total_cmp(&b.0.norm_squared()));
        let (offset, is_corner) = nearest.unwrap_or_default();
        let normal = offset.try_normalize(0.0).unwrap_or(self.normals[facing]);
        NearestPoint { distance: offset.norm(), normal, is_corner }
    }

    /// The same for a point of a body with its centre at `place` and these vertices. A wall without thickness has been crossed
    /// by points on its other side. What is inside has come through the edge that parts the bodies best: flush with another
    /// edge, the point is as near to that one.
    pub fn nearest_point_of(
        &self,
        place: &Vector2<f64>,
        vertices: impl Iterator<Item = Vector2<f64>> + Clone,
        point: &Vector2<f64>,
    ) -> NearestPoint {
        let nearest = self.nearest_point(point);
        let is_wall = self.vertices.len() == 2;
        let is_certain = if is_wall { nearest.is_corner } else { nearest.distance > ROUNDING };
        if is_certain {
            return nearest;
        }
        let clearance = |edge: usize| vertices.clone().map(|v| self.height(edge, &v)).fold(f64::INFINITY, f64::min);
        let edge = if is_wall { usize::from(self.height(0, place) < 0.0) } else { self.highest_edge(clearance) };
        NearestPoint { distance: self.height(edge, point), normal: self.normals[edge], ..nearest }
    }

    /// Places between which a centre line that crosses the polygon is inside it.
    pub fn within(&self, line: &CentreLine) -> [f64; 2] {
        let (mut from, mut to) = (-1.0, 1.0);
        for edge in 0..self.vertices.len() {
            let (middle, slope) = (self.height(edge, &line.middle), self.normals[edge].dot(&line.half));
            match (-middle / slope).clamp(-1.0, 1.0) {
                entry if slope < 0.0 => from = entry.max(from),
                leave if slope > 0.0 => to = leave.min(to),
                _ => {}
            }
        }
        // A wall without thickness is crossed at one place.
        [from, to.max(from)]
    }

    /// The way on which a centre line that crosses the polygon leaves it soonest; `None` if it does not cross.
    fn crossing(&self, line: &CentreLine) -> Option<Crossing> {
        let lowest = |edge: usize| self.height(edge, &line.point(-1.0)).min(self.height(edge, &line.point(1.0)));
        let edge = self.highest_edge(lowest);
        let lateral = line.lateral().filter(|_| lowest(edge) <= 0.0)?;
        let [left, right] = [lateral, -lateral].map(|normal| {
            let height = |vertex: &usize| normal.dot(&(line.middle - self.vertices[*vertex]));
            let nearest = (0..self.vertices.len()).min_by(|a, b| height(a).total_cmp(&height(b))).unwrap_or(0);
            (height(&nearest), Crossing::Vertex { nearest, normal })
        });
        let beside = if left.0 > right.0 { left } else { right };
        if beside.0 >= 0.0 {
            return None;
        }
        Some(if beside.0 > lowest(edge) { beside.1 } else { Crossing::Edge(edge) })
    }

    /// Height of a point above the line through an edge \[m\].
    fn height(&self, edge: usize, point: &Vector2<f64>) -> f64 {
        self.normals[edge].dot(&(point - self.vertices[edge]))
    }

    fn highest_edge(&self, height: impl Fn(usize) -> f64) -> usize {
        (1..self.normals.len()).fold(0, |highest, edge| if height(edge) > height(highest) { edge } else { highest })
    }
}

/// Distance of what counts as inside \[m\].
const ROUNDING: f64 = 1e-9;

/// Places of the ends of a centre line.
const ENDS: [f64; 2] = [-1.0, 1.0];

/// Squared half length of a centre line, seen from above, below which round-off would place the nearest point \[m^2\].
const UPRIGHT: f64 = 1e-21;
