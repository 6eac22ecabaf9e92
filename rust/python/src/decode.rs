//! Configurations from JSON text, and why one is none.

use serde::de::DeserializeOwned;
use serde_json::Value;
use snake_core::ConfigError;

/// Parses a configuration.
///
/// # Errors
/// Names the field that is unknown or of the wrong type.
pub fn decode<T: DeserializeOwned>(json: &str) -> Result<T, ConfigError> {
    parse(json).map_err(|(path, message)| {
        let vague = [NOT_TEXT, TOO_LONG].contains(&message.as_str());
        let message = if vague { wanted::<T>(json, &path).unwrap_or(message) } else { message };
        explain(json, &path, &message)
    })
}

/// The configuration, or the path and the message of what is wrong.
fn parse<T: DeserializeOwned>(json: &str) -> Result<T, (String, String)> {
    let mut deserializer = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let message = error.inner().to_string();
        let message = message.split(" at line ").next().unwrap_or_default();
        (error.path().to_string().trim_start_matches('.').to_owned(), message.to_owned())
    })
}

/// What serde_json says of anything else where one of several names is wanted.
const NOT_TEXT: &str = "expected value";

/// What it says of more elements than an array has.
const TOO_LONG: &str = "trailing characters";

/// The message that names what is wanted at `path`: that of a text that cannot be it.
fn wanted<T: DeserializeOwned>(json: &str, path: &str) -> Option<String> {
    let mut root: Value = serde_json::from_str(json).ok()?;
    *root.pointer_mut(&pointer(path))? = Value::String(String::new());
    parse::<T>(&root.to_string()).err().map(|(_, message)| message)
}

/// Turns serde's message at `path` into field, value and what is expected.
fn explain(json: &str, path: &str, message: &str) -> ConfigError {
    let (complaint, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    if let Some(name) = complaint.strip_prefix("unknown field ") {
        let name = name.trim_matches('`');
        let parent = path.strip_suffix(name).unwrap_or(path).trim_end_matches('.');
        let field = if parent.is_empty() { name.to_owned() } else { format!("{parent}.{name}") };
        let value = value_at(json, &field);
        return ConfigError::new(field, value, format!("a known field: {}", expected.trim_start_matches("one of ")));
    }
    ConfigError::new(path, value_at(json, path), in_words(if expected.is_empty() { complaint } else { expected }))
}

fn in_words(kind: &str) -> String {
    match kind {
        "f64" => "a finite number".to_owned(),
        "usize" | "u32" | "u64" => "an integer >= 0".to_owned(),
        NOT_TEXT => "text".to_owned(),
        _ => match kind.split_once(' ') {
            Some(("struct", "NoiseConfig")) => "a snake_env.Noise, or a mapping of field names to values".to_owned(),
            Some(("struct", _)) => "a mapping of field names to values".to_owned(),
            Some(("an", rest)) => match rest.strip_prefix("array of length ") {
                Some(length) => format!("{length} numbers"),
                None => kind.to_owned(),
            },
            _ => kind.to_owned(),
        },
    }
}

/// The value at a path such as `scene.obstacles[2][0]`, as the user would write it.
fn value_at(json: &str, path: &str) -> String {
    let root: Value = serde_json::from_str(json).unwrap_or(Value::Null);
    let value = if path.is_empty() { Some(&root) } else { root.pointer(&pointer(path)) };
    match value {
        Some(Value::String(text)) if ["nan", "inf", "-inf"].contains(&text.as_str()) => text.clone(),
        Some(value) => value.to_string(),
        None => "?".to_owned(),
    }
}

/// A path as a JSON pointer.
fn pointer(path: &str) -> String {
    path.split(['.', '[']).map(|part| format!("/{}", part.trim_end_matches(']'))).collect()
}
