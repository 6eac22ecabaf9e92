use nalgebra::Vector2;

use crate::control::PdConfig;
use crate::error::ConfigError;
use crate::robot::{Link, Robot};

/// Robot, ground and controller: what all robots of a fleet share and no step changes.
#[derive(Debug, Clone)]
pub struct Plant {
    pub robot: Robot,
    pub controller: PdConfig,
    /// mu_Tx, mu_Ty.
    friction: Vector2<f64>,
}

impl Plant {
    /// # Errors
    /// Names the gain that is not admissible.
    pub fn new(robot: Robot, friction: [f64; 2], controller: PdConfig) -> Result<Self, ConfigError> {
        controller.validate()?;
        Ok(Self { robot, controller, friction: Vector2::from(friction) })
    }

    /// Friction bound of a link along and across it, mu m g \[N\].
    pub fn friction_force(&self, link: &Link) -> Vector2<f64> {
        self.friction * (link.mass * self.robot.gravity)
    }
}
