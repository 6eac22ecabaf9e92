//! The joint controller: PD (T 3.51) or input-output linearising (T 6.58), with optional torque limit.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative, positive};

/// Which control law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ControlLaw {
    /// tau = k_D (phi_d' - phi') + k_P (phi_d - phi) (T 3.51), (T 7.8).
    #[default]
    Pd,
    /// tau = M_22_bar u + h_2_bar - g_2_bar (T 6.58), u = phi_d'' + K_D (phi_d' - phi') + K_P (phi_d - phi) (T 6.60).
    Io,
}

/// Law, gains and limit of the joint controller; the default is PD with the gains of (T Table 7.2), planar model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    pub law: ControlLaw,
    /// k_P \[N m/rad\], or K_P \[1/s^2\] for `Io`.
    pub kp: f64,
    /// k_D \[N m s/rad\], or K_D \[1/s\] for `Io`.
    pub kd: f64,
    /// Largest torque of a joint \[N m\]; `None` for none.
    pub torque_limit: Option<f64>,
    /// The actuators are off before this time \[s\].
    pub active_from: f64,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self { law: ControlLaw::Pd, kp: 800.0, kd: 2.0, torque_limit: None, active_from: 0.0 }
    }
}

impl ControllerConfig {
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

    /// The largest torque at a time: infinite when there is no limit, 0 before `active_from` \[N m\].
    pub fn limit_at(&self, time: f64) -> f64 {
        if time < self.active_from { 0.0 } else { self.torque_limit.unwrap_or(f64::INFINITY) }
    }

    /// The largest torque in a stage that ends at `end`: actuators that are switched on then have not acted yet
    /// \[N m\].
    pub fn limit_until(&self, end: f64) -> f64 {
        self.limit_at(end - ROUND_OFF)
    }
}

/// Times this close count as one \[s\].
const ROUND_OFF: f64 = 1e-10;
