//! Where an episode takes place, as the user writes it.

use std::sync::Arc;

use nalgebra::Vector2;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::capabilities::{Method, ModelName};
use snake_core::environment::polyline::Polyline;
use snake_core::environment::scenarios::GoalKind;
use snake_core::environment::{EnvConfig, ModelKind, OwnGoal, OwnStart, World};
use snake_core::error::{coordinate, length, non_negative, require};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::Robot;

use crate::start::StartConfig;

/// Start and goal of one episode, beside the scene; what is absent the family of scenes draws.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    start: Option<StartConfig>,
    goal: Option<GoalConfig>,
}

/// A goal line at a distance ahead of the start, by default the configured one, a goal point, a path or a direction.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct GoalConfig {
    /// Of the line from the CG at the start, along +x \[m\].
    distance: Option<f64>,
    /// y of the corridor's centre line; by default that of the CG at the start \[m\].
    centre_line: Option<f64>,
    /// The point (x, y) \[m\].
    point: Option<[f64; 2]>,
    /// Of the disc around the point, or the length at the end of the path that need not be covered; by default the
    /// configured one \[m\].
    radius: Option<f64>,
    /// Points (x, y) of a path \[m\].
    path: Option<Vec<[f64; 2]>>,
    /// Angle from +x of the direction to go \[rad\].
    heading: Option<f64>,
    /// Commanded speed, where the task commands one \[m/s\].
    speed: Option<f64>,
}

impl WorldConfig {
    /// # Errors
    /// Names the field, its value and what is admissible.
    pub fn resolve(
        self,
        obstacles: Option<Arc<ObstacleGrid>>,
        config: &EnvConfig,
        robot: &Robot,
    ) -> Result<World, ConfigError> {
        let start = self.start.map(|start| own_start(&start, config, robot)).transpose()?;
        let speed = self.goal.as_ref().map_or(Ok(None), |goal| goal.commanded_speed(config))?;
        let goal = self.goal.map_or(Ok(None), |goal| goal.resolve(config))?;
        Ok(World { obstacles, start, goal, speed })
    }
}

fn own_start(start: &StartConfig, config: &EnvConfig, robot: &Robot) -> Result<OwnStart, ConfigError> {
    if config.model == ModelKind::Spatial {
        return start.own_in_space(robot);
    }
    let [x, y, angle] = start.in_plane((ModelName::Planar, Method::Implicit))?;
    Ok(OwnStart { position: Vector2::new(x, y), angle, joint_angle: start.own_posture(robot)?, raised: None })
}

impl GoalConfig {
    /// The goal; none where it is nothing but a speed.
    fn resolve(self, config: &EnvConfig) -> Result<Option<OwnGoal>, ConfigError> {
        let is_line = self.distance.is_some() || self.centre_line.is_some();
        let kinds = [is_line, self.point.is_some(), self.path.is_some(), self.heading.is_some()];
        let count = kinds.into_iter().filter(|is_given| *is_given).count();
        let expected = "one of a point, the distance of a line, a path and a heading";
        require(count <= 1, "goal", format!("{count} kinds of goals"), expected)?;
        let radius = length("goal.radius", self.radius.unwrap_or(config.goal_radius))?;
        if let Some([x, y]) = self.point {
            let centre = Vector2::new(coordinate("goal.point[0]", x)?, coordinate("goal.point[1]", y)?);
            return Ok(Some(OwnGoal::Disc { centre, radius }));
        }
        if let Some(points) = self.path {
            let path = Polyline::new(points.into_iter().map(Vector2::from).collect()).map_err(|e| e.inside("goal"))?;
            return Ok(Some(OwnGoal::Path { path, radius }));
        }
        if let Some(angle) = self.heading {
            return Ok(Some(OwnGoal::Direction { angle: coordinate("goal.heading", angle)? }));
        }
        if self.speed.is_some() && !is_line {
            return Ok(None);
        }
        let distance = length("goal.distance", self.distance.unwrap_or(config.goal_distance))?;
        let centre_line = self.centre_line.map(|y| coordinate("goal.centre_line", y)).transpose()?;
        Ok(Some(OwnGoal::Line { distance, centre_line }))
    }

    /// # Errors
    /// The speed is not admissible, or the task commands none.
    fn commanded_speed(&self, config: &EnvConfig) -> Result<Option<f64>, ConfigError> {
        let Some(speed) = self.speed else { return Ok(None) };
        let commands = config.task.family().goal == GoalKind::Direction;
        require(commands, "goal.speed", speed, "no speed: task=\"command\" has one")?;
        Ok(Some(non_negative("goal.speed", speed)?))
    }
}
