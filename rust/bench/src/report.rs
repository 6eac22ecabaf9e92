//! Results on standard output, one JSON object per line; progress on standard error.

use std::io::Write;

use serde::Serialize;

/// Writes one result, at once.
///
/// # Panics
/// If standard output is closed.
pub fn emit(kind: &str, result: &impl Serialize) {
    let mut line = serde_json::to_value(result).expect("plain data");
    line["kind"] = kind.into();
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).expect("a reader");
}

/// Prints what is being measured to standard error.
pub fn progress(what: &str) {
    eprintln!("{what}");
}
