//! Draws the start, the pegs and the goal of each episode.

use std::sync::Arc;

use crate::environment::config::EnvConfig;
use crate::environment::goal::Goal;
use crate::environment::raised_chain::RaisedChain;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::ConfigError;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;
use crate::scene::Peg;

use super::world::{World, WorldLayout};
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
    worlds: WorldLayout,
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
            worlds: WorldLayout::new(config, robot),
        })
    }

    pub fn difficulty(&self) -> f64 {
        self.difficulty
    }

    /// The difficulty of the episodes to come, in \[0, 1\].
    pub fn set_difficulty(&mut self, difficulty: f64) {
        self.difficulty = difficulty;
    }

    /// The pegs of the episode drawn last, unless it takes place in a [`Self::scene`].
    pub fn pegs(&self) -> &[Peg] {
        &self.placement.pegs
    }

    /// The obstacles of the last episode, if they were prescribed.
    pub fn scene(&self) -> Option<&Arc<ObstacleGrid>> {
        self.placement.scene()
    }

    /// The robot's joint angles at its start \[rad\].
    pub fn joint_angle(&self) -> &[f64] {
        self.placement.joint_angle()
    }

    /// The robot of the spatial model at its start, if it does not lie flat there.
    pub fn raised(&self) -> Option<&RaisedChain> {
        self.placement.raised()
    }

    /// The smallest number of push-points in any body length on the way to `goal` among `pegs`.
    pub fn push_points(&self, goal: &Goal, pegs: &[Peg]) -> usize {
        self.counter.push_points(goal, pegs)
    }

    /// # Errors
    /// The robot has no room in a world.
    pub fn check(&mut self, world: &World) -> Result<(), ConfigError> {
        self.worlds.check(world, &mut self.placement)
    }

    /// Draws start, pegs and goal from the random numbers of the episode, as far as its world does not tell them.
    pub fn draw(&mut self, world: Option<&World>, rng: &mut Rng) -> EpisodeStart {
        let jitter = StartJitter::draw(rng, self.jitter);
        let Self { scenario, difficulty, placement, worlds, .. } = self;
        placement.set_scene(None);
        match world {
            None => scenario.draw(placement, *difficulty, &jitter, rng),
            Some(world) => worlds.draw(world, scenario.as_ref(), (placement, *difficulty), &jitter, rng),
        }
    }
}
