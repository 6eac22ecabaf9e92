use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::unbounded;
use crate::error::{ConfigError, non_negative, positive, require};

/// The motor of a joint axis behind its gear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, remote = "Self")]
pub struct Motor {
    /// Torque at the joint when it does not turn; infinite: whatever the controller asks for \[N m\].
    #[serde(deserialize_with = "unbounded")]
    pub stall_torque: f64,
    /// Rate of the joint at which the motor gives no torque any more; infinite: the torque does not fall \[rad/s\].
    #[serde(deserialize_with = "unbounded")]
    pub no_load_speed: f64,
    /// Moment of inertia of the rotor, before the gear \[kg m^2\].
    pub rotor_inertia: f64,
    /// Turns of the rotor in one of the joint.
    pub gear_ratio: f64,
    /// Torque at the joint that Coulomb's friction of the gear resists with \[N m\].
    pub gear_friction: f64,
    /// Viscous friction of the gear, at the joint \[N m s/rad\].
    pub gear_damping: f64,
}

/// From named fields alone: a list is one of motors, not of their numbers.
impl<'de> Deserialize<'de> for Motor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Named;

        impl<'de> Visitor<'de> for Named {
            type Value = Motor;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a motor")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Motor, A::Error> {
                Motor::deserialize(MapAccessDeserializer::new(map))
            }
        }

        deserializer.deserialize_struct("Motor", &[], Named)
    }
}

impl Serialize for Motor {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl Default for Motor {
    /// Any torque at any rate, directly on the joint.
    fn default() -> Self {
        Self {
            stall_torque: f64::INFINITY,
            no_load_speed: f64::INFINITY,
            rotor_inertia: 0.0,
            gear_ratio: 1.0,
            gear_friction: 0.0,
            gear_damping: 0.0,
        }
    }
}

impl Motor {
    /// # Errors
    /// Names the field that is out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        for (field, value) in [("stall_torque", self.stall_torque), ("no_load_speed", self.no_load_speed)] {
            if value != f64::INFINITY {
                positive(field, value)?;
            }
        }
        let has_line = self.no_load_speed.is_finite();
        let expected = "a number where no_load_speed is one: a torque without limit does not fall";
        require(!has_line || self.stall_torque.is_finite(), "stall_torque", self.stall_torque, expected)?;
        non_negative("rotor_inertia", self.rotor_inertia)?;
        positive("gear_ratio", self.gear_ratio)?;
        non_negative("gear_friction", self.gear_friction)?;
        non_negative("gear_damping", self.gear_damping)?;
        Ok(())
    }

    /// Whether the joint follows the motor through a rotor or a gear of its own state, which backlash would part from it.
    pub fn needs_tight_gear(&self) -> bool {
        self.rotor_inertia > 0.0 || self.gear_friction > 0.0 || self.gear_damping > 0.0
    }

    /// Inertia of the rotor that the joint feels \[kg m^2\].
    pub fn reflected_inertia(&self) -> f64 {
        self.rotor_inertia * self.gear_ratio * self.gear_ratio
    }
}
