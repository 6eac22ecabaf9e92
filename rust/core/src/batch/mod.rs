//! Many environments stepped side by side.
//!
//! Each row is an environment of its own: its results depend on its seed, its episode and its actions, never on the
//! number of rows or threads, bit for bit. Rows are kept in chunks; a chunk belongs to one thread at a time and
//! advances its robots together, in the lanes of a [`Fleet`]. A row that diverges is flagged and does not affect the
//! others; nor does a panic while a row is reset, commanded or observed. A panic while robots are advanced ends at their
//! chunk.

mod chunk;
mod row;
mod workers;

use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use nalgebra::Vector3;

use crate::environment::quantity::Quantity;
use crate::environment::signal::{COUNT, SignalInfo, signals_of};
use crate::environment::{EnvConfig, Environment, EnvironmentState, PlanarRobot, RobotModel, World};
use crate::error::{ConfigError, require, within};
use crate::interrupt::Interrupt;
use crate::stepping::{Fleet, PlantParameters, widest_lanes};

use chunk::Chunk;
use row::Row;
use workers::Workers;

/// Environments of one configuration.
#[derive(Debug)]
pub struct Batch<M: RobotModel = PlanarRobot> {
    /// A fresh environment, to replace one that panicked.
    prototype: Environment<M>,
    /// All of `rows_per_chunk` rows but the last.
    chunks: Vec<Chunk<M>>,
    rows_per_chunk: usize,
    rows: usize,
    signals: Vec<SignalInfo>,
    workers: Workers,
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

impl<M: RobotModel> Batch<M> {
    /// `num_envs` environments at the start of episode 0 of seed 0. With `num_threads` = 1 no thread is
    /// ever started; 0 takes one for each core of the machine.
    ///
    /// # Errors
    /// Names the field of the configuration, its value and the admissible range.
    pub fn new(config: &EnvConfig, num_envs: usize, num_threads: usize) -> Result<Self, ConfigError> {
        require((1..=MAX_ENVS).contains(&num_envs), "num_envs", num_envs, "an integer in [1, 1000000]")?;
        require(num_threads <= MAX_THREADS, "num_threads", num_threads, "an integer in [0, 1024]")?;
        let prototype = Environment::<M>::new(config)?;
        let workers = Workers::new(num_threads);
        let rows_per_chunk = rows_per_chunk(num_envs, workers.count());
        let chunk = |first| {
            let rows = rows_per_chunk.min(num_envs - first);
            let system = prototype.model().simulation().system();
            let fleet = Fleet::new(config.integrator, system, rows);
            Chunk::new(first, vec![Row::new(prototype.clone()); rows], fleet)
        };
        let chunks = (0..num_envs).step_by(rows_per_chunk).map(chunk).collect();
        Ok(Self { prototype, chunks, rows_per_chunk, rows: num_envs, signals: signals_of::<M>(), workers })
    }

    /// Ends a reset or a step early; the rows that it leaves are flagged as diverged and begin anew.
    pub fn interrupt(&self) -> &Interrupt {
        &self.prototype.model().simulation().body().interrupt
    }

    /// Number of rows.
    pub fn num_envs(&self) -> usize {
        self.rows
    }

    pub fn num_threads(&self) -> usize {
        self.workers.count()
    }

    pub fn observation_size(&self) -> usize {
        self.prototype.observation_size()
    }

    pub fn action_size(&self) -> usize {
        self.prototype.action_size()
    }

    /// All signals, in order: those of every environment, then the model's own.
    pub fn signals(&self) -> &[SignalInfo] {
        &self.signals
    }

    /// The environment of a row, for rendering; its layout is that of all rows.
    pub fn environment(&self, row: usize) -> &Environment<M> {
        &self.row(row).environment
    }

    /// Starts an episode in the rows of `mask`, with the seed given or as the next one of the row.
    ///
    /// # Panics
    /// If an array has not the length that [`Outputs`] states.
    pub fn reset(&mut self, mask: &[bool], seeds: &[Option<u64>], out: Outputs) {
        assert_eq!(seeds.len(), self.rows, "one seed a row");
        self.for_chunks(mask, out, |chunk, prototype, active, observation| {
            chunk.reset(prototype, &seeds[chunk.range()], active, observation);
        });
    }

    /// One control period in the active rows; `actions` is (n, action_size), row by row, finite.
    ///
    /// # Panics
    /// If an array has not the length that [`Outputs`] states.
    pub fn step(&mut self, actions: &[f64], active: &[bool], out: Outputs) {
        let size = self.action_size();
        assert_eq!(actions.len(), self.rows * size, "one action a row");
        self.for_chunks(active, out, |chunk, prototype, active, observation| {
            let rows = chunk.range();
            chunk.step(prototype, &actions[rows.start * size..rows.end * size], active, observation);
        });
    }

    /// The difficulty of a row's episodes to come.
    pub fn difficulty(&self, row: usize) -> f64 {
        self.row(row).environment.difficulty()
    }

    /// Sets the difficulty of the episodes to come, row by row, or of none.
    ///
    /// # Errors
    /// One of them is not in \[0, 1\].
    pub fn set_difficulty(&mut self, rows: &[usize], difficulty: &[f64]) -> Result<(), ConfigError> {
        difficulty.iter().try_for_each(|value| within("difficulty", *value, 0.0, 1.0).map(drop))?;
        rows.iter().zip(difficulty).try_for_each(|(row, value)| self.row_mut(*row).environment.set_difficulty(*value))
    }

    /// Writes the current observation of a row.
    pub fn observe(&mut self, row: usize, observation: &mut [f32]) {
        self.row_mut(row).environment.observe(observation);
    }

    /// Prescribes where the next episodes of rows take place, or none of them.
    ///
    /// # Errors
    /// A robot has no room there.
    pub fn set_next_worlds(&mut self, rows: &[usize], worlds: Vec<World>) -> Result<(), ConfigError> {
        rows.iter().zip(&worlds).try_for_each(|(row, world)| self.row_mut(*row).environment.check_world(world))?;
        for (row, world) in rows.iter().zip(worlds) {
            self.row_mut(*row).environment.set_next_world(world);
        }
        Ok(())
    }

    /// Changes the momentum of the links of a row by impulses at their CGs, frame I \[N s\].
    pub fn strike(&mut self, row: usize, impulses: impl IntoIterator<Item = Vector3<f64>>) {
        let model = self.row_mut(row).environment.model_mut();
        impulses.into_iter().enumerate().for_each(|(link, impulse)| model.strike(link, &impulse));
    }

    /// Changes how the robot of a row differs from the configured one, until its next episode.
    pub fn set_parameters(&mut self, row: usize, parameters: PlantParameters) {
        self.row_mut(row).environment.set_parameters(parameters);
    }

    /// Keeps from now on the states of a row's robot at the ends of the parts of steps within a control period, see
    /// [`Body::path`](crate::stepping::Body::path).
    pub fn keep_path(&mut self, row: usize) {
        self.row_mut(row).environment.model_mut().simulation_mut().body_mut().path = Some(Vec::new());
    }

    /// Writes a quantity of some rows, one after the other; `size` numbers each.
    pub fn read(&self, quantity: &Quantity<M>, rows: &[usize], size: usize, values: &mut [f64]) {
        let rows = rows.iter().map(|row| self.environment(*row));
        values.chunks_exact_mut(size).zip(rows).for_each(|(value, environment)| (quantity.read)(environment, value));
    }

    /// Everything that changes in a row.
    pub fn save(&self, row: usize) -> EnvironmentState<M::State> {
        self.row(row).environment.save()
    }

    /// Continues rows from saved states, or none of them.
    ///
    /// # Errors
    /// A state is of an environment of another configuration.
    pub fn restore(&mut self, rows: &[usize], states: &[EnvironmentState<M::State>]) -> Result<(), ConfigError> {
        let continued = |(row, state): (&usize, _)| {
            let mut environment = self.row(*row).environment.clone();
            environment.restore(state)?;
            Ok(environment)
        };
        let environments: Vec<_> = rows.iter().zip(states).map(continued).collect::<Result<_, ConfigError>>()?;
        for (row, environment) in rows.iter().zip(environments) {
            *self.row_mut(*row) = Row::new(environment);
        }
        Ok(())
    }

    fn row(&self, row: usize) -> &Row<M> {
        &self.chunks[row / self.rows_per_chunk].rows[row % self.rows_per_chunk]
    }

    fn row_mut(&mut self, row: usize) -> &mut Row<M> {
        &mut self.chunks[row / self.rows_per_chunk].rows[row % self.rows_per_chunk]
    }

    /// Visits every chunk with its part of `active` and of the observations, then writes the outcomes.
    fn for_chunks<F>(&mut self, active: &[bool], out: Outputs, visit: F)
    where
        F: Fn(&mut Chunk<M>, &Environment<M>, &[bool], &mut [f32]) + Sync,
    {
        let (n, size) = (self.rows, self.observation_size());
        assert_eq!(active.len(), n, "one flag a row");
        assert_eq!(out.observation.len(), n * size, "one observation a row");
        assert!(out.reward.len() == n && out.terminated.len() == n && out.truncated.len() == n, "one value a row");
        assert_eq!(out.signals.len(), self.signals.len() * n, "one value a row and signal");
        self.interrupt().clear();
        let interrupt = self.interrupt().clone();
        let busy = self.chunks.iter().filter(|chunk| active[chunk.range()].contains(&true)).count();
        let (prototype, per_chunk) = (&self.prototype, self.rows_per_chunk);
        let parts =
            self.chunks.iter_mut().zip(active.chunks(per_chunk)).zip(out.observation.chunks_mut(per_chunk * size));
        let visit =
            |((chunk, active), observation): ((&mut Chunk<M>, _), _)| visit(chunk, prototype, active, observation);
        match self.workers.helpers(busy) {
            None => parts.for_each(visit),
            Some(pool) => {
                let parts = Mutex::new(parts);
                // A thread that is done takes over any chunk that no other has begun.
                let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
                let work = || std::iter::from_fn(next).for_each(&visit);
                let (running, ended) = mpsc::channel::<()>();
                pool.in_place_scope(|scope| {
                    for _ in 0..pool.current_num_threads().min(busy - 1) {
                        let running = running.clone();
                        scope.spawn(move |_| {
                            work();
                            drop(running);
                        });
                    }
                    drop(running);
                    work();
                    // The calling thread alone can be interrupted.
                    while ended.recv_timeout(LONGEST_WAIT) == Err(RecvTimeoutError::Timeout) {
                        interrupt.is_raised();
                    }
                });
            }
        }
        self.write_outcomes(active, out);
    }

    fn write_outcomes(&self, active: &[bool], out: Outputs) {
        let n = self.rows;
        let rows = self.chunks.iter().flat_map(|chunk| &chunk.rows);
        for (index, row) in rows.enumerate().filter(|(index, _)| active[*index]) {
            let outcome = &row.outcome;
            out.reward[index] = outcome.reward;
            out.terminated[index] = outcome.terminated;
            out.truncated[index] = outcome.truncated;
            for (signal, value) in outcome.signals.iter().enumerate() {
                out.signals[signal * n + index] = *value;
            }
            for (signal, value) in row.own_signals.iter().enumerate() {
                out.signals[(COUNT + signal) * n + index] = *value;
            }
        }
    }
}

/// Rows to a chunk: whole registers as so many rows take them, the same number of chunks for each thread, and not more rows
/// than a cache holds. The more rows, the fewer lanes are empty where steps are divided.
fn rows_per_chunk(rows: usize, threads: usize) -> usize {
    let share = rows.div_ceil(threads);
    let rows = share.div_ceil(share.div_ceil(LARGEST_CHUNK));
    rows.next_multiple_of(widest_lanes(rows))
}

const LARGEST_CHUNK: usize = 128;

/// Longest time between two looks at the interrupt.
const LONGEST_WAIT: Duration = Duration::from_millis(50);

/// Guards against typing errors.
const MAX_ENVS: usize = 1_000_000;
const MAX_THREADS: usize = 1024;
