//! What a user writes once for all joints, or joint by joint.

use serde::{Deserialize, Serialize};

use super::{Axes, PerLink};
use crate::error::{ConfigError, require};

/// What all joints have alike or each on its own: of a cardan joint once or for yaw and pitch, of limits once or as (lower,
/// upper).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "one value, or a list with a value or a pair of them for each joint")]
pub enum PerAxis<V = f64> {
    Same(V),
    Each(Vec<PerLink<V>>),
}

impl<V> From<V> for PerAxis<V> {
    fn from(value: V) -> Self {
        Self::Same(value)
    }
}

impl PerAxis {
    /// The largest value.
    pub fn largest(&self) -> f64 {
        self.values().copied().fold(0.0, f64::max)
    }
}

impl<V: Clone> PerAxis<V> {
    /// The values that were given.
    pub fn values(&self) -> impl Iterator<Item = &V> {
        let (same, each) = match self {
            Self::Same(value) => (Some(value), [].as_slice()),
            Self::Each(joints) => (None, joints.as_slice()),
        };
        same.into_iter().chain(each.iter().flat_map(PerLink::values))
    }

    /// What `of_joint` makes of the name and the entry of each of so many joints.
    pub(super) fn by_joint<T: Clone>(
        &self,
        field: &str,
        joints: usize,
        of_joint: impl Fn(usize, &str, &PerLink<V>) -> Result<T, ConfigError>,
    ) -> Result<Vec<T>, ConfigError> {
        let entries = match self {
            Self::Same(value) => {
                let entry = PerLink::Same(value.clone());
                return (0..joints).map(|j| of_joint(j, field, &entry)).collect();
            }
            Self::Each(entries) => entries,
        };
        let expected = format!("one for all, or a list of {joints} entries (one per joint)");
        require(entries.len() == joints, field, format!("{} entries", entries.len()), &expected)?;
        entries.iter().enumerate().map(|(j, entry)| of_joint(j, &format!("{field}[{j}]"), entry)).collect()
    }

    /// The values of yaw and pitch of each joint; a hinge has its value at both places.
    ///
    /// # Errors
    /// Names the joint whose value is not admissible, or the number of entries.
    pub fn expand(
        &self,
        field: &str,
        axes: &[Axes],
        check: impl Fn(&str, &V) -> Result<(), ConfigError>,
    ) -> Result<Vec<[V; 2]>, ConfigError> {
        self.by_joint(field, axes.len(), |joint, field, entry| {
            let values = match (entry, entry.values()) {
                (PerLink::Same(value), _) => [value.clone(), value.clone()],
                (_, [yaw, pitch]) if axes[joint] == Axes::Both => [yaw.clone(), pitch.clone()],
                (_, values) => {
                    let expected = "one value, or (yaw, pitch) of a joint with both axes";
                    return Err(ConfigError::new(field, format!("{} values", values.len()), expected));
                }
            };
            values.iter().try_for_each(|value| check(field, value))?;
            Ok(values)
        })
    }
}
