//! Saving and continuing a run.

use serde::{Deserialize, Serialize};

use crate::spatial::SpatialState;

use super::simulation::Scheme;
use super::{SpatialSimulation, SpatialWarmStart};

/// All that a run changes: enough to continue it elsewhere bit for bit with the method `implicit`; `thesis` starts its
/// iteration from zero impulses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpatialSnapshot {
    state: SpatialState,
    warm_start: SpatialWarmStart,
}

impl SpatialSnapshot {
    /// Whether this can be a state of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        let Self { state, warm_start } = self;
        state.pose.len() == links && state.twist.len() == links && warm_start.fits(links, pegs)
    }
}

impl SpatialSimulation {
    /// The changing part of a simulation.
    pub fn snapshot(&self) -> SpatialSnapshot {
        let warm_start = match &self.scheme {
            Scheme::Thesis(_) => SpatialWarmStart::cold(self.robot().link_count()),
            Scheme::Implicit(_) => self.body.motion.warm_start(),
        };
        SpatialSnapshot { state: self.body.state.clone(), warm_start }
    }

    /// Continues from a snapshot of a simulation of the same configuration among the same pegs.
    pub fn restore(&mut self, snapshot: &SpatialSnapshot) {
        self.place(&snapshot.state);
        self.body.motion.resume(&snapshot.warm_start);
    }
}
