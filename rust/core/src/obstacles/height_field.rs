//! Uneven ground: heights on a grid, joined by triangles.
//!
//! Each cell of the grid has two triangles, which meet in the diagonal from its first corner. The body fills everything
//! below them. At the border of the field, which may be higher than the ground around it, it ends in vertical faces.

mod active_parts;

use std::cmp::Ordering;
use std::ops::RangeInclusive;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, FARTHEST, coordinate, length, non_negative, require};

use super::solid::SolidLine;
use super::surface::{Part, Surface};
use super::{Heights, Rectangle};

/// A field of heights over a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    /// Rows along x, of heights along y \[m\].
    heights: Vec<f64>,
    /// Points along x and y.
    size: [usize; 2],
    spacing: f64,
    origin: [f64; 2],
    friction: GroundFriction,
    /// Which of its parts each point of the grid has that can touch anything, a bit each.
    parts: Vec<u16>,
    /// Whether there are any.
    has_parts: bool,
    highest: f64,
}

/// Friction of the faces of a field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum GroundFriction {
    /// That of the ground.
    OfGround,
    /// The Coulomb coefficient of all faces, or of each cell.
    Coefficient(f64),
    Cells(Vec<Vec<f64>>),
}

/// A part of the surface: its point of the grid, and which one it is there.
#[derive(Clone, Copy)]
struct PartIndex {
    i: usize,
    j: usize,
    kind: usize,
}

impl HeightField {
    /// # Errors
    /// Names the field that is not admissible.
    pub fn new(written: &Heights) -> Result<Self, ConfigError> {
        let Heights { height, spacing, origin, friction } = written;
        let size = [height.len(), height.first().map_or(0, Vec::len)];
        let is_grid = |rows: &[Vec<f64>], [columns, width]: [usize; 2]| {
            rows.len() == columns && rows.iter().all(|row| row.len() == width)
        };
        let expected = "two or more rows along x, each of the same two or more heights along y";
        let is_field = size.iter().all(|&points| points >= 2) && is_grid(height, size);
        require(is_field, "height", format!("{} rows", size[0]), expected)?;
        length("spacing", *spacing)?;
        coordinate("origin[0]", origin[0])?;
        coordinate("origin[1]", origin[1])?;
        for (i, row) in height.iter().enumerate() {
            if let Some(j) = row.iter().position(|height| height.abs().partial_cmp(&FARTHEST) != Some(Ordering::Less)) {
                coordinate(&format!("height[{i}][{j}]"), row[j])?;
            }
        }
        match friction {
            GroundFriction::OfGround => {}
            GroundFriction::Coefficient(coefficient) => {
                non_negative("friction", *coefficient)?;
            }
            GroundFriction::Cells(cells) => {
                let of_cells = size.map(|points| points - 1);
                let expected = format!("a number, or an array of shape {of_cells:?}, one for each cell");
                require(is_grid(cells, of_cells), "friction", format!("{} rows", cells.len()), &expected)?;
                cells
                    .iter()
                    .flatten()
                    .try_for_each(|&coefficient| non_negative("friction", coefficient).map(|_| ()))?;
            }
        }
        let heights = height.concat();
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (spacing, origin, friction) = (*spacing, *origin, friction.clone());
        let mut field = Self { heights, size, spacing, origin, friction, parts: Vec::new(), has_parts: true, highest };
        field.parts = field.grid_points().map(|index| field.active_parts(index)).collect();
        field.has_parts = field.parts.iter().any(|&parts| parts != 0);
        Ok(field)
    }

    /// Cells along x and y.
    fn cells(&self) -> [usize; 2] {
        self.size.map(|points| points - 1)
    }

    /// Around the field, seen from above; around nothing where it is the plane of the ground.
    pub fn rectangle(&self) -> Rectangle {
        if !self.has_parts && self.heights.iter().all(|&height| height == 0.0) {
            return Rectangle::default();
        }
        let low = Vector2::from(self.origin);
        Rectangle { low, high: low + Vector2::from(self.cells().map(|cells| cells as f64 * self.spacing)) }
    }

    /// Coulomb coefficient of a part; none where it has the friction of the ground.
    pub fn coefficient(&self, part: usize) -> Option<f64> {
        match &self.friction {
            GroundFriction::OfGround => None,
            GroundFriction::Coefficient(coefficient) => Some(*coefficient),
            GroundFriction::Cells(cells) => {
                let PartIndex { i, j, .. } = self.part_index(part);
                let [columns, rows] = self.cells();
                Some(cells[i.min(columns - 1)][j.min(rows - 1)])
            }
        }
    }

    /// Height of the surface at a point seen from above; none beside the field \[m\].
    pub fn height_at(&self, point: &Vector2<f64>) -> Option<f64> {
        self.height_of_triangle_at(point, point)
    }

    /// The same of the plane of the triangle below another point.
    pub(super) fn height_of_triangle_at(&self, within: &Vector2<f64>, point: &Vector2<f64>) -> Option<f64> {
        Some(self.height_over(self.below(within)?, point))
    }

    pub(super) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// A point in cells from the first height.
    pub(super) fn local(&self, point: &Vector2<f64>) -> Vector2<f64> {
        (point - Vector2::from(self.origin)) / self.spacing
    }

    /// Height of the plane of a triangle.
    fn height_over(&self, index: PartIndex, point: &Vector2<f64>) -> f64 {
        let ([along_x, along_y], from) = (self.slopes(index), self.point(index.i, index.j));
        from.z + along_x * (point.x - from.x) + along_y * (point.y - from.y)
    }

    /// Height of the ground under an end sphere at `point` where the ground's own law holds, infinitely low where faces
    /// of the field carry it otherwise; none beside the field \[m\].
    pub fn ground_below(&self, point: &Vector2<f64>) -> Option<f64> {
        let index = self.below(point)?;
        let is_level = !self.has_part(index);
        Some(if is_level { self.heights[index.i * self.size[1] + index.j] } else { f64::NEG_INFINITY })
    }

    /// Whether there is a part and it can touch anything. A triangle that cannot is level ground.
    fn has_part(&self, PartIndex { i, j, kind }: PartIndex) -> bool {
        self.parts[i * self.size[1] + j] & (1 << kind) != 0
    }

    fn point(&self, i: usize, j: usize) -> Vector3<f64> {
        let [x, y] = [i, j].map(|index| index as f64 * self.spacing);
        Vector3::new(self.origin[0] + x, self.origin[1] + y, self.heights[i * self.size[1] + j])
    }

    /// The triangle below a point.
    fn below(&self, point: &Vector2<f64>) -> Option<PartIndex> {
        let local = self.local(point);
        let cells = self.cells();
        let is_over = (0..2).all(|axis| local[axis] >= 0.0 && local[axis] <= cells[axis] as f64);
        is_over.then(|| {
            let [i, j] = [0, 1].map(|axis| (local[axis] as usize).min(cells[axis] - 1));
            let kind = if local.y - j as f64 <= local.x - i as f64 { FACES[0] } else { FACES[1] };
            PartIndex { i, j, kind }
        })
    }

    /// The points of the grid, as their lists are sorted.
    fn grid_points(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.size;
        (0..columns).flat_map(move |i| (0..rows).map(move |j| [i, j]))
    }

    fn number(&self, PartIndex { i, j, kind }: PartIndex) -> usize {
        (i * self.size[1] + j) * KINDS + kind
    }

    fn part_index(&self, number: usize) -> PartIndex {
        let (point, kind) = (number / KINDS, number % KINDS);
        PartIndex { i: point / self.size[1], j: point % self.size[1], kind }
    }

    /// Upward unit normal of a triangle.
    fn normal(&self, index: PartIndex) -> Vector3<f64> {
        let [along_x, along_y] = self.slopes(index);
        Vector3::new(-along_x, -along_y, 1.0) / (1.0 + along_x * along_x + along_y * along_y).sqrt()
    }

    /// Rise of a triangle along x and y.
    fn slopes(&self, PartIndex { i, j, kind }: PartIndex) -> [f64; 2] {
        let first = i * self.size[1] + j;
        let height = |right: usize, up: usize| self.heights[first + right * self.size[1] + up];
        let (near, far) = (height(0, 0), height(1, 1));
        let rise = if kind == FACES[0] {
            let corner = height(1, 0);
            [corner - near, far - corner]
        } else {
            let corner = height(0, 1);
            [far - corner, corner - near]
        };
        rise.map(|rise| rise / self.spacing)
    }

    /// The triangles on the left and on the right of an edge; none beside the field.
    fn beside_edge(&self, PartIndex { i, j, kind }: PartIndex) -> [Option<PartIndex>; 2] {
        let [columns, rows] = self.cells();
        let triangle = |i: Option<usize>, j: Option<usize>, kind: usize| {
            let (i, j) = (i.filter(|&i| i < columns)?, j.filter(|&j| j < rows)?);
            Some(PartIndex { i, j, kind })
        };
        let (here, before) = ((Some(i), Some(j)), (i.checked_sub(1), j.checked_sub(1)));
        match kind {
            ALONG_X => [triangle(here.0, here.1, FACES[0]), triangle(here.0, before.1, FACES[1])],
            ALONG_Y => [triangle(before.0, here.1, FACES[0]), triangle(here.0, here.1, FACES[1])],
            _ => [triangle(here.0, here.1, FACES[1]), triangle(here.0, here.1, FACES[0])],
        }
    }

    /// Ends of an edge.
    fn ends(&self, PartIndex { i, j, kind }: PartIndex) -> [Vector3<f64>; 2] {
        let to = match kind {
            ALONG_X => (i + 1, j),
            ALONG_Y => (i, j + 1),
            _ => (i + 1, j + 1),
        };
        [self.point(i, j), self.point(to.0, to.1)]
    }

    /// Outward normal of the vertical face below an edge of the border.
    fn wall_normal(&self, PartIndex { i, j, kind }: PartIndex) -> Vector3<f64> {
        let (axis, is_first) = if kind == WALL_X { (Vector3::y(), j == 0) } else { (Vector3::x(), i == 0) };
        if is_first { -axis } else { axis }
    }

    /// The points of the grid along x and y whose parts may lie within `reach` of a line, seen from above.
    fn points_near(&self, line: &SolidLine, reach: f64) -> [RangeInclusive<usize>; 2] {
        [0, 1].map(|axis| {
            let (middle, half) = (line.middle[axis] - self.origin[axis], line.half[axis].abs() + reach);
            let index = |value: f64| (value / self.spacing).clamp(0.0, (self.size[axis] - 1) as f64) as usize;
            index(middle - half)..=index(middle + half)
        })
    }

    /// Whether the parts that belong to a point of the grid may lie within `reach` of a line, by a sphere around its cell.
    fn is_cell_near(&self, line: &SolidLine, reach: f64, [i, j]: [usize; 2]) -> bool {
        let [x, y] = [(i, 0), (j, 1)].map(|(index, axis)| self.origin[axis] + (index as f64 + 0.5) * self.spacing);
        let (last_i, last_j) = ((i + 1).min(self.size[0] - 1), (j + 1).min(self.size[1] - 1));
        let height = |i: usize, j: usize| self.heights[i * self.size[1] + j];
        let heights = [height(i, j), height(last_i, j), height(i, last_j), height(last_i, last_j)];
        let low = heights.into_iter().fold(f64::INFINITY, f64::min);
        let high = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let (rise, side) = (high - low, self.spacing);
        let from_middle = Vector3::new(x, y, 0.5 * (low + high)) - line.middle;
        let squared = line.half.norm_squared().max(f64::MIN_POSITIVE);
        let along = (from_middle.dot(&line.half) / squared).clamp(-1.0, 1.0);
        let room = reach + 0.5 * (2.0 * side * side + rise * rise).sqrt();
        (from_middle - line.half * along).norm_squared() <= room * room
    }
}

impl Surface for HeightField {
    fn visit_parts(&self, line: &SolidLine, reach: f64, mut visit: impl FnMut(usize, Part)) {
        let [along_x, along_y] = self.points_near(line, reach);
        for i in along_x {
            for j in along_y.clone() {
                let parts = self.parts[i * self.size[1] + j];
                if parts == 0 || (parts < 1 << WALL_X && !self.is_cell_near(line, reach, [i, j])) {
                    continue;
                }
                for kind in (0..KINDS).filter(|kind| parts & (1 << kind) != 0) {
                    let number = self.number(PartIndex { i, j, kind });
                    visit(number, self.part(number));
                }
            }
        }
    }

    fn part(&self, number: usize) -> Part {
        let index = self.part_index(number);
        let PartIndex { i, j, kind } = index;
        let point = self.point(i, j);
        match kind {
            ALONG_X | ALONG_Y | DIAGONAL => Part::Edge(self.ends(index)),
            CORNER => Part::Corner(point),
            PILLAR => Part::Edge([point, point - Vector3::z() * DEPTH]),
            WALL_X | WALL_Y => Part::Face { normal: self.wall_normal(index), point },
            _ => Part::Face { normal: self.normal(index), point },
        }
    }

    fn holds(&self, face: usize, foot: &Vector3<f64>) -> bool {
        let PartIndex { i, j, kind } = self.part_index(face);
        let x = (foot.x - self.origin[0]) / self.spacing - i as f64;
        let y = (foot.y - self.origin[1]) / self.spacing - j as f64;
        let is_between = |low: f64, value: f64, high: f64| low - ROUNDING <= value && value <= high + ROUNDING;
        let below_edge = |share: f64, to: Vector3<f64>| {
            let from = self.point(i, j);
            is_between(0.0, share, 1.0) && foot.z <= from.z + share * (to.z - from.z)
        };
        match kind {
            WALL_X => below_edge(x, self.point(i + 1, j)),
            WALL_Y => below_edge(y, self.point(i, j + 1)),
            _ if kind == FACES[0] => is_between(0.0, y, x) && is_between(y, x, 1.0),
            _ => is_between(0.0, x, y) && is_between(x, y, 1.0),
        }
    }

    fn visit_directions(&self, number: usize, visit: impl FnMut(&Vector3<f64>)) {
        let index = self.part_index(number);
        if index.kind == CORNER {
            let (edges, count) = self.edges_at(index.i, index.j);
            edges[..count].iter().for_each(visit);
        } else if index.kind == PILLAR {
            let inward = |index: usize, axis: Vector3<f64>| if index == 0 { axis } else { -axis };
            [inward(index.i, Vector3::x()), inward(index.j, Vector3::y())].iter().for_each(visit);
        } else {
            self.face_directions(index).0.iter().for_each(visit);
        }
    }

    fn is_near(&self, line: &SolidLine, reach: f64) -> bool {
        let is_above = line.middle.z - line.half.z.abs() - reach > self.highest;
        if is_above || !self.has_parts {
            return false;
        }
        let [along_x, along_y] = self.points_near(line, reach);
        let mut rows = along_x.map(|i| i * self.size[1]);
        rows.any(|row| self.parts[row + along_y.start()..=row + along_y.end()].iter().any(|&parts| parts != 0))
    }

    fn touches(&self, face: usize) -> bool {
        self.has_part(self.part_index(face))
    }

    fn exit(&self, point: &Vector3<f64>) -> Option<usize> {
        if point.z >= self.highest {
            return None;
        }
        let index = self.below(&point.xy())?;
        (point.z < self.height_over(index, &point.xy())).then(|| self.number(index))
    }
}

/// The parts of a point of the grid: two faces of the cell that it begins, its edges, itself, and vertical faces and edges
/// of the border.
const KINDS: usize = 9;
const FACES: [usize; 2] = [0, 1];
const ALONG_X: usize = 2;
const ALONG_Y: usize = 3;
const DIAGONAL: usize = 4;
const CORNER: usize = 5;
const WALL_X: usize = 6;
const WALL_Y: usize = 7;
const PILLAR: usize = 8;

/// How far the vertical edges at the corners of a field go down \[m\].
const DEPTH: f64 = 1e3;

/// Round-off of a place, as a share of a cell.
const ROUNDING: f64 = 1e-10;
