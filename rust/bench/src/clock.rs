//! CPU time and statistics of repetitions.

use std::ops::AddAssign;
use std::time::Instant;

use cpu_time::{ProcessTime, ThreadTime};

/// Time spent on something \[s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spent {
    /// CPU time of the calling thread: which depends least on the load of the machine.
    pub cpu: f64,
    pub wall: f64,
}

impl AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.cpu += other.cpu;
        self.wall += other.wall;
    }
}

/// Runs `work` on this thread and returns the time it took.
pub fn spent<R>(work: impl FnOnce() -> R) -> (R, Spent) {
    let (cpu, wall) = (ThreadTime::now(), Instant::now());
    let result = work();
    (result, Spent { cpu: cpu.elapsed().as_secs_f64(), wall: wall.elapsed().as_secs_f64() })
}

/// The same for work on several threads: `cpu` is that of the whole process.
pub fn spent_by_all<R>(work: impl FnOnce() -> R) -> (R, Spent) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let result = work();
    (result, Spent { cpu: cpu.elapsed().as_secs_f64(), wall: wall.elapsed().as_secs_f64() })
}

/// The middle value, or the mean of the two in the middle.
///
/// # Panics
/// Without values.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[half] } else { 0.5 * (sorted[half - 1] + sorted[half]) }
}

/// The smallest value that at least `percent` of all do not exceed.
///
/// # Panics
/// Without values.
pub fn percentile(values: &[f64], percent: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (percent / 100.0 * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_does_not_depend_on_order_and_ignores_one_outlier() {
        assert_eq!(median(&[3.0, 1.0, 1e9]), 3.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
    }

    #[test]
    fn percentiles_are_values_that_occur() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!([50.0, 90.0, 99.0, 100.0].map(|p| percentile(&values, p)), [50.0, 90.0, 99.0, 100.0]);
        assert_eq!(percentile(&[7.0], 50.0), 7.0);
        assert_eq!(percentile(&[1.0, 2.0, 3.0], 90.0), 3.0);
    }

    #[test]
    fn a_sleeping_thread_spends_wall_time_but_no_cpu_time() {
        let ((), spent) = spent(|| std::thread::sleep(std::time::Duration::from_millis(30)));
        assert!(spent.wall >= 0.03 && spent.cpu < 0.02, "{spent:?}");
    }
}
