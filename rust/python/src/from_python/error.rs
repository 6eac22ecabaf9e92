//! Why a Python object is not a configuration.

use std::fmt::{self, Display};

use pyo3::prelude::*;
use serde::de::{self, Expected, Unexpected};
use snake_core::ConfigError;

/// What is expected at a path; built from the inside out.
#[derive(Debug)]
pub struct Error {
    /// `.name` and `[3]`, innermost first.
    path: Vec<String>,
    /// The offending value as Python writes it; `None` until the error leaves the object that has it.
    value: Option<String>,
    expected: String,
}

impl Error {
    pub fn new(expected: impl Into<String>) -> Self {
        Self { path: Vec::new(), value: None, expected: expected.into() }
    }

    /// The same error at `value`, unless it is about a part of it.
    pub fn at(mut self, value: &Bound<'_, PyAny>) -> Self {
        self.value.get_or_insert_with(|| written(value));
        self
    }

    /// The same error inside the item `segment`, `.name` or `[3]`.
    pub fn inside(mut self, segment: String) -> Self {
        self.path.push(segment);
        self
    }

    /// The unknown field of a mapping that the error is about, until its value is found.
    pub fn unvalued_field(&self) -> Option<&str> {
        let field = self.path.last().and_then(|segment| segment.strip_prefix('.'));
        field.filter(|_| self.value.is_none())
    }
}

impl From<Error> for ConfigError {
    fn from(error: Error) -> Self {
        let path: String = error.path.into_iter().rev().collect();
        ConfigError::new(path.trim_start_matches('.'), error.value.unwrap_or_default(), error.expected)
    }
}

impl de::Error for Error {
    fn custom<T: Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn invalid_type(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(expected.to_string())
    }

    fn invalid_value(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(expected.to_string())
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::new(expected.to_string())
    }

    fn unknown_variant(_: &str, known: &'static [&'static str]) -> Self {
        Self::new(one_of(known))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Self::new(format!("a known field: {}", known.join(", "))).inside(format!(".{field}"))
    }

    fn missing_field(field: &'static str) -> Self {
        Self { path: vec![format!(".{field}")], value: Some("missing".to_owned()), expected: "a value".to_owned() }
    }
}

/// The names that are admissible, as Python writes them.
pub fn one_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
    if let [only] = &quoted[..] { only.clone() } else { format!("one of {}", quoted.join(", ")) }
}

impl Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.expected)
    }
}

impl std::error::Error for Error {}

/// `repr(value)`, or its type where that fails.
fn written(value: &Bound<'_, PyAny>) -> String {
    let text = value.repr().map(|text| text.to_string_lossy().into_owned());
    text.unwrap_or_else(|_| format!("an object of {}", value.get_type()))
}
