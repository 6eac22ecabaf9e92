//! Obstacles that can be pushed start outside of all others, and among vertical ones.

use nalgebra::Vector2;

use crate::error::{ConfigError, require};
use crate::obstacles::{Movable, ObstacleGrid};

use super::{PlacedLink, link_pair_gap, obstacle_gap};

/// Checks the start of a scene.
///
/// # Errors
/// Names an obstacle that can be pushed and starts inside another one, or one that it could not be pushed against.
pub fn require_apart(obstacles: &ObstacleGrid) -> Result<(), ConfigError> {
    let is_leaning = |obstacle: &usize| obstacles.body(*obstacle).is_some() && !obstacles.movables().is_empty();
    if let Some(body) = (0..obstacles.len()).find(is_leaning) {
        let field = format!("scene.obstacles[{}]", obstacles.index_in_scene(body));
        let expected = "a vertical obstacle: what can be pushed stands on level ground and meets no others";
        return Err(ConfigError::new(&field, "a height field, polyhedron or cylinder", expected.to_owned()));
    }
    for (k, movable) in obstacles.movables().iter().enumerate() {
        let own = at_start(movable);
        let to_others = obstacles.movables()[..k].iter().map(|other| link_pair_gap([&at_start(other), &own]));
        let gap = to_others.fold(obstacle_gap(&own.pose, movable, obstacles), f64::min);
        let field = format!("scene.obstacles[{}]", obstacles.index_in_scene(obstacles.len() + k));
        let value = format!("{:.4} m inside another obstacle", -gap);
        require(gap > -DEEPEST, &field, value, "at most 1 mm: obstacles that can be pushed start outside others")?;
    }
    Ok(())
}

fn at_start(movable: &Movable) -> PlacedLink<'_> {
    PlacedLink::new(movable, Vector2::from(movable.start).push(0.0))
}

/// Depth at the start that is let pass \[m\].
const DEEPEST: f64 = 1e-3;
