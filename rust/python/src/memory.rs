//! Refuses what does not fit into memory, before a failed allocation ends the process.

use std::fs::read_to_string;

use snake_core::ConfigError;
use snake_core::error::require;

/// # Errors
/// `bytes` are not free; the error names `field` and what needs them.
pub fn require_memory(field: &str, value: impl ToString, what: &str, bytes: f64) -> Result<(), ConfigError> {
    let free = free();
    let gigabytes = |bytes: f64| format!("{:.3} GB", bytes / 1e9);
    let expected =
        format!("what fits into memory: {what} need about {}, {} are free", gigabytes(bytes), gigabytes(free));
    require(bytes < free, field, value, &expected)
}

/// Memory that this process can still have \[bytes\]: what the system has free within the limit of its control group; no
/// more than a process can address where neither can be read.
fn free() -> f64 {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let system = read_to_string("/proc/meminfo").ok().and_then(|table| {
        let row = table.lines().find_map(|row| row.strip_prefix("MemAvailable:"))?;
        number(row.trim_end_matches("kB")).map(|kilobytes| 1024.0 * kilobytes)
    });
    let of_group = |name: &str| number(&read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?);
    let group = of_group("memory.max").zip(of_group("memory.current")).map(|(most, used)| most - used);
    [system, group].into_iter().flatten().fold(ADDRESSABLE, f64::min)
}

const ADDRESSABLE: f64 = isize::MAX as f64;

/// An environment of a batch, by its links and by the obstacles of its scene \[bytes\]; measured with 11 to 10,000 links.
pub fn of_environment(links: usize, obstacles: usize) -> f64 {
    PER_LINK * links as f64 + PER_OBSTACLE * obstacles as f64
}

const PER_LINK: f64 = 5200.0;
const PER_OBSTACLE: f64 = 32.0;
