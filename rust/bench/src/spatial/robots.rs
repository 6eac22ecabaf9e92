//! A fleet of the 3D model whose robots are at different phases of their motion.

use snake_core::ConfigError;
use snake_core::gait::CardanGait;
use snake_core::obstacles::ObstacleGrid;
use snake_core::spatial::{SpatialFleet, SpatialScripted, SpatialSystem};
use snake_core::stepping::ImplicitConfig;

use crate::clock::{Spent, spent};
use crate::fleet::{ROBOTS, WINDOW};

use super::scenes::SpatialScenario;

/// Time by which each robot is ahead of the one before \[s\].
const STAGGER: f64 = 0.07;

/// A robot that follows a gait.
pub type Robot = SpatialScripted<CardanGait>;

/// The robots of one scenario, robot k by k * 0.07 s ahead: they cover the five seconds over which errors are measured.
///
/// # Errors
/// The scenario is not admissible.
pub fn staggered(scenario: &SpatialScenario, system: &SpatialSystem) -> Result<Vec<Robot>, ConfigError> {
    let pegs = ObstacleGrid::of(&scenario.scene.obstacles);
    let start = Robot::new(&system.robot, pegs, scenario.head(), &scenario.posture(), scenario.gait());
    let mut robots = vec![start; ROBOTS];
    let mut fleet = SpatialFleet::new(ImplicitConfig::default(), system, ROBOTS);
    for k in 1..ROBOTS {
        // Robot k takes part in the first k of all moves.
        fleet.advance(system, robots[k..].iter_mut().map(SpatialScripted::driven), STAGGER);
    }
    Ok(robots)
}

/// Lets a fleet that starts from `robots` move for one window; returns its time on this thread.
pub fn time_window(system: &SpatialSystem, fleet: &mut SpatialFleet, robots: &[Robot]) -> Spent {
    let mut moving = robots.to_vec();
    spent(|| fleet.advance(system, moving.iter_mut().map(SpatialScripted::driven), WINDOW)).1
}
