//! Steps of the spatial environments a second, on one thread.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::batch::{Batch, Outputs};
use snake_core::task::random::Stream;
use snake_core::task::{EnvConfig, Model, SpatialMachine, Task};

use crate::clock::{median, spent};
use crate::report::{emit, progress};

/// Throughput of one environment with one number of rows.
#[derive(Debug, Serialize)]
struct Throughput {
    environment: &'static str,
    actions: &'static str,
    rows: usize,
    /// Control periods of one robot per CPU second of one thread.
    steps_per_second: f64,
    /// Simulated seconds per CPU second.
    speed: f64,
    repetitions: usize,
}

/// Steps before the clock starts, which leave the start behind, and of one repetition.
const WARM_UP: usize = 20;
const STEPS: usize = 20;

/// Emits the throughput of `SnakeSpatial-v0` by rows, under the gait and under random actions.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure(quick: bool) -> Result<(), ConfigError> {
    let rows: &[usize] = if quick { &[1, 64] } else { &[1, 2, 4, 8, 16, 64, 256] };
    for (actions, amplitude) in [("gait", 0.0), ("random", 1.0)] {
        for &rows in rows {
            progress(&format!("SnakeSpatial-v0: {rows} rows, {actions}"));
            emit("spatial-throughput", &measure_rows(rows, actions, amplitude, if quick { 1 } else { 5 })?);
        }
    }
    Ok(())
}

fn measure_rows(
    rows: usize,
    actions: &'static str,
    amplitude: f64,
    repetitions: usize,
) -> Result<Throughput, ConfigError> {
    let config = EnvConfig { model: Model::Spatial, task: Task::Free, ..EnvConfig::default() };
    let mut robots = Robots::new(&config, rows, amplitude)?;
    robots.run(WARM_UP);
    let times: Vec<f64> = (0..repetitions).map(|_| spent(|| robots.run(STEPS)).1.cpu).collect();
    let steps_per_second = (rows * STEPS) as f64 / median(&times);
    Ok(Throughput {
        environment: "SnakeSpatial-v0",
        actions,
        rows,
        steps_per_second,
        speed: steps_per_second * config.control_period,
        repetitions,
    })
}

/// A batch of robots in space under actions of an amplitude.
struct Robots {
    batch: Batch<SpatialMachine>,
    amplitude: f64,
    stream: Stream,
    action: Vec<f64>,
    arrays: Arrays,
}

struct Arrays {
    observation: Vec<f32>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    signals: Vec<f64>,
}

impl Arrays {
    fn outputs(&mut self) -> Outputs<'_> {
        Outputs {
            observation: &mut self.observation,
            reward: &mut self.reward,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            signals: &mut self.signals,
        }
    }
}

impl Robots {
    fn new(config: &EnvConfig, rows: usize, amplitude: f64) -> Result<Self, ConfigError> {
        let mut batch = Batch::<SpatialMachine>::new(config, rows, 1)?;
        let mut arrays = Arrays {
            observation: vec![0.0; rows * batch.observation_size()],
            reward: vec![0.0; rows],
            terminated: vec![false; rows],
            truncated: vec![false; rows],
            signals: vec![0.0; rows * batch.signal_kinds().count()],
        };
        let seeds: Vec<_> = (0..rows as u64).map(Some).collect();
        batch.reset(&vec![true; rows], &seeds, arrays.outputs());
        let action = vec![0.0; rows * batch.action_size()];
        Ok(Self { batch, amplitude, stream: Stream::new(20, 0), action, arrays })
    }

    fn run(&mut self, steps: usize) {
        let active = vec![true; self.arrays.reward.len()];
        for _ in 0..steps {
            self.action.iter_mut().for_each(|value| *value = self.stream.around_zero(self.amplitude));
            self.batch.step(&self.action, &active, self.arrays.outputs());
        }
    }
}
