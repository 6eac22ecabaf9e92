//! Limits of the joint angles as a user writes them: the largest angle of a joint to either side, or its least and its
//! largest one, infinite for none; about both axes of a cardan joint \[rad\].

use super::{PerAxis, PerLink};
use crate::error::{ConfigError, require};

impl PerAxis {
    /// Whether any joint has a limit.
    pub fn is_limit(&self) -> bool {
        self.values().any(|limit| limit.is_finite())
    }

    /// Least and largest angle of each of so many joints \[rad\].
    ///
    /// # Errors
    /// Names the joint whose limits cross or leave out the straight joint, or the number of entries.
    pub fn bounds(&self, joints: usize) -> Result<Vec<[f64; 2]>, ConfigError> {
        self.by_joint("joint_limit", joints, |_, field, entry| {
            let (bounds, value) = match entry {
                PerLink::Same(limit) => ([-limit, *limit], limit.to_string()),
                PerLink::Each(values) => {
                    (<[f64; 2]>::try_from(values.as_slice()).unwrap_or([0.0; 2]), format!("{values:?}"))
                }
            };
            let admissible = bounds[0] <= 0.0 && 0.0 <= bounds[1] && bounds[0] < bounds[1];
            let expected = match self {
                Self::Same(_) => "a number > 0, or inf for none",
                Self::Each(_) => "a number > 0, or (lower, upper) with lower <= 0 <= upper and lower < upper",
            };
            require(admissible, field, value, expected)?;
            Ok(bounds)
        })
    }
}
