//! Outlines of convex polygons as maps have them: closed, with repeated corners, and with corners on straight edges.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use crate::error::{ConfigError, require};

/// The vertices that are corners, with their indices in the list: not those that repeat their neighbour, or lie on the line
/// between their neighbours, on either side of it, within round-off.
pub fn corners(vertices: &[[f64; 2]]) -> Vec<(usize, Vector2<f64>)> {
    let mut kept: Vec<_> = vertices.iter().copied().map(Vector2::from).enumerate().collect();
    let round_off = round_off(&kept);
    let same = |a: &(usize, Vector2<f64>), b: &(usize, Vector2<f64>)| (a.1 - b.1).norm() <= round_off;
    kept.dedup_by(|later, one| same(later, one));
    while kept.len() > 1 && same(&kept[0], &kept[kept.len() - 1]) {
        kept.pop();
    }
    loop {
        let mut corners: Vec<(usize, Vector2<f64>)> = Vec::with_capacity(kept.len());
        for (i, vertex) in kept.iter().enumerate() {
            let before = corners.last().unwrap_or(&kept[kept.len() - 1]).1;
            let after = kept.get(i + 1).or(corners.first()).unwrap_or(vertex).1;
            if is_corner(&before, &vertex.1, &after, round_off) {
                corners.push(*vertex);
            }
        }
        if corners.len() == kept.len() {
            return kept;
        }
        kept = corners;
    }
}

/// # Errors
/// Names the first corner at which the outline turns against its sense, or says that it encloses no area or goes round
/// more than once.
pub fn validate(vertices: &[[f64; 2]]) -> Result<(), ConfigError> {
    let (indices, corners): (Vec<_>, Vec<_>) = corners(vertices).into_iter().unzip();
    let summary = || format!("{} corners, of {} vertices", corners.len(), vertices.len());
    require(corners.len() >= 3, "vertices", summary(), "three or more corners that enclose an area")?;
    let turning = turning(&corners);
    for (i, index) in indices.into_iter().enumerate() {
        let expected = "a corner of a convex outline: this one is a dent, or out of order";
        let value = format!("{:?}", vertices[index]);
        require(turn_at(&corners, i) * turning > 0.0, &format!("vertices[{index}]"), value, expected)?;
    }
    require(turning.abs() < 1.5 * TAU, "vertices", summary(), "an outline that goes round once")
}

/// Angle by which an outline turns from its first corner back to it, to the left positive \[rad\].
pub fn turning(corners: &[Vector2<f64>]) -> f64 {
    (0..corners.len()).map(|i| turn_at(corners, i)).sum()
}

fn turn_at(corners: &[Vector2<f64>], i: usize) -> f64 {
    let count = corners.len();
    let (before, at, after) = (corners[(i + count - 1) % count], corners[i], corners[(i + 1) % count]);
    let (arriving, leaving) = (at - before, after - at);
    arriving.perp(&leaving).atan2(arriving.dot(&leaving))
}

fn is_corner(before: &Vector2<f64>, at: &Vector2<f64>, after: &Vector2<f64>, round_off: f64) -> bool {
    let (arriving, leaving, chord) = (at - before, after - at, after - before);
    // Where the outline turns back on itself it does not go straight on.
    arriving.dot(&leaving) <= 0.0 || arriving.perp(&chord).abs() > round_off * chord.norm()
}

/// Deviation of a vertex that says nothing about the shape \[m\].
fn round_off(vertices: &[(usize, Vector2<f64>)]) -> f64 {
    let Some((_, first)) = vertices.first() else { return 0.0 };
    let extent = vertices.iter().map(|(_, vertex)| (vertex - first).amax()).fold(0.0, f64::max);
    let farthest = vertices.iter().map(|(_, vertex)| vertex.amax()).fold(0.0, f64::max);
    RELATIVE_TO_EXTENT * extent + RELATIVE_TO_COORDINATES * farthest
}

/// A billionth of the polygon, and some units in the last place of its coordinates.
const RELATIVE_TO_EXTENT: f64 = 1e-9;
const RELATIVE_TO_COORDINATES: f64 = 4.0 * f64::EPSILON;
