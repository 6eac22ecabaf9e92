//! The reward: a sum of named terms times weights.
//!
//! | term | value | unit |
//! | --- | --- | --- |
//! | progress | displacement of the whole robot's CG along the goal direction | m |
//! | energy | minus the positive work of the actuators | J |
//! | smoothness | minus the mean squared change of the action | 1 |
//! | success | one in the step that reaches the goal | 1 |
//!
//! Progress counts the CG of all links, never one link: a robot that stretches gains nothing by it.

use serde::{Deserialize, Serialize};

use super::config::RewardWeights;

/// What the terms are computed from: one control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Displacement of the CG along the goal direction \[m\].
    pub progress: f64,
    /// Positive actuator work \[J\].
    pub positive_work: f64,
    /// Mean squared change of the action.
    pub action_change: f64,
    /// The goal was reached in this period.
    pub success: bool,
}

/// Weighted terms of one step's reward.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RewardTerms {
    pub progress: f64,
    pub energy: f64,
    pub smoothness: f64,
    pub success: f64,
}

impl RewardTerms {
    pub fn new(weights: &RewardWeights, transition: &Transition) -> Self {
        Self {
            progress: weights.progress * transition.progress,
            energy: -weights.energy * transition.positive_work,
            smoothness: -weights.smoothness * transition.action_change,
            success: if transition.success { weights.success } else { 0.0 },
        }
    }

    /// The reward.
    pub fn total(&self) -> f64 {
        self.progress + self.energy + self.smoothness + self.success
    }
}
