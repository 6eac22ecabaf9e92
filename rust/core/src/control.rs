//! The joint controller: PD with optional torque limit (T 3.51).

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative, positive};

/// Gains and limit of the PD controller; the default gains are (T Table 7.2), planar model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PdConfig {
    /// k_P \[N m/rad\].
    pub kp: f64,
    /// k_D \[N m s/rad\].
    pub kd: f64,
    /// Largest torque of a joint \[N m\]; `None` for none.
    pub torque_limit: Option<f64>,
    /// The actuators are off before this time \[s\].
    pub active_from: f64,
}

impl Default for PdConfig {
    fn default() -> Self {
        Self { kp: 800.0, kd: 2.0, torque_limit: None, active_from: 0.0 }
    }
}

impl PdConfig {
    /// # Errors
    /// Names the gain or limit that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("kp", self.kp)?;
        non_negative("kd", self.kd)?;
        non_negative("active_from", self.active_from)?;
        if let Some(limit) = self.torque_limit {
            positive("torque_limit", limit)?;
        }
        Ok(())
    }

    /// The largest torque, infinite when there is no limit \[N m\].
    pub fn limit(&self) -> f64 {
        self.torque_limit.unwrap_or(f64::INFINITY)
    }

    /// The same controller in mathematical form: gains are zero before `active_from`.
    pub fn gains_at(&self, time: f64) -> (f64, f64) {
        if time < self.active_from { (0.0, 0.0) } else { (self.kp, self.kd) }
    }
}
