//! Open ground on which a direction and a speed are commanded.

use std::sync::Arc;

use crate::environment::config::EnvConfig;
use crate::environment::goal::Target;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::ConfigError;
use crate::robot::Robot;

use super::free::{self, Free};
use super::{EpisodeStart, Family, GoalKind, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "command",
    id: "SnakeCommand-v1",
    description: "A speed and a direction are commanded and observed, new ones in each episode. The speed is drawn from \
                  the interval `speed`, the direction lies up to `difficulty` times `turn` off the robot's. The ground is that of \
                  `SnakeFree-v1`. `goal` commands a direction, `{\"heading\": 0.5, \"speed\": 0.1}`, a path to follow, \
                  `[(0, 0), (1, 0), (1, 1)]`, or a point. An episode with a direction ends only by `max_episode_steps`.",
    goal: GoalKind::Direction,
    scenario: |config, robot| Ok(Arc::new(Command::new(config, robot)?)),
    ..free::FAMILY
};

#[derive(Debug)]
struct Command {
    ground: Free,
    turn: f64,
    speed: [f64; 2],
}

impl Command {
    fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        Ok(Self { ground: Free::new(config, robot)?, turn: config.turn, speed: config.speed })
    }
}

impl Scenario for Command {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let EpisodeStart { start, .. } = self.ground.draw(placement, difficulty, jitter, rng);
        let [low, high] = self.speed;
        let target = Target::Direction { angle: difficulty * rng.around_zero(self.turn) };
        EpisodeStart { start, target, speed: Some(rng.uniform(low, high)) }
    }
}
