//! Quantities of joint axes as a user writes them.

use serde::{Deserialize, Serialize};

use super::{Axes, PerLink};
use crate::error::{ConfigError, require};

/// A quantity given once for all joint axes or joint by joint; of a cardan joint once or for yaw and pitch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, or a list of a number or (yaw, pitch) for each joint")]
pub enum PerAxis {
    Same(f64),
    Each(Vec<PerLink>),
}

impl From<f64> for PerAxis {
    fn from(value: f64) -> Self {
        Self::Same(value)
    }
}

impl PerAxis {
    /// The largest value.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(joints) => joints.iter().flat_map(PerLink::values).copied().fold(0.0, f64::max),
        }
    }

    /// The values of yaw and pitch of each joint; a hinge has its value at both places.
    ///
    /// # Errors
    /// Names the joint whose value is not admissible, or the number of entries.
    pub fn expand(
        &self,
        field: &str,
        axes: &[Axes],
        check: impl Fn(&str, f64) -> Result<f64, ConfigError>,
    ) -> Result<Vec<[f64; 2]>, ConfigError> {
        let joints = match self {
            Self::Same(value) => return Ok(vec![[check(field, *value)?; 2]; axes.len()]),
            Self::Each(joints) => joints,
        };
        let expected = format!("a number, or a list of {} entries (one per joint)", axes.len());
        require(joints.len() == axes.len(), field, format!("{} entries", joints.len()), &expected)?;
        let of_joint = |(j, (joint, axes)): (usize, (&PerLink, &Axes))| {
            let field = format!("{field}[{j}]");
            let values = match joint {
                PerLink::Same(value) => [*value; 2],
                PerLink::Each(values) => {
                    let both = <[f64; 2]>::try_from(values.as_slice()).ok().filter(|_| *axes == Axes::Both);
                    let expected = "a number, or (yaw, pitch) of a joint with both axes";
                    require(both.is_some(), &field, format!("{values:?}"), expected)?;
                    both.unwrap_or_default()
                }
            };
            values.iter().try_for_each(|value| check(&field, *value).map(drop))?;
            Ok(values)
        };
        joints.iter().zip(axes).enumerate().map(of_joint).collect()
    }
}
