//! Sensors that report late: the observations of the last control instants.

use serde::{Deserialize, Serialize};

use super::ObservationLayout;
use crate::environment::robot_model::RobotModel;

/// A ring of observations, as long as the longest delay asks for; empty without any.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Delay {
    ring: Vec<f32>,
    size: usize,
}

impl Delay {
    pub fn new<M: RobotModel>(layout: &ObservationLayout<M>) -> Self {
        let longest = layout.blocks().iter().map(|block| block.delay).max().unwrap_or(0) as usize;
        let size = layout.size();
        Self { ring: vec![0.0; if longest > 0 { size * (longest + 1) } else { 0 }], size }
    }

    /// Keeps the observation of control instant `step` of an episode and replaces the blocks that are late by their
    /// older selves; before the episode nothing was different from its start.
    pub fn pass<M: RobotModel>(&mut self, layout: &ObservationLayout<M>, step: u32, observation: &mut [f32]) {
        if self.ring.is_empty() {
            return;
        }
        let length = (self.ring.len() / self.size) as u32;
        let place = |step: u32| (step % length) as usize * self.size;
        self.ring[place(step)..place(step) + self.size].copy_from_slice(observation);
        for block in layout.blocks().iter().filter(|block| block.delay > 0) {
            let from = place(step - block.delay.min(step)) + block.start;
            observation[block.start..block.start + block.size()].copy_from_slice(&self.ring[from..from + block.size()]);
        }
    }

    /// Takes over a saved state if it has the shape of this one.
    pub fn restore(&mut self, state: &Self) -> bool {
        let fits = (state.size, state.ring.len()) == (self.size, self.ring.len());
        if fits {
            self.ring.copy_from_slice(&state.ring);
        }
        fits
    }
}
