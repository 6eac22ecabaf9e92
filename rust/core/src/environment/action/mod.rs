//! What an action means: the affine map from [-1, 1] to gait parameters and joint angles.

mod planar;
mod spatial;

use std::f64::consts::PI;

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
    /// Rate of the reference angle of one joint about an axis.
    JointRate {
        axis: usize,
        joint: usize,
    },
    /// Torque of one actuator about an axis, in place of the controller's.
    JointTorque {
        axis: usize,
        joint: usize,
    },
}

impl Parameter {
    /// Whether it describes the waves; the others belong to single joints.
    pub fn is_of_wave(self) -> bool {
        self.of_joint().is_none()
    }

    /// Axis and joint, of a parameter of a single joint.
    pub fn of_joint(self) -> Option<(usize, usize)> {
        use Parameter::{Joint, JointRate, JointTorque};
        match self {
            Joint { axis, joint } | JointRate { axis, joint } | JointTorque { axis, joint } => Some((axis, joint)),
            _ => None,
        }
    }

    pub fn unit(self) -> &'static str {
        match self {
            Parameter::Frequency | Parameter::JointRate { .. } => "rad/s",
            Parameter::JointTorque { .. } => "N m",
            _ => "rad",
        }
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
            Parameter::Offset(axis)
            | Parameter::Joint { axis, .. }
            | Parameter::JointRate { axis, .. }
            | Parameter::JointTorque { axis, .. } => {
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
    /// Largest rate at which the value follows the action, infinite where it takes it over at once \[unit/s\].
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

/// The most that the joints of a robot give; infinite where nothing limits it.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Of a controller \[N m\].
    pub torque: f64,
    /// No-load speed of the slowest motor \[rad/s\].
    pub rate: f64,
}

impl Reach {
    pub const UNLIMITED: Self = Self { torque: f64::INFINITY, rate: f64::INFINITY };

    /// Largest rates of references about an axis \[deg/s\]: the no-load speed of the motors, of ideal ones [`RATES`].
    fn rate_about(&self, axis: usize) -> f64 {
        if self.rate.is_finite() { self.rate.to_degrees() } else { RATES[axis] }
    }

    /// Half range and slew limit of the frequency around a wave's \[deg/s\], \[deg/s^2\].
    ///
    /// The fastest wave of that amplitude turns a joint at the no-load speed of its motor where it passes the middle.
    /// The range always goes from standstill on; with ideal motors it is 2.5 times the frequency of the thesis's gait.
    fn frequencies(&self, amplitude: f64, omega: f64) -> [f64; 2] {
        let half_range =
            if self.rate.is_finite() { (self.rate / amplitude - omega).max(omega).to_degrees() } else { 120.0 };
        [half_range, 2.0 * half_range]
    }
}

/// What actions set of the joints about one axis.
struct JointAction {
    axis: usize,
    name: &'static str,
    kind: JointKind,
    meaning: &'static str,
}

enum JointKind {
    /// Half range and slew limit in degrees and degrees per second.
    Angle([f64; 2]),
    /// Largest rate in degrees per second, reached in [`SPEED_UP`].
    Rate(f64),
    /// Largest torque \[N m\].
    Torque(f64),
}

impl JointAction {
    fn entry(&self, joint: usize) -> ActionEntry {
        let Self { axis, name, meaning, .. } = *self;
        let name = format!("{name}_{}", joint + 1);
        match self.kind {
            JointKind::Angle(degrees) => entry(name, Parameter::Joint { axis, joint }, 0.0, degrees, meaning),
            JointKind::Rate(largest) => {
                entry(name, Parameter::JointRate { axis, joint }, 0.0, [largest, largest / SPEED_UP], meaning)
            }
            JointKind::Torque(half_range) => {
                let parameter = Parameter::JointTorque { axis, joint };
                ActionEntry { name, parameter, centre: 0.0, half_range, slew: f64::INFINITY, meaning }
            }
        }
    }
}

/// The entries of all joints, in the order of observation and state: joint by joint, its axes in turn.
fn joint_entries(joints: usize, actions: Vec<JointAction>) -> impl Iterator<Item = ActionEntry> {
    (0..joints).flat_map(move |joint| actions.iter().map(|action| action.entry(joint)).collect::<Vec<_>>())
}

/// Half ranges of reference angles and largest rates of joints about each axis \[deg\], \[deg/s\].
const ANGLES: [f64; 2] = [70.0, 45.0];
const RATES: [f64; 2] = [150.0, 100.0];

/// The largest reference angle that actions reach by rates \[rad\].
pub const LARGEST_ANGLE: f64 = 80.0 * PI / 180.0;

/// Time in which a commanded rate may rise from zero to the largest one \[s\].
const SPEED_UP: f64 = 0.1;
