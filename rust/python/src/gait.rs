//! The gait of a scripted run as the user writes it.

use std::f64::consts::PI;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::error::{coordinate, non_negative, require};
use snake_core::gait::{CardanGait, Gait, Reference, SoftStart, Wave};

use crate::ffi::CoreError;
use crate::from_python::from_python;
use crate::numbers::set_array;
use crate::start::written;

/// Horizontal and vertical travelling waves (T 2.14), (T 7.1), (T 7.2).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaitConfig {
    amplitude: f64,
    omega: f64,
    beta: f64,
    gamma: f64,
    vertical_amplitude: f64,
    vertical_omega: f64,
    vertical_beta: f64,
    vertical_phase: f64,
    soft_start: bool,
}

impl Default for GaitConfig {
    fn default() -> Self {
        let Wave { amplitude, omega, beta, gamma, .. } = Wave::default();
        Self {
            amplitude,
            omega,
            beta,
            gamma,
            vertical_amplitude: 0.0,
            vertical_omega: 0.0,
            vertical_beta: 0.0,
            vertical_phase: 0.0,
            soft_start: false,
        }
    }
}

impl GaitConfig {
    /// # Errors
    /// Names the parameter that is not finite.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.wave().validate()?;
        coordinate("vertical_amplitude", self.vertical_amplitude)?;
        coordinate("vertical_omega", self.vertical_omega)?;
        coordinate("vertical_beta", self.vertical_beta)?;
        coordinate("vertical_phase", self.vertical_phase)?;
        Ok(())
    }

    /// The reference of a planar robot whose actuators are switched on at `start_up` \[s\].
    ///
    /// # Errors
    /// Names the parameter that is not finite, an amplitude that folds the robot, or a vertical wave.
    pub fn planar(&self, joints: usize, start_up: f64) -> Result<Gait, ConfigError> {
        self.validate()?;
        let vertical = self.vertical_amplitude;
        let expected = "0: the planar and the minimal model take gaits without a vertical wave";
        require(vertical == 0.0, "vertical_amplitude", vertical, expected)?;
        let offset = self.gamma;
        require(offset.abs() <= PI, "gamma", offset, "an angle in [-pi, pi], in radians")?;
        let expected = "at most pi with the offset, in radians: beyond, a link folds through the one ahead";
        require(self.amplitude.abs() + self.gamma.abs() <= PI, "amplitude", self.amplitude, expected)?;
        Ok(self.yaw(joints, start_up))
    }

    /// The reference of a spatial robot whose actuators are switched on at `start_up` \[s\] and whose references are at
    /// most `largest` \[rad\].
    ///
    /// # Errors
    /// Names the parameter that is not finite, or the amplitude that takes a joint too far.
    pub fn spatial(&self, joints: usize, start_up: f64, largest: f64) -> Result<CardanGait, ConfigError> {
        self.validate()?;
        let angle = written(largest);
        let expected = format!("an angle in [-{angle}, {angle}], in radians");
        let (offset, vertical) = (self.gamma, self.vertical_amplitude);
        require(offset.abs() <= largest, "gamma", offset, &expected)?;
        require(vertical.abs() <= largest, "vertical_amplitude", vertical, &expected)?;
        let expected = format!("at most {angle} with the offset, in radians: the joint limit, or a right angle");
        let bend = self.amplitude.abs() + offset.abs();
        require(bend <= largest + ROUND_OFF, "amplitude", self.amplitude, &expected)?;
        Ok(CardanGait { yaw: self.yaw(joints, start_up), pitch: self.pitch(joints, start_up) })
    }

    /// The horizontal reference.
    pub fn yaw(&self, joints: usize, start_up: f64) -> Gait {
        self.started(self.wave(), joints, start_up)
    }

    /// The vertical reference.
    pub fn pitch(&self, joints: usize, start_up: f64) -> Gait {
        self.started(self.vertical_wave(), joints, start_up)
    }

    fn wave(&self) -> Wave {
        let Self { amplitude, omega, beta, gamma, .. } = *self;
        Wave { amplitude, omega, beta, gamma, phase: 0.0 }
    }

    fn vertical_wave(&self) -> Wave {
        Wave {
            amplitude: self.vertical_amplitude,
            omega: self.vertical_omega,
            beta: self.vertical_beta,
            gamma: 0.0,
            phase: self.vertical_phase,
        }
    }

    /// The wave, with soft start if so chosen.
    fn started(&self, wave: Wave, joints: usize, start_up: f64) -> Gait {
        if self.soft_start {
            Gait::SoftStart(SoftStart::switched_on_at(start_up, wave, joints))
        } else {
            Gait::Wave(wave)
        }
    }
}

/// Sums of amplitude and offset this little beyond the limit are at it \[rad\].
pub const ROUND_OFF: f64 = 1e-12;

/// References of the yaw angles, or with `vertical` of the pitch angles, at given times: angle, rate and acceleration
/// of (T, joints) each. `start_up`: when the actuators are switched on \[s\].
///
/// # Errors
/// ConfigError names what is not admissible.
#[pyfunction]
pub fn gait_reference<'py>(
    py: Python<'py>,
    gait: &Bound<'py, PyAny>,
    joints: usize,
    times: Vec<f64>,
    vertical: bool,
    start_up: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let config: GaitConfig = from_python(gait).map_err(CoreError::from)?;
    config.validate().map_err(|e| CoreError::Config(e.inside("gait")))?;
    non_negative("start_up", start_up).map_err(|e| CoreError::Config(e.inside("gait")))?;
    let gait = if vertical { config.pitch(joints, start_up) } else { config.yaw(joints, start_up) };
    let targets = times.iter().flat_map(|&time| (0..joints).map(move |joint| (joint, time)));
    let targets: Vec<_> = targets.map(|(joint, time)| gait.target(joint, time)).collect();
    let dict = PyDict::new(py);
    let shape = [times.len(), joints];
    set_array(&dict, "angle", targets.iter().map(|target| target.angle).collect(), &shape)?;
    set_array(&dict, "rate", targets.iter().map(|target| target.rate).collect(), &shape)?;
    set_array(&dict, "acceleration", targets.iter().map(|target| target.acceleration).collect(), &shape)?;
    Ok(dict)
}
