//! Convex bodies: the convex hull of some points, such as a ramp, a wedge or a piece of rubble.

use nalgebra::{Vector2, Vector3};

use crate::error::{ConfigError, coordinate, require};

use super::Rectangle;
use super::solid::SolidLine;
use super::surface::{Part, Surface};

/// A convex polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    faces: Vec<PolyhedronFace>,
    edges: Vec<[usize; 2]>,
    /// From each edge into its two faces.
    into: Vec<[Vector3<f64>; 2]>,
    /// Corners, and unit vectors along the edges there.
    corners: Vec<(Vector3<f64>, Vec<Vector3<f64>>)>,
    low: Vector3<f64>,
    high: Vector3<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct PolyhedronFace {
    normal: Vector3<f64>,
    /// A point of each side, and the unit vector along the face from there into it.
    sides: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl Polyhedron {
    /// The convex hull of points.
    ///
    /// # Errors
    /// Names the field that is not admissible.
    pub fn hull_of(vertices: &[[f64; 3]]) -> Result<Self, ConfigError> {
        for (k, vertex) in vertices.iter().enumerate() {
            for (axis, &value) in vertex.iter().enumerate() {
                coordinate(&format!("vertices[{k}][{axis}]"), value)?;
            }
        }
        let count = vertices.len();
        let expected = format!("4 to {MOST_VERTICES} points that do not lie in one plane");
        require((4..=MOST_VERTICES).contains(&count), "vertices", format!("{count} points"), &expected)?;
        let points: Vec<_> = vertices.iter().map(|&vertex| Vector3::from(vertex)).collect();
        let faces = hull_faces(&points);
        require(faces.len() >= 4, "vertices", "points in one plane", &expected)?;
        Ok(Self::with_faces(&points, &faces))
    }

    /// Of faces that are given by their normals and their corners, anticlockwise seen from outside.
    fn with_faces(points: &[Vector3<f64>], faces: &[(Vector3<f64>, Vec<usize>)]) -> Self {
        let along = |[from, to]: [usize; 2]| (points[to] - points[from]).normalize();
        let mut sides_of: Vec<([usize; 2], Vec<Vector3<f64>>)> = Vec::new();
        for (normal, corners) in faces {
            for (k, &from) in corners.iter().enumerate() {
                let to = corners[(k + 1) % corners.len()];
                let edge = [from.min(to), from.max(to)];
                let into = normal.cross(&along([from, to]));
                match sides_of.iter_mut().find(|(known, _)| *known == edge) {
                    Some((_, sides)) => sides.push(into),
                    None => sides_of.push((edge, vec![into])),
                }
            }
        }
        let ends: Vec<_> = sides_of.iter().map(|(edge, _)| *edge).collect();
        let mut used: Vec<usize> = ends.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let edges_at = |corner: usize| {
            let directed = ends.iter().filter(move |edge| edge.contains(&corner));
            directed.map(move |&[a, b]| if a == corner { along([a, b]) } else { along([b, a]) }).collect()
        };
        let index = |corner: &usize| used.binary_search(corner).expect("a corner of the hull");
        let face = |(normal, corners): &(Vector3<f64>, Vec<usize>)| {
            let next = corners.iter().cycle().skip(1);
            let side = |(&from, &to): (&usize, &usize)| (points[from], normal.cross(&along([from, to])));
            PolyhedronFace { normal: *normal, sides: corners.iter().zip(next).map(side).collect() }
        };
        Self {
            faces: faces.iter().map(face).collect(),
            edges: ends.iter().map(|edge| [index(&edge[0]), index(&edge[1])]).collect(),
            into: sides_of.iter().map(|(_, sides)| [sides[0], sides[sides.len() - 1]]).collect(),
            corners: used.iter().map(|&corner| (points[corner], edges_at(corner))).collect(),
            low: used.iter().fold(Vector3::repeat(f64::INFINITY), |low, &corner| low.inf(&points[corner])),
            high: used.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |high, &corner| high.sup(&points[corner])),
        }
    }

    /// Outward unit normals of the faces, and a point of each.
    pub(super) fn planes(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        self.faces.iter().map(|face| (face.normal, face.sides[0].0))
    }

    pub fn rectangle(&self) -> Rectangle {
        let [low, high] = [self.low, self.high].map(|point| Vector2::new(point.x, point.y));
        Rectangle { low, high }
    }
}

impl Surface for Polyhedron {
    fn visit_parts(&self, line: &SolidLine, reach: f64, mut visit: impl FnMut(usize, Part)) {
        let room = line.half.abs().add_scalar(reach);
        let is_near = (0..3).all(|axis| {
            line.middle[axis] - room[axis] <= self.high[axis] && line.middle[axis] + room[axis] >= self.low[axis]
        });
        if is_near {
            let parts = self.faces.len() + self.edges.len() + self.corners.len();
            (0..parts).for_each(|number| visit(number, self.part(number)));
        }
    }

    fn part(&self, number: usize) -> Part {
        if let Some(PolyhedronFace { normal, sides }) = self.faces.get(number) {
            return Part::Face { normal: *normal, point: sides[0].0 };
        }
        let number = number - self.faces.len();
        match self.edges.get(number) {
            Some(ends) => Part::Edge(ends.map(|corner| self.corners[corner].0)),
            None => Part::Corner(self.corners[number - self.edges.len()].0),
        }
    }

    fn holds(&self, face: usize, foot: &Vector3<f64>) -> bool {
        self.faces[face].sides.iter().all(|(on, into)| (foot - on).dot(into) >= -ROUNDING)
    }

    fn visit_directions(&self, number: usize, visit: impl FnMut(&Vector3<f64>)) {
        let number = number - self.faces.len();
        match self.into.get(number) {
            Some(into) => into.iter().for_each(visit),
            None => self.corners[number - self.edges.len()].1.iter().for_each(visit),
        }
    }

    fn exit(&self, point: &Vector3<f64>) -> Option<usize> {
        let (mut least_deep, mut exit) = (f64::NEG_INFINITY, None);
        for (number, face) in self.faces.iter().enumerate() {
            let distance = (point - face.sides[0].0).dot(&face.normal);
            if distance >= 0.0 {
                return None;
            }
            if distance > least_deep {
                (least_deep, exit) = (distance, Some(number));
            }
        }
        exit
    }
}

/// Outward normals and corners of the faces of the convex hull, found as the planes through three points that have all
/// others on one side.
fn hull_faces(points: &[Vector3<f64>]) -> Vec<(Vector3<f64>, Vec<usize>)> {
    let mut faces: Vec<(Vector3<f64>, Vec<usize>)> = Vec::new();
    let size = points.iter().fold(0.0, |size: f64, point| size.max((point - points[0]).norm()));
    let flat = FLAT * size;
    for a in 0..points.len() {
        for b in a + 1..points.len() {
            for c in b + 1..points.len() {
                let across = (points[b] - points[a]).cross(&(points[c] - points[a]));
                let Some(plane) = across.try_normalize(flat * size) else { continue };
                for normal in [plane, -plane] {
                    let height = |k: usize| (points[k] - points[a]).dot(&normal);
                    let is_known = faces
                        .iter()
                        .any(|(known, on)| known.dot(&normal) > 0.5 && [a, b, c].iter().all(|k| on.contains(k)));
                    if is_known || (0..points.len()).any(|k| height(k) > flat) {
                        continue;
                    }
                    let on = (0..points.len()).filter(|&k| height(k) >= -flat).collect();
                    faces.push((normal, on));
                }
            }
        }
    }
    faces.iter_mut().for_each(|(normal, on)| *on = outline_of(points, normal, on));
    faces
}

/// The corners of the convex hull of points in a plane, anticlockwise seen against its normal.
fn outline_of(points: &[Vector3<f64>], normal: &Vector3<f64>, on: &[usize]) -> Vec<usize> {
    let lowest = |&one: &usize, &other: &usize| {
        let keys = [one, other].map(|k| (points[k].x, points[k].y, points[k].z));
        keys[0].partial_cmp(&keys[1]).expect("finite coordinates")
    };
    let first = on.iter().copied().min_by(|one, other| lowest(one, other)).expect("three points");
    let mut outline = vec![first];
    loop {
        let from = outline[outline.len() - 1];
        // The next corner has all points on its left; of several in line the farthest.
        let next = on.iter().copied().filter(|&k| k != from).reduce(|best, k| {
            let (to_best, to_k) = (points[best] - points[from], points[k] - points[from]);
            let turn = normal.dot(&to_best.cross(&to_k));
            let is_straight = turn.abs() <= FLAT * to_best.norm() * to_k.norm();
            let is_better = if is_straight { to_k.norm() > to_best.norm() } else { turn < 0.0 };
            if is_better { k } else { best }
        });
        match next {
            Some(next) if next != first && outline.len() < on.len() => outline.push(next),
            _ => return outline,
        }
    }
}

/// Points of a body: its hull is found by trying all triples.
const MOST_VERTICES: usize = 64;

/// Round-off of a length, relative to the size of the body.
const FLAT: f64 = 1e-9;

const ROUNDING: f64 = 1e-10;
