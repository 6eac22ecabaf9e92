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
        let dot = if self.field.is_empty() { "" } else { "." };
        self.field = format!("{section}{dot}{}", self.field);
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

/// A finite number of a size whose products do not overflow.
pub fn finite(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite(), field, written(value), "a finite number")?;
    within(field, value, -LARGEST, LARGEST)
}

/// A finite number above zero, of a size whose products and quotients neither overflow nor vanish.
pub fn positive(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite() && value > 0.0, field, written(value), "a finite number > 0")?;
    within(field, value, SMALLEST, LARGEST)
}

/// A finite number, zero or above, of a size whose products do not overflow.
pub fn non_negative(field: &str, value: f64) -> Result<f64, ConfigError> {
    require(value.is_finite() && value >= 0.0, field, written(value), "a finite number >= 0")?;
    within(field, value, 0.0, LARGEST)
}

/// A coordinate \[m\] or an angle \[rad\], of a size at which differences of a nanometre or nanoradian are left.
pub fn coordinate(field: &str, value: f64) -> Result<f64, ConfigError> {
    finite(field, value)?;
    within(field, value, -FARTHEST, FARTHEST)
}

/// A length above zero \[m\].
pub fn length(field: &str, value: f64) -> Result<f64, ConfigError> {
    positive(field, value)?;
    within(field, value, 1.0 / LARGEST, FARTHEST)
}

/// A length, zero or above \[m\].
pub fn length_or_zero(field: &str, value: f64) -> Result<f64, ConfigError> {
    non_negative(field, value)?;
    within(field, value, 0.0, FARTHEST)
}

/// A number in digits, or with an exponent where there would be many.
fn written(value: f64) -> String {
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// Largest number and smallest above zero in a configuration.
const LARGEST: f64 = 1e12;
const SMALLEST: f64 = 1e-15;

/// Largest coordinate and length \[m\].
pub const FARTHEST: f64 = 1e6;

/// A number in the closed interval `[low, high]`.
pub fn within(field: &str, value: f64, low: f64, high: f64) -> Result<f64, ConfigError> {
    let expected = format!("a number in [{}, {}]", written(low), written(high));
    require(value >= low && value <= high, field, written(value), &expected).map(|()| value)
}

/// The length of a step \[s\].
pub fn time_step(field: &str, step: f64) -> Result<f64, ConfigError> {
    positive(field, step)?;
    within(field, step, SHORTEST_STEP, LONGEST_STEP)
}

/// Below the shortest step a robot moves less than the round-off of its position, beyond the longest no motion is
/// resolved \[s\].
const SHORTEST_STEP: f64 = 1e-8;
const LONGEST_STEP: f64 = 1e3;
