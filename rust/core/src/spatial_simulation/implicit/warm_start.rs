//! What one interval hands to the next beside the state.

use serde::{Deserialize, Serialize};

use super::SpatialImplicit;
use super::pegs::Pair;

/// Forces of the last stage, and how long ago the robot was placed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpatialWarmStart {
    /// \[s\]
    elapsed: f64,
    /// Normal forces at both ends of each link \[N\].
    normal_force: Vec<[f64; 2]>,
    pairs: Vec<Pair>,
}

impl SpatialWarmStart {
    /// Nothing to start from.
    pub fn cold(links: usize) -> Self {
        Self { elapsed: 0.0, normal_force: vec![[0.0; 2]; links], pairs: Vec::new() }
    }

    /// Whether this is of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        let pairs_fit = self.pairs.iter().all(|pair| pair.link < links && pair.peg < pegs);
        self.normal_force.len() == links && pairs_fit
    }
}

impl SpatialImplicit {
    pub fn warm_start(&self) -> SpatialWarmStart {
        let (normal_force, pairs) = self.stepping.forces();
        SpatialWarmStart { elapsed: self.elapsed, normal_force: normal_force.to_vec(), pairs: pairs.to_vec() }
    }

    /// Takes over what another robot of the same kind left.
    pub fn resume(&mut self, from: &SpatialWarmStart) {
        self.elapsed = from.elapsed;
        self.stepping.recall(&from.normal_force, &from.pairs);
    }
}
