//! Everything that changes while an environment runs: saved, and restored in another one.

use serde::{Deserialize, Serialize};

use crate::environment::episode::Episode;
use crate::environment::latency::Latency;
use crate::environment::observation::Delay;
use crate::environment::randomization::EpisodeParameters;
use crate::environment::robot_model::{PlanarRobotState, RobotModel};
use crate::error::{ConfigError, require};

use super::{Environment, Source};

/// Everything that changes while an environment runs; enough to continue it bit for bit in another one of the same
/// configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnvironmentState<S = PlanarRobotState> {
    source: Source,
    difficulty: f64,
    drawn: EpisodeParameters,
    latency: Latency,
    delay: Delay,
    episode: Episode,
    model: S,
    action: Vec<f64>,
}

impl<M: RobotModel> Environment<M> {
    /// Everything that changes.
    pub fn save(&self) -> EnvironmentState<M::State> {
        EnvironmentState {
            source: self.source,
            difficulty: self.sampler.difficulty(),
            drawn: self.drawn,
            latency: self.latency.clone(),
            delay: self.delay.clone(),
            episode: self.episode.clone(),
            model: self.model.save(),
            action: self.action.clone(),
        }
    }

    /// Continues from a saved state.
    ///
    /// # Errors
    /// The state is of an environment of another configuration, as far as its size tells.
    pub fn restore(&mut self, state: &EnvironmentState<M::State>) -> Result<(), ConfigError> {
        let fits = state.action.len() == self.action.len()
            && self.latency.restore(&state.latency)
            && self.delay.restore(&state.delay)
            && self.model.restore(&state.model);
        let size = |links: usize, elements: usize| format!("of {links} links and {elements} action elements");
        let expected = size(self.robot().link_count(), self.action.len()) + ", and of the same configuration";
        require(fits, "state", size(M::links_of(&state.model), state.action.len()), &expected)?;
        self.source = state.source;
        self.sampler.set_difficulty(state.difficulty);
        self.episode.clone_from(&state.episode);
        self.take_drawn(state.drawn);
        self.action.copy_from_slice(&state.action);
        Ok(())
    }
}
