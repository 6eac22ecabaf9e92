//! The error of an invalid configuration: it names the field, the value and the admissible range.

use std::fmt;

use serde::Deserializer;
use serde::de::{self, Unexpected, Visitor};

/// A rejected configuration value.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigError {
    /// Path of the field as the user writes it, e.g. `robot.mass`.
    pub field: String,
    /// The offending value.
    pub value: String,
    /// The admissible range, in words.
    pub expected: String,
}

impl ConfigError {
    pub fn new(field: impl Into<String>, value: impl ToString, expected: impl Into<String>) -> Self {
        Self { field: field.into(), value: value.to_string(), expected: expected.into() }
    }

    /// The same error with the field placed inside a section: `mass` becomes `robot.mass`.
    pub fn inside(mut self, section: &str) -> Self {
        self.field = format!("{section}.{}", self.field);
        self
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}: expected {}", self.field, self.value, self.expected)
    }
}

impl std::error::Error for ConfigError {}

/// Rejects `value` unless `ok`.
pub fn require(ok: bool, field: &str, value: impl ToString, expected: &str) -> Result<(), ConfigError> {
    if ok { Ok(()) } else { Err(ConfigError::new(field, value, expected)) }
}

/// Reads an integer within a range; the error for any other value names the range.
///
/// # Errors
/// The value is not such an integer.
pub fn integer_in<'de, D: Deserializer<'de>, const LOW: usize, const HIGH: usize>(
    deserializer: D,
) -> Result<usize, D::Error> {
    struct InRange<const LOW: usize, const HIGH: usize>;

    impl<const LOW: usize, const HIGH: usize> Visitor<'_> for InRange<LOW, HIGH> {
        type Value = usize;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "an integer in [{LOW}, {HIGH}]")
        }

        fn visit_u64<E: de::Error>(self, value: u64) -> Result<usize, E> {
            let inside = usize::try_from(value).ok().filter(|value| (LOW..=HIGH).contains(value));
            inside.ok_or_else(|| E::invalid_value(Unexpected::Unsigned(value), &self))
        }

        fn visit_i64<E: de::Error>(self, value: i64) -> Result<usize, E> {
            let unsigned = u64::try_from(value).map_err(|_| E::invalid_value(Unexpected::Signed(value), &self));
            self.visit_u64(unsigned?)
        }
    }

    deserializer.deserialize_any(InRange::<LOW, HIGH>)
}

/// A finite number.
pub fn finite(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite(), field, value, "a finite number").map(|()| value)
}

/// A finite number above zero.
pub fn positive(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite() && value > 0.0, field, value, "a finite number > 0").map(|()| value)
}

/// A finite number, zero or above.
pub fn non_negative(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite() && value >= 0.0, field, value, "a finite number >= 0").map(|()| value)
}

/// A number in the closed interval `[low, high]`.
pub fn within(field: &str, value: f64, low: f64, high: f64) -> Result<f64, ConfigError> {
    let expected = format!("a number in [{low}, {high}]");
    require(value >= low && value <= high, field, value, &expected).map(|()| value)
}
