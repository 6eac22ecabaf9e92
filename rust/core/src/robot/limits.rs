//! Limits of the joint angles as a user writes them.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, require};

/// The largest angle of all joints to either side, or the limits of each joint \[rad\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number > 0, inf for none, or a list of a number or (lower, upper) for each joint")]
pub enum JointLimit {
    Same(f64),
    Each(Vec<OneLimit>),
}

/// The largest angle of a joint to either side, or its least and its largest one, infinite for none; about both axes of a
/// cardan joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum OneLimit {
    Either(f64),
    Between(Vec<f64>),
}

impl From<f64> for JointLimit {
    fn from(limit: f64) -> Self {
        Self::Same(limit)
    }
}

impl JointLimit {
    /// Whether any joint has a limit.
    pub fn is_any(&self) -> bool {
        *self != Self::Same(f64::INFINITY)
    }

    /// Least and largest angle of each of so many joints \[rad\].
    ///
    /// # Errors
    /// Names the joint whose limits cross or leave out the straight joint, or the number of entries.
    pub fn expand(&self, joints: usize) -> Result<Vec<[f64; 2]>, ConfigError> {
        let entries = match self {
            Self::Same(limit) => {
                require(*limit > 0.0, "joint_limit", limit, "a number > 0, or inf for none")?;
                return Ok(vec![[-limit, *limit]; joints]);
            }
            Self::Each(entries) => entries,
        };
        let expected = format!("a number, or a list of {joints} entries (one per joint)");
        require(entries.len() == joints, "joint_limit", format!("{} entries", entries.len()), &expected)?;
        let bounds = |(j, entry): (usize, &OneLimit)| {
            let (bounds, value) = match entry {
                OneLimit::Either(limit) => ([-limit, *limit], limit.to_string()),
                OneLimit::Between(values) => {
                    (<[f64; 2]>::try_from(values.as_slice()).unwrap_or([0.0; 2]), format!("{values:?}"))
                }
            };
            let admissible = bounds[0] <= 0.0 && 0.0 <= bounds[1] && bounds[0] < bounds[1];
            let expected = "a number > 0, or (lower, upper) with lower <= 0 <= upper and lower < upper";
            require(admissible, &format!("joint_limit[{j}]"), value, expected)?;
            Ok(bounds)
        };
        entries.iter().enumerate().map(bounds).collect()
    }
}
