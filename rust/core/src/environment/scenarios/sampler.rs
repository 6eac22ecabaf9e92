//! Draws the start, the pegs and the goal of each episode.

use std::sync::Arc;

use crate::environment::config::EnvConfig;
use crate::environment::goal::Goal;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::ConfigError;
use crate::robot::Robot;
use crate::scene::Peg;

use super::{EpisodeStart, Placement, PushPointCounter, Scenario};

/// The scenario of an environment, and memory to draw episodes from it.
#[derive(Debug, Clone)]
pub struct ScenarioSampler {
    /// Shared by all environments of a batch.
    scenario: Arc<dyn Scenario>,
    difficulty: f64,
    jitter: f64,
    counter: PushPointCounter,
    placement: Placement,
}

impl ScenarioSampler {
    /// # Errors
    /// Names what the family of scenes refuses.
    pub fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        Ok(Self {
            scenario: (config.task.family().scenario)(config, robot)?,
            difficulty: config.difficulty,
            jitter: config.start_jitter,
            counter: PushPointCounter::of(robot),
            placement: Placement::new(robot),
        })
    }

    pub fn difficulty(&self) -> f64 {
        self.difficulty
    }

    /// The difficulty of the episodes to come, in \[0, 1\].
    pub fn set_difficulty(&mut self, difficulty: f64) {
        self.difficulty = difficulty;
    }

    /// The pegs of the episode drawn last.
    pub fn pegs(&self) -> &[Peg] {
        &self.placement.pegs
    }

    /// The robot's joint angles at its start \[rad\].
    pub fn joint_angle(&self) -> &[f64] {
        self.placement.joint_angle()
    }

    /// The smallest number of push-points in any body length on the way to `goal` among `pegs`.
    pub fn push_points(&self, goal: &Goal, pegs: &[Peg]) -> usize {
        self.counter.push_points(goal, pegs)
    }

    /// Draws start, pegs and goal from the random numbers of the episode.
    pub fn draw(&mut self, rng: &mut Rng) -> EpisodeStart {
        let jitter = StartJitter::draw(rng, self.jitter);
        self.scenario.draw(&mut self.placement, self.difficulty, &jitter, rng)
    }
}
