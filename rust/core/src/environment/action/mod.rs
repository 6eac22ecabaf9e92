//! What an action means: the affine map from [-1, 1] to gait parameters and joint angles.

mod planar;
mod spatial;

use super::filtered_parameter::Limits;
use super::symmetry::Parity;

pub use planar::{planar_entries, wave_entries};
pub use spatial::spatial_entries;

/// Axes of a joint: yaw bends the body sideways, pitch up and down.
pub const YAW: usize = 0;
pub const PITCH: usize = 1;

/// What an entry of the action sets. The waves of both axes share frequency and phase shift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// A of the wave of an axis.
    Amplitude(usize),
    Frequency,
    PhaseShift,
    /// Phase of the wave of an axis relative to that of the yaw angles.
    Phase(usize),
    /// gamma of the wave of an axis.
    Offset(usize),
    /// Angle of one joint about an axis, in addition to the wave.
    Joint {
        axis: usize,
        joint: usize,
    },
}

impl Parameter {
    /// Whether it describes the waves; the others belong to single joints.
    pub fn is_of_wave(self) -> bool {
        !matches!(self, Parameter::Joint { .. })
    }

    pub fn unit(self) -> &'static str {
        if self == Parameter::Frequency { "rad/s" } else { "rad" }
    }

    /// In the reflection the waves run half a turn ahead, which changes the sign of the yaw angles. Pitch angles stay:
    /// the amplitude of their wave makes up for the half turn.
    pub fn parity(self) -> Parity {
        match self {
            Parameter::Frequency | Parameter::PhaseShift | Parameter::Phase(_) => Parity::Even,
            Parameter::Amplitude(axis) => {
                if axis == YAW {
                    Parity::Even
                } else {
                    Parity::Odd
                }
            }
            Parameter::Offset(axis) | Parameter::Joint { axis, .. } => {
                if axis == YAW {
                    Parity::Odd
                } else {
                    Parity::Even
                }
            }
        }
    }
}

/// One entry of the action: `value = centre + half_range * action` for actions in [-1, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct ActionEntry {
    pub name: String,
    pub parameter: Parameter,
    pub centre: f64,
    pub half_range: f64,
    /// Largest rate at which the value follows the action \[unit/s\].
    pub slew: f64,
    pub meaning: &'static str,
}

impl ActionEntry {
    pub fn low(&self) -> f64 {
        self.centre - self.half_range
    }

    pub fn high(&self) -> f64 {
        self.centre + self.half_range
    }

    pub fn limits(&self) -> Limits {
        Limits { low: self.low(), high: self.high(), slew: self.slew }
    }

    /// The physical value of an action in [-1, 1].
    pub fn value(&self, action: f64) -> f64 {
        self.centre + self.half_range * action
    }

    /// The inverse of [`ActionEntry::value`].
    pub fn normalised(&self, value: f64) -> f64 {
        (value - self.centre) / self.half_range
    }
}

/// An entry with its half range and its slew limit in degrees and degrees per second, for a frequency per second more.
fn entry(
    name: impl Into<String>,
    parameter: Parameter,
    centre: f64,
    degrees: [f64; 2],
    meaning: &'static str,
) -> ActionEntry {
    let [half_range, slew] = degrees.map(f64::to_radians);
    ActionEntry { name: name.into(), parameter, centre, half_range, slew, meaning }
}

/// One entry for each joint about an axis; `degrees` as in [`entry`].
fn joint_entries(
    axis: usize,
    joints: usize,
    name: &'static str,
    degrees: [f64; 2],
    meaning: &'static str,
) -> impl Iterator<Item = ActionEntry> {
    (0..joints).map(move |joint| {
        let parameter = Parameter::Joint { axis, joint };
        entry(format!("{name}_{}", joint + 1), parameter, 0.0, degrees, meaning)
    })
}
