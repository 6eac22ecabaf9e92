//! Patches of the ground where its friction differs.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::config::validate_outline;
use super::{CentreLine, Shape, WallGrid};
use crate::error::{ConfigError, non_negative};

/// A convex polygon of the ground; its vertices in either order \[m\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    pub vertices: Vec<[f64; 2]>,
    /// By which the sliding coefficients of the ground are multiplied there.
    pub factor: f64,
}

impl Patch {
    /// # Errors
    /// Names the field that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        validate_outline(&self.vertices)?;
        non_negative("factor", self.factor).map(drop)
    }
}

/// The patches of a scene; where some overlap, the last one counts.
#[derive(Debug, Clone, Default)]
pub struct Patches {
    grid: WallGrid,
    factors: Vec<f64>,
}

impl Patches {
    /// Of valid patches.
    pub fn new(patches: &[Patch]) -> Self {
        let polygons = patches.iter().filter_map(|Patch { vertices, .. }| {
            let vertices = vertices.clone();
            Shape::Polygon { vertices }.polygon()
        });
        Self { grid: WallGrid::new(polygons), factors: patches.iter().map(|patch| patch.factor).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.factors.is_empty()
    }

    /// The factor at a point.
    pub fn factor_at(&self, point: &Vector2<f64>) -> f64 {
        let is_on = |&patch: &usize| self.grid.walls()[patch].polygon.signed_distance(point).0 <= 0.0;
        self.grid.near(*point, 0.0).filter(is_on).max().map_or(1.0, |patch| self.factors[patch])
    }

    /// The share of a straight way after which it leaves the ground with this factor, by more than a `tolerance` \[m\];
    /// none where it does not.
    pub fn first_change(&self, [from, to]: [&Vector2<f64>; 2], factor: f64, tolerance: f64) -> Option<f64> {
        let line = CentreLine { middle: (from + to) * 0.5, half: (to - from) * 0.5 };
        let reach = line.half.norm();
        let mut at = -1.0;
        loop {
            // The next border of any patch.
            let mut next = 1.0_f64;
            self.grid.near(line.middle, reach).for_each(|patch| {
                let borders = self.grid.walls()[patch].polygon.within(&line);
                borders.iter().filter(|&&border| border > at).for_each(|&border| next = next.min(border));
            });
            if [0.5 * (at + next), next].iter().any(|&place| self.is_off(&line.point(place), factor, tolerance)) {
                return Some(0.5 * (at + 1.0));
            }
            if next >= 1.0 {
                return None;
            }
            at = next;
        }
    }

    /// Whether no ground with this factor is near a point.
    fn is_off(&self, point: &Vector2<f64>, factor: f64, tolerance: f64) -> bool {
        let beside = [[0.0, 0.0], [tolerance, 0.0], [-tolerance, 0.0], [0.0, tolerance], [0.0, -tolerance]];
        beside.iter().all(|&offset| self.factor_at(&(point + Vector2::from(offset))) != factor)
    }
}
