//! Inclined ground: gravity in the frame of the ground.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, coordinate, within};

/// Inclination of the ground; configured as the pair `[angle, direction]`.
///
/// All coordinates are those of the ground: x and y lie in it, z is its normal. So gravity tilts, and not the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Slope {
    /// Between the ground and the horizontal \[rad\].
    pub angle: f64,
    /// In which the ground rises, from the x axis \[rad\].
    pub direction: f64,
}

impl From<[f64; 2]> for Slope {
    fn from([angle, direction]: [f64; 2]) -> Self {
        Self { angle, direction }
    }
}

impl From<Slope> for [f64; 2] {
    fn from(slope: Slope) -> Self {
        [slope.angle, slope.direction]
    }
}

impl Slope {
    /// # Errors
    /// Names the angle or the direction that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        within("slope[0]", self.angle, 0.0, FRAC_PI_2)?;
        coordinate("slope[1]", self.direction)?;
        Ok(())
    }

    /// Acceleration of gravity, of magnitude `gravity`, in the frame of the ground \[m/s^2\].
    pub fn acceleration(&self, gravity: f64) -> Vector3<f64> {
        let (downhill, normal) = (-gravity * self.angle.sin(), -gravity * self.angle.cos());
        Vector3::new(downhill * self.direction.cos(), downhill * self.direction.sin(), normal)
    }
}
