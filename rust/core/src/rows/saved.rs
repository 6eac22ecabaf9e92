//! Stages as files, so that a hard one can be solved again elsewhere.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::math::Real;

/// A stage of either model under a name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedStage<S> {
    /// Where the stage comes from.
    pub name: String,
    pub stage: S,
}

/// A number that can be in a file.
pub trait Saved: Real + Serialize + DeserializeOwned {}

impl<T: Real + Serialize + DeserializeOwned> Saved for T {}

/// Whether a number is left out of a file.
pub fn is_zero<T: Real>(number: &T) -> bool {
    number.lane(0) == 0.0
}

/// A limit that may be infinite, which JSON has no number for: null in the file.
pub mod limit {
    use super::{Deserialize, Deserializer, Real, Serialize, Serializer};

    pub fn serialize<T: Real, S: Serializer>(limit: &T, serializer: S) -> Result<S::Ok, S::Error> {
        let limit = limit.lane(0);
        limit.is_finite().then_some(limit).serialize(serializer)
    }

    pub fn deserialize<'de, T: Real, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
        Ok(T::splat(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY)))
    }
}
