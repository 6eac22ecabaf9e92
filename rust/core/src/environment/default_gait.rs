//! The gait that action zero of the modes `gait` and `residual` prescribes.

use crate::gait::Wave;

/// Waves of the yaw and the pitch angles, and where they carry the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultGait {
    /// Phase zero at the start.
    pub yaw: Wave,
    /// Amplitude A_v of the vertical wave and its phase against the horizontal one \[rad\]; their frequencies and phase
    /// shifts are the same.
    pub lift: f64,
    pub lift_phase: f64,
    /// Angle from the direction of the body to that in which the gait carries it over open ground \[rad\].
    pub travel: f64,
}

impl DefaultGait {
    /// Lateral undulation (T 7.3).
    pub fn undulation() -> Self {
        Self { yaw: Wave::default(), lift: 0.0, lift_phase: 90f64.to_radians(), travel: 0.0 }
    }

    /// The thesis's sidewinding: a vertical wave a quarter period ahead of the horizontal one.
    pub fn sidewinding() -> Self {
        let undulation = Self::undulation();
        Self {
            yaw: Wave { amplitude: 30f64.to_radians(), ..undulation.yaw },
            lift: 10f64.to_radians(),
            travel: SIDEWAYS.to_radians(),
            ..undulation
        }
    }
}

/// Angle from the body to the course of the sidewinding robot on isotropic ground, positive to the left \[deg\]; the
/// thesis finds 93 to one side.
const SIDEWAYS: f64 = 93.0;
