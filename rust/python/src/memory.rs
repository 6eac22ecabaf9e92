//! Refuses what does not fit into memory, before a failed allocation ends the process.

use std::fs::read_to_string;

use snake_core::ConfigError;
use snake_core::environment::ModelKind;
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

/// A batch, by its model, the links of a robot, the obstacles of its scene and its threads \[bytes\]; measured with 11 and 500
/// links by `test_the_memory_that_is_refused_is_about_what_environments_take`.
pub fn of_batch(model: ModelKind, links: usize, obstacles: usize, num_envs: usize, num_threads: usize) -> f64 {
    let per_link = match model {
        ModelKind::Planar => 1000.0,
        ModelKind::Spatial => 2000.0,
    };
    let workspaces = num_envs.div_ceil(ENVIRONMENTS_PER_WORKSPACE).max(num_threads.min(num_envs));
    num_envs as f64 * (per_link * links as f64 + PER_OBSTACLE * obstacles as f64)
        + workspaces as f64 * PER_LINK_OF_WORKSPACE * links as f64
}

const PER_OBSTACLE: f64 = 32.0;

/// Robots in one, four and eight lanes, and the fewest environments of a large batch that share them.
const PER_LINK_OF_WORKSPACE: f64 = 40_000.0;
const ENVIRONMENTS_PER_WORKSPACE: usize = 64;
