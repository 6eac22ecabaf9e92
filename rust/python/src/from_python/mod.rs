//! Configurations from Python objects: mappings, dataclasses, sequences, numbers and text.
//!
//! A serde data format whose errors carry the path and the value of what is not admissible.

mod access;
mod deserializer;
mod error;

use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use snake_core::ConfigError;

pub use deserializer::field_of;

use deserializer::Deserializer;

/// Reads a configuration.
///
/// # Errors
/// Names the field that is unknown, missing or of the wrong type, its value and what is admissible.
pub fn from_python<T: DeserializeOwned>(value: &Bound<'_, PyAny>) -> Result<T, ConfigError> {
    T::deserialize(Deserializer::new(value)).map_err(|error| error.at(value).into())
}
