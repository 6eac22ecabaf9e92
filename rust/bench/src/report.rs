//! Results on standard output, one JSON object a line; progress on standard error.

use std::io::Write;

use serde::Serialize;

/// Writes one result, at once.
///
/// # Panics
/// If nobody reads any more.
pub fn emit(kind: &str, result: &impl Serialize) {
    let mut line = serde_json::to_value(result).expect("plain data");
    line["kind"] = kind.into();
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).expect("a reader");
}

/// Says what is being done.
pub fn progress(what: &str) {
    eprintln!("{what}");
}
