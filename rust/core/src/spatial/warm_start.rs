//! What one interval hands to the next beside the state.

use serde::{Deserialize, Serialize};

use super::motion::{GroundForces, Motion};
use super::peg_contacts::Pair;

/// Forces of the last stage, and how long ago the robot was placed and its reference jumped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpatialWarmStart {
    /// \[s\]
    elapsed: f64,
    calm: f64,
    /// Whether the last step began at rest.
    settled: bool,
    forces: GroundForces,
    pairs: Vec<Pair>,
}

impl SpatialWarmStart {
    /// Nothing to start from.
    pub fn cold(links: usize) -> Self {
        Self { elapsed: 0.0, calm: 0.0, settled: false, forces: GroundForces::none(links), pairs: Vec::new() }
    }

    /// Whether this is of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        let pairs_fit = self.pairs.iter().all(|pair| pair.link < links && pair.peg < pegs);
        self.forces.fits(links) && pairs_fit
    }
}

impl Motion {
    pub fn warm_start(&self) -> SpatialWarmStart {
        let Self { elapsed, calm, settled, forces, pairs, .. } = self;
        SpatialWarmStart {
            elapsed: *elapsed,
            calm: *calm,
            settled: *settled,
            forces: forces.clone(),
            pairs: pairs.clone(),
        }
    }

    /// Takes over what another robot of the same kind left.
    pub fn resume(&mut self, from: &SpatialWarmStart) {
        (self.elapsed, self.calm, self.settled) = (from.elapsed, from.calm, from.settled);
        self.forces.copy_from(&from.forces);
        self.pairs.clear();
        self.pairs.extend_from_slice(&from.pairs);
    }
}
