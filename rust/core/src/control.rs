//! The joint controller: PD (T 3.51), (T 7.8) or input-output linearising (T 6.58), with optional torque limit.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::error::{ConfigError, non_negative, positive, time_step};
use crate::math::Real;
use crate::robot::{Motor, PerAxis, Robot, RobotConfig};

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

/// When the torque is computed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", expecting = "\"implicit\", \"step\" or a period in seconds")]
pub enum Treatment {
    /// Continuously; in a time step linearly implicit, from the state at its end.
    #[default]
    Implicit,
    /// At the start of a step, held over it.
    Step,
    /// At the start of each control period of this length \[s\], held over it.
    #[serde(untagged)]
    Period(f64),
}

impl fmt::Display for Treatment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Treatment::Implicit => f.write_str("\"implicit\""),
            Treatment::Step => f.write_str("\"step\""),
            Treatment::Period(period) => write!(f, "{period}"),
        }
    }
}

/// Law, gains, limit and treatment of the joint controller.
///
/// The default is PD with the gains of (T Table 7.2), planar model; a configuration that names another law and no gains
/// has the gains of that law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "ControllerFields")]
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
    /// When the torque is computed; the planar and the spatial model have `Implicit` only.
    pub treatment: Treatment,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        let treatment = Treatment::Implicit;
        Self { law: ControlLaw::Pd, kp: 800.0, kd: 2.0, torque_limit: None, active_from: 0.0, treatment }
    }
}

/// What a user writes: gains that are left out are those of the law.
#[derive(Deserialize)]
#[serde(rename = "ControllerConfig", default, deny_unknown_fields)]
struct ControllerFields {
    law: ControlLaw,
    #[serde(deserialize_with = "given")]
    kp: Option<f64>,
    #[serde(deserialize_with = "given")]
    kd: Option<f64>,
    torque_limit: Option<f64>,
    active_from: f64,
    treatment: Treatment,
}

impl Default for ControllerFields {
    fn default() -> Self {
        let ControllerConfig { law, torque_limit, active_from, treatment, .. } = ControllerConfig::default();
        Self { law, kp: None, kd: None, torque_limit, active_from, treatment }
    }
}

/// A number; unlike an `Option<f64>`, not nothing.
fn given<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    f64::deserialize(deserializer).map(Some)
}

impl From<ControllerFields> for ControllerConfig {
    fn from(fields: ControllerFields) -> Self {
        let of_law = match fields.law {
            ControlLaw::Pd => Self::default(),
            ControlLaw::Io => Self::io(),
        };
        let ControllerFields { law, kp, kd, torque_limit, active_from, treatment } = fields;
        let (kp, kd) = (kp.unwrap_or(of_law.kp), kd.unwrap_or(of_law.kd));
        Self { law, kp, kd, torque_limit, active_from, treatment }
    }
}

impl ControllerConfig {
    /// Input-output linearisation with the gains of (T Table 7.2).
    pub fn io() -> Self {
        Self { law: ControlLaw::Io, kp: 4e5, kd: 2.4e3, ..Self::default() }
    }

    /// # Errors
    /// Names the gain, limit or period that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        non_negative("kp", self.kp)?;
        non_negative("kd", self.kd)?;
        non_negative("active_from", self.active_from)?;
        if let Some(limit) = self.torque_limit {
            positive("torque_limit", limit)?;
        }
        if let Treatment::Period(period) = self.treatment {
            time_step("treatment", period)?;
        }
        Ok(())
    }

    /// The same with the largest torque that any joint of a robot has within its motors.
    #[must_use]
    pub fn driving(self, robot: &RobotConfig) -> Self {
        let own = robot.torque_limit.as_ref().map(PerAxis::largest).or(self.torque_limit);
        let strongest = |motors: &PerAxis<Motor>| motors.values().map(|motor| motor.stall_torque).fold(0.0, f64::max);
        let limits = own.into_iter().chain(robot.motor.as_ref().map(strongest));
        Self { torque_limit: limits.reduce(f64::min).filter(|limit| limit.is_finite()), ..self }
    }

    /// The laws of yaw and pitch of each joint of a robot; the torque limit is the largest of them.
    pub fn gains(&self, robot: &Robot) -> Vec<[AxisGains; 2]> {
        let [kp, kd, limit] = &robot.own_gains;
        let largest = self.torque_limit.unwrap_or(f64::INFINITY);
        let of_axis = |joint: usize, axis: usize| {
            let own = |values: &Option<Vec<[f64; 2]>>, shared| values.as_ref().map_or(shared, |own| own[joint][axis]);
            let torque_limit = own(limit, largest).min(largest);
            AxisGains { kp: own(kp, self.kp), kd: own(kd, self.kd), torque_limit }
        };
        (0..robot.joint_count()).map(|joint| [0, 1].map(|axis| of_axis(joint, axis))).collect()
    }

    /// The largest torque at a time: infinite when there is no limit, 0 before `active_from` \[N m\].
    pub fn limit_at(&self, time: f64) -> f64 {
        if time < self.active_from { 0.0 } else { self.torque_limit.unwrap_or(f64::INFINITY) }
    }

    /// Whether actuators act in a stage that ends at `end`: those that are switched on then have not acted yet.
    pub fn acts_until(&self, end: f64) -> bool {
        end - ROUND_OFF >= self.active_from
    }
}

/// The PD law of one joint axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisGains<T = f64> {
    pub kp: T,
    pub kd: T,
    /// \[N m\]
    pub torque_limit: T,
}

impl AxisGains {
    /// Deviation of a joint at rest from which on the torque is at its limit; infinite without limit \[rad\].
    pub fn saturation(&self) -> f64 {
        if self.torque_limit.is_finite() { self.torque_limit / self.kp } else { f64::INFINITY }
    }

    /// The same in all lanes.
    pub fn splat<T: Real>(self) -> AxisGains<T> {
        let Self { kp, kd, torque_limit } = self;
        AxisGains { kp: T::splat(kp), kd: T::splat(kd), torque_limit: T::splat(torque_limit) }
    }
}

impl<T: Real> AxisGains<T> {
    /// Impulse without limit of a joint at rest, its decrease per rate, and largest impulse of a stage of coefficient `c`, at
    /// whose end the torque is taken. `strength` is the factor on the largest torque, 0 for actuators that are off.
    #[inline(always)]
    pub fn stage(&self, c: T, strength: T, error: T, rate: T) -> [T; 3] {
        let Self { kp, kd, .. } = *self;
        [c * (kp * error + kd * rate), c * (c * kp + kd), c * self.limit(strength)]
    }

    /// \[N m\]
    #[inline(always)]
    pub fn limit(&self, strength: T) -> T {
        T::select(T::zero().lt(strength), strength * self.torque_limit, T::zero())
    }
}

/// Times closer to each other than this count as equal \[s\].
const ROUND_OFF: f64 = 1e-10;
