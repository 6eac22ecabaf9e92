//! Certified accuracy of stages, and the work they take.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::environment::{EnvConfig, FieldKind, Task};
use snake_core::gait::Wave;
use snake_core::planar::Planar;
use snake_core::stepping::{ImplicitConfig, Model};

use crate::clock::percentile;
use crate::environments::{Actions, Robots};
use crate::reference::Sampled;
use crate::report::{emit, progress};
use crate::scenes::Scenario;

/// Statistics over all intervals of some motion.
#[derive(Serialize)]
struct Statistics<'a> {
    what: &'a str,
    /// Length of an interval: a step in the scenes, a control period in the environments \[s\].
    interval: f64,
    robots: usize,
    steps: u64,
    percent: [f64; 4],
    /// Worst certified residual of the stages of an interval \[m/s\].
    residual: [f64; 4],
    /// Worst duality gap of the stages of an interval \[J\].
    gap: [f64; 4],
    /// Linear solves for each step, mean of the interval.
    iterations: [f64; 4],
    /// Steps, and parts of steps, retaken because a peg's force changed abruptly, and unconverged stages, in
    /// all.
    events: u64,
    misses: u64,
    /// Intervals with an unconverged stage, and intervals with a residual above the tolerance asked for.
    missed_intervals: u64,
    above_tolerance: u64,
    /// Robots whose state became implausible.
    diverged: u64,
}

const PERCENT: [f64; 4] = [50.0, 90.0, 99.0, 100.0];

/// Statistics of the scenes under the thesis's gait and of random fields under random actions.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure(scenes: &[Scenario], quick: bool) -> Result<(), ConfigError> {
    for scenario in scenes {
        progress(&format!("certificate: {}", scenario.name));
        let mut sample = Sample::default();
        let integrator = ImplicitConfig::default();
        let mut simulation = scenario.simulation(&integrator)?;
        for _ in 0..integrator.steps_in(scenario.duration) {
            let report = simulation.advance(integrator.step(), &Wave::default());
            sample.add(report.steps, report.iterations, report.events, report.unconverged, report.residual, report.gap);
            sample.diverged += u64::from(report.diverged);
        }
        emit("certificate", &sample.statistics(scenario.title, integrator.step(), 1));
    }
    let (rows, steps) = if quick { (64, 40) } else { (512, 400) };
    for (title, field) in FIELDS {
        progress(&format!("certificate: {title}"));
        let config = EnvConfig { task: Task::FIELD, field, difficulty: 1.0, ..EnvConfig::default() };
        let sample = random_motion(&config, rows, steps)?;
        emit("certificate", &sample.statistics(title, config.control_period, rows));
    }
    Ok(())
}

const FIELDS: [(&str, FieldKind); 3] = [
    ("random tracks, random actions", FieldKind::Track),
    ("random lattices, random actions", FieldKind::Lattice),
    ("random discs, random actions", FieldKind::Poisson),
];

/// Random actions in random fields on all cores.
fn random_motion(config: &EnvConfig, rows: usize, steps: usize) -> Result<Sample, ConfigError> {
    let mut robots = Robots::new(config, rows, 0, Actions::Random)?;
    let mut sample = Sample::default();
    for _ in 0..steps {
        robots.step();
        for row in 0..rows {
            let body = robots.batch.environment(row).simulation().body();
            let statistics = &body.statistics;
            sample.add(
                statistics.steps,
                statistics.iterations,
                statistics.events,
                statistics.unconverged,
                statistics.residual,
                statistics.gap,
            );
            sample.diverged += u64::from(body.statistics.diverged);
        }
    }
    Ok(sample)
}

/// Figures of every interval.
#[derive(Default)]
struct Sample {
    residual: Vec<f64>,
    gap: Vec<f64>,
    iterations: Vec<f64>,
    steps: u64,
    events: u64,
    misses: u64,
    missed_intervals: u64,
    above_tolerance: u64,
    diverged: u64,
}

impl Sample {
    /// Adds an interval; one without a step, where an episode has just begun, does not count.
    fn add(&mut self, steps: u32, iterations: u32, events: u32, misses: u32, residual: f64, gap: f64) {
        if steps == 0 {
            return;
        }
        self.residual.push(residual);
        self.gap.push(gap);
        self.iterations.push(f64::from(iterations) / f64::from(steps));
        self.steps += u64::from(steps);
        self.events += u64::from(events);
        self.misses += u64::from(misses);
        self.missed_intervals += u64::from(misses > 0);
        self.above_tolerance += u64::from(residual > Planar::ACCURACY.tolerance);
    }

    fn statistics<'a>(&self, what: &'a str, interval: f64, robots: usize) -> Statistics<'a> {
        let of = |values: &[f64]| PERCENT.map(|percent| percentile(values, percent));
        Statistics {
            what,
            interval,
            robots,
            steps: self.steps,
            percent: PERCENT,
            residual: of(&self.residual),
            gap: of(&self.gap),
            iterations: of(&self.iterations),
            events: self.events,
            misses: self.misses,
            missed_intervals: self.missed_intervals,
            above_tolerance: self.above_tolerance,
            diverged: self.diverged,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_count_what_happened_and_leave_out_what_did_not() {
        let mut sample = Sample::default();
        sample.add(5, 20, 1, 0, 1e-9, 1e-12);
        sample.add(5, 40, 0, 2, 3e-4, -1e-13);
        sample.add(0, 7, 7, 7, 7.0, 7.0);
        let statistics = sample.statistics("test", 0.05, 1);
        assert_eq!(
            (statistics.steps, statistics.events, statistics.misses, statistics.missed_intervals),
            (10, 1, 2, 1)
        );
        assert_eq!(statistics.iterations, [4.0, 8.0, 8.0, 8.0]);
        assert_eq!((statistics.residual[3], statistics.above_tolerance), (3e-4, 1));
    }
}
