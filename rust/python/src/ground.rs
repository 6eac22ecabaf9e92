//! The ground of the minimal model as the user writes it.

use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::minimal::{FrictionLaw, Ground};

/// Coefficients along and across a link, and the law.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundConfig {
    friction: [f64; 2],
    viscous: [f64; 2],
    friction_law: String,
    smoothing: f64,
}

impl GroundConfig {
    /// Checks coefficients and law.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let ground = Ground { coulomb: self.friction, viscous: self.viscous };
        ground.validate()?;
        FrictionLaw::new(&self.friction_law, self.smoothing).map(drop)
    }

    /// The coefficients.
    pub fn ground(&self) -> Result<Ground, ConfigError> {
        let ground = Ground { coulomb: self.friction, viscous: self.viscous };
        ground.validate().map_err(|e| e.inside("scene"))?;
        Ok(ground)
    }

    /// The friction law.
    pub fn law(&self) -> Result<FrictionLaw, ConfigError> {
        FrictionLaw::new(&self.friction_law, self.smoothing).map_err(|e| e.inside("scene"))
    }
}
