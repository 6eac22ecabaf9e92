//! Batches of environments in the middle of their episodes.

use snake_core::ConfigError;
use snake_core::batch::{Batch, Outputs};
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, EnvironmentState, ModelKind, PlanarRobot, RobotModel, Task};

/// The configuration behind an environment id.
pub fn of_id(task: Task) -> (&'static str, EnvConfig) {
    (task.family().id, EnvConfig { task, ..EnvConfig::default() })
}

/// The configuration behind `SnakeSpatial-v1`.
pub fn spatial_env() -> (&'static str, EnvConfig) {
    ("SnakeSpatial-v1", EnvConfig { task: Task::FREE, model: ModelKind::Spatial, ..EnvConfig::default() })
}

/// Actions of the robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Actions {
    /// Action zero of the mode `gait`: the thesis's gait.
    Gait,
    /// Drawn anew each step, uniformly from the whole range of the mode `gait`.
    Random,
    /// The same in the mode `joints`.
    RandomJoints,
}

impl Actions {
    pub const ALL: [Actions; 3] = [Actions::Gait, Actions::Random, Actions::RandomJoints];

    pub fn name(self) -> &'static str {
        match self {
            Actions::Gait => "gait",
            Actions::Random => "random",
            Actions::RandomJoints => "random joints",
        }
    }

    /// The configuration with the action mode that these actions belong to.
    pub fn configure(self, config: &EnvConfig) -> EnvConfig {
        let action_mode = match self {
            Actions::Gait | Actions::Random => ActionMode::Gait,
            Actions::RandomJoints => ActionMode::Joints,
        };
        EnvConfig { action_mode, ..config.clone() }
    }
}

/// A batch that resets ended rows.
pub struct Robots<M: RobotModel = PlanarRobot> {
    pub batch: Batch<M>,
    actions: Actions,
    action: Vec<f64>,
    stream: Rng,
    active: Vec<bool>,
    ended: Vec<bool>,
    no_seeds: Vec<Option<u64>>,
    results: Results,
}

/// Where a batch writes.
struct Results {
    observation: Vec<f32>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    signals: Vec<f64>,
}

impl Results {
    fn of<M: RobotModel>(batch: &Batch<M>) -> Self {
        let rows = batch.num_envs();
        Self {
            observation: vec![0.0; rows * batch.observation_size()],
            reward: vec![0.0; rows],
            terminated: vec![false; rows],
            truncated: vec![false; rows],
            signals: vec![0.0; rows * batch.signals().len()],
        }
    }

    fn outputs(&mut self) -> Outputs<'_> {
        let Self { observation, reward, terminated, truncated, signals } = self;
        Outputs { observation, reward, terminated, truncated, signals }
    }
}

impl<M: RobotModel> Robots<M> {
    /// Row k at the start of episode 0 of seed k.
    ///
    /// # Errors
    /// The configuration is not admissible.
    pub fn new(config: &EnvConfig, rows: usize, threads: usize, actions: Actions) -> Result<Self, ConfigError> {
        let batch = Batch::new(config, rows, threads)?;
        let mut robots = Self {
            actions,
            action: vec![0.0; rows * batch.action_size()],
            stream: Rng::new(ACTION_SEED, 0),
            active: vec![true; rows],
            ended: vec![true; rows],
            no_seeds: vec![None; rows],
            results: Results::of(&batch),
            batch,
        };
        let seeds: Vec<_> = (0..rows as u64).map(Some).collect();
        robots.reset_ended(&seeds);
        Ok(robots)
    }

    /// A batch whose rows continue from `pool`, neighbours far apart in time.
    ///
    /// # Errors
    /// The configuration is not admissible or the pool of another one.
    pub fn in_motion(
        config: &EnvConfig,
        rows: usize,
        threads: usize,
        actions: Actions,
        pool: &[EnvironmentState<M::State>],
    ) -> Result<Self, ConfigError> {
        let mut robots = Self::new(config, rows, threads, actions)?;
        for row in 0..rows {
            robots.batch.restore(&[row], std::slice::from_ref(&pool[(row * SCATTER) % pool.len()]))?;
        }
        Ok(robots)
    }

    /// One control period of all rows; rows whose episode has ended start the next one.
    pub fn step(&mut self) {
        if self.actions != Actions::Gait {
            self.action.iter_mut().for_each(|value| *value = self.stream.around_zero(1.0));
        }
        self.batch.step(&self.action, &self.active, self.results.outputs());
        let ends = self.results.terminated.iter().zip(&self.results.truncated);
        self.ended.iter_mut().zip(ends).for_each(|(ended, (terminated, truncated))| *ended = terminated | truncated);
        if self.ended.contains(&true) {
            let seeds = std::mem::take(&mut self.no_seeds);
            self.reset_ended(&seeds);
            self.no_seeds = seeds;
        }
    }

    fn reset_ended(&mut self, seeds: &[Option<u64>]) {
        self.batch.reset(&self.ended, seeds, self.results.outputs());
    }
}

/// States of [`POOL`] robots at times spread evenly over the first [`POOL_STEPS`] steps of their episodes.
///
/// # Errors
/// The configuration is not admissible.
pub fn pool<M: RobotModel>(
    config: &EnvConfig,
    actions: Actions,
) -> Result<Vec<EnvironmentState<M::State>>, ConfigError> {
    let mut robots = Robots::<M>::new(config, POOL, 0, actions)?;
    let mut states = Vec::with_capacity(POOL);
    for step in 0..POOL_STEPS {
        robots.step();
        while states.len() * POOL_STEPS < (step + 1) * POOL {
            states.push(robots.batch.save(states.len()));
        }
    }
    Ok(states)
}

const POOL: usize = 256;
const POOL_STEPS: usize = 200;

/// Odd, so that it visits every state of the pool.
const SCATTER: usize = 97;

const ACTION_SEED: u64 = 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_holds_robots_at_times_spread_over_their_episodes() {
        let (_, config) = of_id(Task::COURSE);
        let pool = pool::<PlanarRobot>(&config, Actions::Gait).unwrap();
        assert_eq!(pool.len(), POOL);
        let robots = Robots::<PlanarRobot>::in_motion(&config, 8, 1, Actions::Gait, &pool).unwrap();
        let times: Vec<f64> = (0..8).map(|row| robots.batch.environment(row).state().time).collect();
        for (k, a) in times.iter().enumerate() {
            assert!(times[..k].iter().all(|b| (a - b).abs() > 0.04), "{times:?}");
        }
    }
}
