//! Obstacles that can be pushed start outside of all others; upright ones among vertical ones.

use crate::contact::obstacle_gap;
use crate::error::{ConfigError, require};
use crate::obstacles::ObstacleGrid;
use crate::spatial::{SpatialState, ball_gap, pair_gap};

/// Checks the start of a scene.
///
/// # Errors
/// Names an obstacle that can be pushed and starts inside another one, or one that it could not be pushed against.
pub fn require_apart(obstacles: &ObstacleGrid) -> Result<(), ConfigError> {
    let mut state = SpatialState::zero(0);
    state.place_movables(obstacles.movables());
    let is_any_upright = obstacles.movables().iter().any(|movable| movable.ball.is_none());
    let is_leaning = |obstacle: &usize| is_any_upright && obstacles.body(*obstacle).is_some();
    if let Some(body) = (0..obstacles.len()).find(is_leaning) {
        let field = format!("scene.obstacles[{}]", obstacles.index_in_scene(body));
        let expected = "a vertical obstacle: of what can be pushed only spheres meet others";
        return Err(ConfigError::new(&field, "a height field, polyhedron or cylinder", expected.to_owned()));
    }
    let nodes = obstacles.nodes(&[]);
    for (k, (movable, moved)) in obstacles.movables().iter().zip(&state.movables).enumerate() {
        let to_fixed = match movable.ball {
            Some(ball) => ball_gap(movable, &moved.pose.xy().push(ball.start_height), obstacles),
            None => obstacle_gap(&moved.pose, movable, obstacles),
        };
        let gap = (0..k).map(|other| pair_gap(nodes, [other, k], &state)).fold(to_fixed, f64::min);
        let field = format!("scene.obstacles[{}]", obstacles.index_in_scene(obstacles.len() + k));
        let value = format!("{:.4} m inside another obstacle", -gap);
        let outside = "at most 1 mm: obstacles that can be pushed start outside others, and balls above the ground";
        require(gap > -DEEPEST, &field, value, outside)?;
    }
    Ok(())
}

/// Depth at the start that is let pass \[m\].
const DEEPEST: f64 = 1e-3;
