//! Many environments stepped side by side.
//!
//! Each row is an environment of its own: its results depend on its seed, its episode and its actions,
//! never on the number of rows or threads, bit for bit. A row that diverges or panics is flagged and
//! leaves its neighbours alone.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;

use crate::error::{ConfigError, require};
use crate::task::signal::{COUNT, SIGNALS, SignalRow};
use crate::task::{EnvConfig, Environment, EnvironmentState, Outcome};

/// Environments of one configuration.
#[derive(Debug)]
pub struct Batch {
    /// A fresh environment, to replace one that panicked.
    prototype: Environment,
    rows: Vec<Row>,
    workers: Workers,
}

#[derive(Debug)]
struct Row {
    environment: Environment,
    outcome: Outcome,
}

/// Where a batch writes; `n` rows, all arrays contiguous. Rows that are not active stay untouched.
pub struct Outputs<'a> {
    /// (n, observation_size), row by row.
    pub observation: &'a mut [f32],
    /// (n)
    pub reward: &'a mut [f64],
    /// (n)
    pub terminated: &'a mut [bool],
    /// (n)
    pub truncated: &'a mut [bool],
    /// (signals, n): one contiguous row for each signal.
    pub signals: &'a mut [f64],
}

impl Batch {
    /// `num_envs` environments at the start of episode 0 of seed 0. With `num_threads` = 1 no thread is
    /// ever started; 0 takes as many as the machine has cores.
    ///
    /// # Errors
    /// Names the field of the configuration, its value and the admissible range.
    pub fn new(config: &EnvConfig, num_envs: usize, num_threads: usize) -> Result<Self, ConfigError> {
        require((1..=MAX_ENVS).contains(&num_envs), "num_envs", num_envs, "an integer in [1, 1000000]")?;
        require(num_threads <= MAX_THREADS, "num_threads", num_threads, "an integer in [0, 1024]")?;
        let prototype = Environment::new(config)?;
        let row = |_| Row { environment: prototype.clone(), outcome: prototype.outcome() };
        let rows = (0..num_envs).map(row).collect();
        Ok(Self { prototype, rows, workers: Workers::new(num_threads) })
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Never: a batch has at least one row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn num_threads(&self) -> usize {
        self.workers.count
    }

    pub fn observation_size(&self) -> usize {
        self.prototype.observation_size()
    }

    pub fn action_size(&self) -> usize {
        self.prototype.action_size()
    }

    /// The environment of a row, for rendering; its layout is that of all rows.
    pub fn environment(&self, row: usize) -> &Environment {
        &self.rows[row].environment
    }

    /// Starts an episode in the rows of `mask`, with the seed given or as the next one of the row.
    ///
    /// # Panics
    /// If an array has not the length that [`Outputs`] states.
    pub fn reset(&mut self, mask: &[bool], seeds: &[Option<u64>], out: Outputs) {
        assert_eq!(seeds.len(), self.len(), "one seed a row");
        self.for_active_rows(mask, out, |row, environment, observation| environment.reset(seeds[row], observation));
    }

    /// One control period in the active rows; `actions` is (n, action_size), row by row, finite.
    ///
    /// # Panics
    /// If an array has not the length that [`Outputs`] states.
    pub fn step(&mut self, actions: &[f64], active: &[bool], out: Outputs) {
        let size = self.action_size();
        assert_eq!(actions.len(), self.len() * size, "one action a row");
        self.for_active_rows(active, out, |row, environment, observation| {
            environment.step(&actions[row * size..(row + 1) * size], observation)
        });
    }

    /// Writes the current observation of a row.
    pub fn observe(&mut self, row: usize, observation: &mut [f32]) {
        self.rows[row].environment.observe(observation);
    }

    /// Everything that changes in a row.
    pub fn save(&self, row: usize) -> EnvironmentState {
        self.rows[row].environment.save()
    }

    /// Continues a row from a saved state.
    ///
    /// # Errors
    /// The state is of an environment of another configuration.
    pub fn restore(&mut self, row: usize, state: &EnvironmentState) -> Result<(), ConfigError> {
        let row = &mut self.rows[row];
        row.environment.restore(state)?;
        row.outcome = row.environment.outcome();
        Ok(())
    }

    fn for_active_rows<F>(&mut self, active: &[bool], out: Outputs, advance: F)
    where
        F: Fn(usize, &mut Environment, &mut [f32]) -> Outcome + Sync,
    {
        let (n, size) = (self.len(), self.observation_size());
        assert_eq!(active.len(), n, "one flag a row");
        assert_eq!(out.observation.len(), n * size, "one observation a row");
        assert!(out.reward.len() == n && out.terminated.len() == n && out.truncated.len() == n, "one value a row");
        assert_eq!(out.signals.len(), COUNT * n, "one value a row and signal");
        let prototype = &self.prototype;
        let visit = |index: usize, row: &mut Row, observation: &mut [f32]| {
            if active[index] {
                row.contained(prototype, observation, |environment, observation| advance(index, environment, observation));
            }
        };
        let work = active.iter().filter(|active| **active).count();
        let rows = &mut self.rows;
        match self.workers.pool(work) {
            None => {
                let rows = rows.iter_mut().zip(out.observation.chunks_exact_mut(size)).enumerate();
                rows.for_each(|(index, (row, observation))| visit(index, row, observation));
            }
            Some(pool) => {
                let chunk = (n / (CHUNKS_PER_THREAD * pool.current_num_threads())).max(1);
                let rows = rows.par_iter_mut().zip(out.observation.par_chunks_exact_mut(size)).enumerate();
                let rows = rows.with_min_len(chunk);
                pool.install(|| rows.for_each(|(index, (row, observation))| visit(index, row, observation)));
            }
        }
        self.write_outcomes(active, out);
    }

    fn write_outcomes(&self, active: &[bool], out: Outputs) {
        let n = self.len();
        for (index, row) in self.rows.iter().enumerate().filter(|(index, _)| active[*index]) {
            let outcome = &row.outcome;
            out.reward[index] = outcome.reward;
            out.terminated[index] = outcome.terminated;
            out.truncated[index] = outcome.truncated;
            for (signal, value) in outcome.signals.iter().enumerate() {
                out.signals[signal * n + index] = *value;
            }
        }
    }
}

impl Row {
    /// Runs `advance`; if it panics the environment is replaced, its row ends flagged as diverged.
    fn contained(
        &mut self,
        prototype: &Environment,
        observation: &mut [f32],
        advance: impl FnOnce(&mut Environment, &mut [f32]) -> Outcome,
    ) {
        let environment = &mut self.environment;
        let result = catch_unwind(AssertUnwindSafe(|| advance(environment, observation)));
        self.outcome = result.unwrap_or_else(|_| {
            environment.recover(prototype);
            observation.fill(0.0);
            broken()
        });
    }
}

/// The outcome of a row that panicked.
fn broken() -> Outcome {
    let mut signals: SignalRow = [0.0; COUNT];
    let flag = SIGNALS.iter().position(|signal| signal.name == "diverged");
    flag.into_iter().for_each(|flag| signals[flag] = 1.0);
    Outcome { reward: 0.0, terminated: true, truncated: false, signals }
}

/// The threads of a batch, started at first use and once more in a forked child, where the parent's
/// threads do not exist.
#[derive(Debug)]
struct Workers {
    count: usize,
    process: u32,
    pool: Option<rayon::ThreadPool>,
}

impl Workers {
    fn new(count: usize) -> Self {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        Self { count: if count == 0 { cores() } else { count }, process: std::process::id(), pool: None }
    }

    /// The pool, or `None` where the calling thread does the work itself: with one thread, with little
    /// to do, and where no threads can be started.
    fn pool(&mut self, work: usize) -> Option<&rayon::ThreadPool> {
        if self.count == 1 || work < MIN_PARALLEL_ROWS {
            return None;
        }
        if self.process != std::process::id() {
            self.abandon();
        }
        if self.pool.is_none() {
            self.pool = rayon::ThreadPoolBuilder::new().num_threads(self.count).build().ok();
        }
        self.pool.as_ref()
    }

    /// Leaves the pool of the parent process alone: its locks may be held by threads that are gone.
    fn abandon(&mut self) {
        std::mem::forget(self.pool.take());
        self.process = std::process::id();
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            self.abandon();
        }
    }
}

/// Fewer rows than this are not worth waking threads, which takes about 13 us.
const MIN_PARALLEL_ROWS: usize = 4;

/// Rows are handed out in so many portions a thread, since some take longer than others.
const CHUNKS_PER_THREAD: usize = 4;

/// Guards against typing errors.
const MAX_ENVS: usize = 1_000_000;
const MAX_THREADS: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_that_panics_ends_flagged_and_starts_afresh() {
        let prototype = Environment::new(&EnvConfig::default()).unwrap();
        let mut row = Row { environment: prototype.clone(), outcome: prototype.outcome() };
        let mut observation = vec![0.5; prototype.observation_size()];
        row.environment.reset(Some(9), &mut observation);
        row.contained(&prototype, &mut observation, |_, _| panic!("a defect in one row"));
        assert!(row.outcome.terminated && observation.iter().all(|value| *value == 0.0));
        let mut expected = prototype.clone();
        let mut second = observation.clone();
        expected.reset(Some(9), &mut second);
        row.contained(&prototype, &mut observation, |environment, observation| environment.reset(None, observation));
        expected.reset(None, &mut second);
        assert_eq!(observation, second, "the row goes on with the next episode of its seed");
    }

    #[test]
    fn a_pool_of_another_process_is_left_alone() {
        let mut workers = Workers::new(2);
        assert!(workers.pool(MIN_PARALLEL_ROWS).is_some());
        workers.process = 0;
        let sum: i32 = workers.pool(MIN_PARALLEL_ROWS).unwrap().install(|| (0..10).into_par_iter().sum());
        assert_eq!((sum, workers.process), (45, std::process::id()));
    }
}
