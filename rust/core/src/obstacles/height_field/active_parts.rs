//! Which parts of a height field can touch anything.

use nalgebra::Vector3;

use super::{
    ALONG_X, ALONG_Y, CORNER, DIAGONAL, FACES, GroundFriction, HeightField, KINDS, PILLAR, PartIndex, WALL_X, WALL_Y,
};

impl HeightField {
    /// Which parts of a point of the grid there are and can touch anything.
    pub(super) fn active_parts(&self, [i, j]: [usize; 2]) -> u16 {
        if !self.is_level_around(i, j) {
            return self.examined_parts([i, j]);
        }
        // Flat edges and corners touch nothing.
        if self.friction == GroundFriction::OfGround { 0 } else { 1 << FACES[0] | 1 << FACES[1] }
    }

    /// The same by the directions of edges and faces.
    fn examined_parts(&self, [i, j]: [usize; 2]) -> u16 {
        let [columns, rows] = self.cells();
        let (has_x, has_y) = (i < columns, j < rows);
        let exists = |kind: usize| match kind {
            ALONG_X => has_x,
            ALONG_Y => has_y,
            CORNER => true,
            WALL_X => has_x && (j == 0 || j == rows),
            WALL_Y => has_y && (i == 0 || i == columns),
            PILLAR => (i == 0 || i == columns) && (j == 0 || j == rows),
            _ => has_x && has_y,
        };
        let is_active = |kind: usize| {
            let index = PartIndex { i, j, kind };
            match kind {
                _ if !exists(kind) || self.is_flush(index) => false,
                ALONG_X | ALONG_Y | DIAGONAL => self.face_directions(index).1,
                CORNER => {
                    let (edges, count) = self.edges_at(i, j);
                    can_be_nearest(&edges[..count])
                }
                WALL_X | WALL_Y | PILLAR => true,
                // The ground's own law acts on level ground.
                _ => self.friction != GroundFriction::OfGround || self.slopes(index) != [0.0; 2],
            }
        };
        (0..KINDS).filter(|&kind| is_active(kind)).fold(0, |bits, kind| bits | 1 << kind)
    }

    /// Whether a point inside the field and its eight neighbours have one height.
    fn is_level_around(&self, i: usize, j: usize) -> bool {
        let height = self.heights[i * self.size[1] + j];
        let is_level = |i: usize| {
            let middle = i * self.size[1] + j;
            self.heights[middle - 1..=middle + 1].iter().all(|&other| other == height)
        };
        !self.is_border(i, j) && (i - 1..=i + 1).all(is_level)
    }

    /// Whether a part is at the border of the field, and not above the plane of the ground beside it.
    fn is_flush(&self, index: PartIndex) -> bool {
        let PartIndex { i, j, kind } = index;
        match kind {
            CORNER | PILLAR => self.is_border(i, j) && self.point(i, j).z <= 0.0,
            WALL_X => self.point(i, j).z.max(self.point(i + 1, j).z) <= 0.0,
            WALL_Y => self.point(i, j).z.max(self.point(i, j + 1).z) <= 0.0,
            ALONG_X | ALONG_Y => {
                let [from, to] = self.ends(index);
                from.z.max(to.z) <= 0.0 && self.beside_edge(index).iter().any(Option::is_none)
            }
            _ => false,
        }
    }

    /// Unit vectors from an edge into its faces, and whether it is convex. Beside the field the face is a vertical one.
    pub(super) fn face_directions(&self, index: PartIndex) -> ([Vector3<f64>; 2], bool) {
        let [from, to] = self.ends(index);
        let along = (to - from).normalize();
        let left = Vector3::new(-along.y, along.x, 0.0).normalize();
        let beside = self.beside_edge(index);
        let normals = [0, 1].map(|side| {
            let outward = if side == 0 { left } else { -left };
            beside[side].map_or(outward, |triangle| self.normal(triangle))
        });
        let into = [0, 1].map(|side| {
            let across = normals[side].cross(&along);
            // Seen against an outward normal to the left, the face hangs down on the right of the edge.
            if side == 0 { across } else { -across }
        });
        (into, into[0].dot(&normals[1]) < -FLAT)
    }

    /// Unit vectors along the edges that meet at a point of the grid, away from it; the vertical ones of the border, too.
    pub(super) fn edges_at(&self, i: usize, j: usize) -> ([Vector3<f64>; 7], usize) {
        let (mut edges, mut count) = ([Vector3::zeros(); 7], 0);
        let from = self.point(i, j);
        let mut add = |direction: Vector3<f64>| {
            edges[count] = direction.normalize();
            count += 1;
        };
        for [di, dj] in [[1, 0], [1, 1], [0, 1], [-1, 0], [-1, -1], [0, -1]] {
            let to = [(i, di), (j, dj)].map(|(index, step)| index.checked_add_signed(step));
            if let [Some(i), Some(j)] = to
                && i < self.size[0]
                && j < self.size[1]
            {
                add(self.point(i, j) - from);
            }
        }
        if self.is_border(i, j) {
            add(-Vector3::z());
        }
        (edges, count)
    }

    fn is_border(&self, i: usize, j: usize) -> bool {
        let [columns, rows] = self.cells();
        i == 0 || j == 0 || i == columns || j == rows
    }
}

/// Whether points above the surface can have the corner for their nearest one in a region of more than one direction: of
/// those that lead away from all edges the outermost ones are across two of them.
fn can_be_nearest(edges: &[Vector3<f64>]) -> bool {
    let leads_away = |direction: &Vector3<f64>| edges.iter().all(|edge| edge.dot(direction) <= FLAT);
    let mut first: Option<Vector3<f64>> = None;
    for (k, one) in edges.iter().enumerate() {
        for other in &edges[k + 1..] {
            let Some(across) = one.cross(other).try_normalize(FLAT) else { continue };
            for direction in [across, -across] {
                if direction.z >= -FLAT && leads_away(&direction) {
                    match first {
                        Some(first) if (direction - first).norm() > FLAT => return true,
                        Some(_) => {}
                        None => first = Some(direction),
                    }
                }
            }
        }
    }
    false
}

/// Sine of an angle between faces that counts as none.
const FLAT: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obstacles::Heights;

    /// Terraces, with and without friction of their own.
    #[test]
    fn level_neighbourhoods_have_the_parts_that_an_examination_finds() {
        let terrace = |i: usize, j: usize| if i < 5 && j > 3 { 0.1 } else { 0.0 };
        let height: Vec<Vec<f64>> = (0..11).map(|i| (0..9).map(|j| terrace(i, j)).collect()).collect();
        for friction in [GroundFriction::OfGround, GroundFriction::Coefficient(0.4)] {
            let field = HeightField::new(&Heights { height: height.clone(), spacing: 0.2, origin: [0.0; 2], friction });
            let field = field.unwrap();
            assert!(field.grid_points().any(|[i, j]| field.is_level_around(i, j)) && field.has_parts);
            for [i, j] in field.grid_points() {
                assert_eq!(field.active_parts([i, j]), field.examined_parts([i, j]), "{i} {j}");
            }
        }
    }
}
