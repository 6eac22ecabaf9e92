//! Amplitudes of measurement noise (T 7.9)-(T 7.14): of the minimal model's feedback and of observations.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative};

/// Amplitudes of uniform noise (T Table 7.4).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseConfig {
    /// N_p of (T 7.9) \[m\]; no controller uses the position.
    pub position: f64,
    /// N_theta of (T 7.10) \[rad\].
    pub heading: f64,
    /// N_phi of (T 7.11) \[rad\].
    pub joint_angle: f64,
    /// N_v of (T 7.12) \[m/s\].
    pub velocity: f64,
    /// N_theta' of (T 7.13) \[rad/s\].
    pub yaw_rate: f64,
    /// N_phi' of (T 7.14) \[rad/s\].
    pub joint_rate: f64,
}

impl NoiseConfig {
    /// # Errors
    /// Names the amplitude that is negative or not finite.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("position", self.position)?;
        non_negative("heading", self.heading)?;
        non_negative("joint_angle", self.joint_angle)?;
        non_negative("velocity", self.velocity)?;
        non_negative("yaw_rate", self.yaw_rate)?;
        non_negative("joint_rate", self.joint_rate)?;
        Ok(())
    }

    /// Whether there is no noise at all.
    pub fn is_silent(&self) -> bool {
        *self == Self::default()
    }
}
