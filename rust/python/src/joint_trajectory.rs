//! Joint references of the user's own, sampled in time.

use std::f64::consts::PI;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::error::require;
use snake_core::gait::{CardanGait, Gait, Reference, SampledReference, Wave};
use snake_core::robot::Robot;

use crate::ffi::CoreError;
use crate::from_python::from_python;
use crate::gait::ROUND_OFF;
use crate::numbers::set_array;
use crate::start::written;

/// Samples of the references of all joints, one list per joint.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryConfig {
    time: Vec<f64>,
    /// Of the yaw angles, which are all in the plane, and of the pitch angles.
    yaw: Vec<Vec<f64>>,
    yaw_rate: Option<Vec<Vec<f64>>>,
    pitch: Option<Vec<Vec<f64>>>,
    pitch_rate: Option<Vec<Vec<f64>>>,
}

impl TrajectoryConfig {
    /// The reference of a planar robot.
    ///
    /// # Errors
    /// Names the samples that are not admissible.
    pub fn planar(&self, joints: usize) -> Result<Gait, ConfigError> {
        let pitched = self.pitch.is_some();
        require(!pitched, "angle", "pairs (yaw, pitch)", "one angle per joint: the robot has no pitch")?;
        let yaw = self.yaw()?;
        require_joints(&yaw, joints)?;
        let largest = yaw.largest_angle();
        let expected = "angles in [-pi, pi], in radians: beyond, a link folds through the one ahead";
        require(largest <= PI, "angle", largest, expected)?;
        Ok(Gait::Sampled(yaw))
    }

    /// The reference of a spatial robot, at most `limit` \[rad\]; without pitch angles its joints bend sideways only, or
    /// those given are of its listed axes in turn.
    ///
    /// # Errors
    /// Names the samples that are not admissible.
    pub fn spatial(&self, robot: &Robot, limit: f64) -> Result<CardanGait, ConfigError> {
        if robot.lists_axes && self.pitch.is_none() {
            return self.by_joint(robot)?.spatial(robot, limit);
        }
        let (yaw, pitch) = (self.yaw()?, self.pitch()?);
        for sampled in pitch.iter().chain([&yaw]) {
            require_joints(sampled, robot.joint_count())?;
            let largest = sampled.largest_angle();
            let angle = written(limit);
            let expected = format!("angles in [-{angle}, {angle}], in radians: the joint limit, or a right angle");
            require(largest <= limit + ROUND_OFF, "angle", largest, &expected)?;
        }
        let pitch = pitch.map_or_else(|| Gait::Wave(Wave::still()), Gait::Sampled);
        Ok(CardanGait { yaw: Gait::Sampled(yaw), pitch })
    }

    /// Samples of the axes of a robot that lists them as yaw and pitch of its joints.
    fn by_joint(&self, robot: &Robot) -> Result<Self, ConfigError> {
        let none = vec![0.0; self.time.len()];
        let (count, axes) = (self.yaw.len(), robot.axis_list().count());
        let split = |samples: &[Vec<f64>]| -> Option<(Vec<_>, Vec<_>)> {
            Some(robot.by_joint(samples, &none)?.into_iter().map(<(_, _)>::from).unzip())
        };
        let expected = format!("{axes} angles, one per axis of the robot");
        let refused = || ConfigError::new("angle", format!("{count} angles"), &expected);
        let (yaw, pitch) = split(&self.yaw).ok_or_else(refused)?;
        let rates = self.yaw_rate.as_deref().map(|rates| split(rates).ok_or_else(refused)).transpose()?;
        let (yaw_rate, pitch_rate) = rates.unzip();
        Ok(Self { time: self.time.clone(), yaw, yaw_rate, pitch: Some(pitch), pitch_rate })
    }

    fn yaw(&self) -> Result<SampledReference, ConfigError> {
        SampledReference::new(self.time.clone(), &self.yaw, self.yaw_rate.as_deref())
    }

    fn pitch(&self) -> Result<Option<SampledReference>, ConfigError> {
        let sampled = |pitch| SampledReference::new(self.time.clone(), pitch, self.pitch_rate.as_deref());
        self.pitch.as_deref().map(sampled).transpose()
    }
}

fn require_joints(sampled: &SampledReference, joints: usize) -> Result<(), ConfigError> {
    let count = sampled.joint_count();
    require(count == joints, "angle", format!("{count} joints"), &format!("{joints} joints, as the robot has"))
}

/// References of the yaw angles, or with `vertical` of the pitch angles, at given times: angle, rate and acceleration
/// of (T, joints) each.
///
/// # Errors
/// ConfigError names what is not admissible.
#[pyfunction]
pub fn sampled_reference<'py>(
    py: Python<'py>,
    trajectory: &Bound<'py, PyAny>,
    times: Vec<f64>,
    vertical: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let config: TrajectoryConfig = from_python(trajectory).map_err(|e| CoreError::Config(e.inside("gait")))?;
    let sampled = config.yaw().and_then(|yaw| Ok(if vertical { config.pitch()? } else { Some(yaw) }));
    let sampled = sampled.map_err(|e| CoreError::Config(e.inside("gait")))?;
    let joints = sampled.as_ref().map_or(config.yaw.len(), SampledReference::joint_count);
    let target = |time, joint| sampled.as_ref().map(|sampled| sampled.target(joint, time)).unwrap_or_default();
    let targets: Vec<_> = times.iter().flat_map(|&time| (0..joints).map(move |joint| target(time, joint))).collect();
    let (dict, shape) = (PyDict::new(py), [times.len(), joints]);
    set_array(&dict, "angle", targets.iter().map(|target| target.angle).collect(), &shape)?;
    set_array(&dict, "rate", targets.iter().map(|target| target.rate).collect(), &shape)?;
    set_array(&dict, "acceleration", targets.iter().map(|target| target.acceleration).collect(), &shape)?;
    Ok(dict)
}
