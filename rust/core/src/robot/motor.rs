use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, non_negative, positive};

/// The motor of each joint axis behind its gear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Torque at the joint when it does not turn \[N m\].
    pub stall_torque: f64,
    /// Rate of the joint at which the motor gives no torque any more \[rad/s\].
    pub no_load_speed: f64,
    /// Moment of inertia of the rotor, before the gear \[kg m^2\].
    #[serde(default)]
    pub rotor_inertia: f64,
    /// Turns of the rotor in one of the joint.
    #[serde(default = "direct")]
    pub gear_ratio: f64,
    /// Torque at the joint that Coulomb's friction of the gear resists with \[N m\].
    #[serde(default)]
    pub gear_friction: f64,
}

fn direct() -> f64 {
    1.0
}

impl Motor {
    /// # Errors
    /// Names the field that is out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        positive("stall_torque", self.stall_torque)?;
        positive("no_load_speed", self.no_load_speed)?;
        non_negative("rotor_inertia", self.rotor_inertia)?;
        positive("gear_ratio", self.gear_ratio)?;
        non_negative("gear_friction", self.gear_friction)?;
        Ok(())
    }

    /// Whether the joint follows the motor through a rotor or a gear of its own state, which backlash would part from it.
    pub fn needs_tight_gear(&self) -> bool {
        self.rotor_inertia > 0.0 || self.gear_friction > 0.0
    }

    /// Inertia of the rotor that the joint feels \[kg m^2\].
    pub fn reflected_inertia(&self) -> f64 {
        self.rotor_inertia * self.gear_ratio * self.gear_ratio
    }
}
