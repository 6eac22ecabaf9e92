//! The axes about which the joints of a robot turn.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, require};

/// The axes of one joint, fixed in the frames of both links, which are parallel where its angles are zero. An axis that
/// a joint does not have is no degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Axes {
    /// A cardan joint: yaw about e_y of the link before it, then pitch about e_x of the link behind.
    #[default]
    Both,
    /// A hinge about e_y.
    Yaw,
    /// A hinge about e_x.
    Pitch,
    /// A hinge about another unit vector of the link frame; e_z, along the link, is roll.
    About([f64; 3]),
}

/// Of two values for each joint with these axes, those of the axes that there are.
pub fn of_axes<'a>(axes: &'a [Axes], values: impl Iterator<Item = [f64; 2]> + 'a) -> impl Iterator<Item = f64> + 'a {
    let of_joint = |(axes, values): (&Axes, [f64; 2])| [0, 1].map(|axis| axes.has(axis).then_some(values[axis]));
    axes.iter().zip(values).flat_map(of_joint).flatten()
}

impl Axes {
    /// A hinge along the link.
    pub const ROLL: Self = Self::About([0.0, 0.0, 1.0]);

    /// Whether the joint has the axis: the first is yaw, the second pitch, and that of another hinge counts as pitch where
    /// it is nearest to e_x.
    #[inline(always)]
    pub fn has(self, axis: usize) -> bool {
        self.only().is_none_or(|only| axis == only)
    }

    /// The axis of a joint that has one.
    #[inline(always)]
    pub fn only(self) -> Option<usize> {
        match self {
            Self::Both => None,
            Self::Yaw => Some(0),
            Self::Pitch => Some(1),
            Self::About([x, y, z]) => Some(usize::from(x.abs() > y.abs().max(z.abs()))),
        }
    }

    /// The value of a single axis at its place, and zero at the other.
    pub fn at_own_place(self, value: f64) -> [f64; 2] {
        [0, 1].map(|axis| if self.has(axis) { value } else { 0.0 })
    }

    /// Whether waves that run along the robot pass the joint by: they bend it, and it twists.
    pub fn only_twists(self) -> bool {
        let Self::About([x, y, z]) = self else { return false };
        z.abs() > x.abs().max(y.abs())
    }

    /// The name of an axis in the elements of actions and observations.
    pub fn name(self, axis: usize) -> &'static str {
        match self {
            Self::ROLL => "roll",
            Self::About(_) => "axis",
            _ => ["yaw", "pitch"][axis],
        }
    }

    /// Whether horizontal waves bend the joint.
    pub fn yaws(self) -> bool {
        self.has(0) && !self.only_twists()
    }

    /// The axes with a name.
    fn named(field: &str, name: &str) -> Result<Self, ConfigError> {
        match name {
            "both" => Ok(Self::Both),
            "yaw" => Ok(Self::Yaw),
            "pitch" => Ok(Self::Pitch),
            "roll" => Ok(Self::ROLL),
            _ => Err(ConfigError::new(field, format!("{name:?}"), EXPECTED)),
        }
    }

    /// A hinge about a vector of the link frame of any length.
    fn about(field: &str, vector: &[f64]) -> Result<Self, ConfigError> {
        let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
        let [x, y, z] = match vector {
            &[x, y, z] if length.is_finite() && length > SHORTEST => [x, y, z],
            _ => return Err(ConfigError::new(field, format!("{vector:?}"), EXPECTED)),
        };
        Ok(match [x / length, y / length, z / length] {
            [0.0, 1.0, 0.0] => Self::Yaw,
            [1.0, 0.0, 0.0] => Self::Pitch,
            axis => Self::About(axis),
        })
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Both => f.write_str("\"both\""),
            Self::Yaw => f.write_str("\"yaw\""),
            Self::Pitch => f.write_str("\"pitch\""),
            Self::About(axis) => write!(f, "{axis:?}"),
        }
    }
}

/// The axes of all joints as a user writes them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "\"both\", \"yaw\", \"pitch\" or \"roll\", or a list of these and of vectors, one per joint"
)]
pub enum AxesConfig {
    Same(String),
    Each(Vec<OneJoint>),
}

/// The axes of one joint as a user writes them: a name, or the vector of a single axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum OneJoint {
    Named(String),
    About(Vec<f64>),
}

impl Default for AxesConfig {
    fn default() -> Self {
        Self::Same("both".to_owned())
    }
}

impl AxesConfig {
    /// The axes of each of so many joints.
    ///
    /// # Errors
    /// Names the joint without such an axis, or the number of entries.
    pub fn expand(&self, joints: usize) -> Result<Vec<Axes>, ConfigError> {
        let entries = match self {
            Self::Same(name) => return Ok(vec![Axes::named("axes", name)?; joints]),
            Self::Each(entries) => entries,
        };
        let expected = format!("\"both\", or a list of {joints} entries (one per joint)");
        require(entries.len() == joints, "axes", format!("{} entries", entries.len()), &expected)?;
        let axes = |(j, entry): (usize, &OneJoint)| match entry {
            OneJoint::Named(name) => Axes::named(&format!("axes[{j}]"), name),
            OneJoint::About(vector) => Axes::about(&format!("axes[{j}]"), vector),
        };
        entries.iter().enumerate().map(axes).collect()
    }
}

/// What describes the axes of one joint.
const EXPECTED: &str =
    "\"both\", \"yaw\", \"pitch\", \"roll\" or one vector (x, y, z) of the link frame other than zero";

/// Length from which on a vector has a direction.
const SHORTEST: f64 = 1e-9;
