//! Rows that one thread steps together.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::gait::JointTarget;
use crate::stepper::{Body, Driven, Fleet};
use crate::task::signal::{COUNT, SIGNALS, SignalRow};
use crate::task::{Environment, Outcome};

/// Neighbouring rows of a batch.
#[derive(Debug)]
pub struct Chunk {
    first: usize,
    pub rows: Vec<Row>,
    /// Advances the robots side by side; `None`: each environment advances its own.
    fleet: Option<Fleet>,
}

/// One environment and what its last step or reset returned.
#[derive(Debug, Clone)]
pub struct Row {
    pub environment: Environment,
    pub outcome: Outcome,
    /// Takes part in the step at hand.
    active: bool,
}

impl Driven for Row {
    fn body(&self) -> &Body {
        self.environment.body()
    }

    fn body_mut(&mut self) -> &mut Body {
        self.environment.body_mut()
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        self.environment.targets(time, targets);
    }
}

impl Chunk {
    /// The rows from `first` on.
    pub fn new(first: usize, rows: Vec<Row>, fleet: Option<Fleet>) -> Self {
        Self { first, rows, fleet }
    }

    /// Indices of the rows in the batch.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.rows.len()
    }

    /// Starts an episode in the active rows.
    pub fn reset(&mut self, prototype: &Environment, seeds: &[Option<u64>], active: &[bool], observation: &mut [f32]) {
        let size = prototype.observation_size();
        let observations = observation.chunks_exact_mut(size);
        for (((row, observation), seed), active) in self.rows.iter_mut().zip(observations).zip(seeds).zip(active) {
            row.active = *active;
            row.contained(prototype, observation, |row, observation| {
                row.outcome = row.environment.reset(*seed, observation);
            });
        }
    }

    /// One control period in the active rows.
    pub fn step(&mut self, prototype: &Environment, actions: &[f64], active: &[bool], observation: &mut [f32]) {
        let (size, action_size) = (prototype.observation_size(), prototype.action_size());
        let actions = actions.chunks_exact(action_size);
        for (((row, action), active), observation) in
            self.rows.iter_mut().zip(actions).zip(active).zip(observation.chunks_exact_mut(size))
        {
            row.active = *active;
            row.contained(prototype, observation, |row, _| row.environment.begin_step(action));
        }
        self.advance(prototype, observation);
        for (row, observation) in self.rows.iter_mut().zip(observation.chunks_exact_mut(size)) {
            row.contained(prototype, observation, |row, observation| {
                row.outcome = row.environment.end_step(observation);
            });
        }
    }

    /// Advances the robots of the active rows, all together or one by one.
    fn advance(&mut self, prototype: &Environment, observation: &mut [f32]) {
        let observations = observation.chunks_exact_mut(prototype.observation_size());
        let Some(fleet) = &mut self.fleet else {
            for (row, observation) in self.rows.iter_mut().zip(observations) {
                row.contained(prototype, observation, |row, _| row.environment.advance());
            }
            return;
        };
        let (plant, period) = (prototype.plant(), prototype.rules().period);
        let rows = &mut self.rows;
        if catch_unwind(AssertUnwindSafe(|| fleet.advance(plant, rows, period, |row| row.active))).is_err() {
            rows.iter_mut().zip(observations).for_each(|(row, observation)| row.give_up(prototype, observation));
        }
    }
}

impl Row {
    pub fn new(prototype: &Environment) -> Self {
        Self { environment: prototype.clone(), outcome: prototype.outcome(), active: false }
    }

    /// Runs `part` of a step if the row is active. If it panics the environment is replaced and the row
    /// ends, flagged as diverged.
    fn contained(&mut self, prototype: &Environment, observation: &mut [f32], part: impl FnOnce(&mut Row, &mut [f32])) {
        if self.active && catch_unwind(AssertUnwindSafe(|| part(self, observation))).is_err() {
            self.give_up(prototype, observation);
        }
    }

    fn give_up(&mut self, prototype: &Environment, observation: &mut [f32]) {
        self.active = false;
        self.environment.recover(prototype);
        self.outcome = broken();
        observation.fill(0.0);
    }
}

/// The outcome of a row that panicked.
fn broken() -> Outcome {
    let mut signals: SignalRow = [0.0; COUNT];
    let flag = SIGNALS.iter().position(|signal| signal.name == "diverged");
    flag.into_iter().for_each(|flag| signals[flag] = 1.0);
    Outcome { reward: 0.0, terminated: true, truncated: false, signals }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::EnvConfig;

    #[test]
    fn a_row_that_panics_ends_flagged_and_starts_afresh() {
        let prototype = Environment::new(&EnvConfig::default()).unwrap();
        let mut row = Row { active: true, ..Row::new(&prototype) };
        let mut observation = vec![0.5; prototype.observation_size()];
        row.environment.reset(Some(9), &mut observation);
        row.contained(&prototype, &mut observation, |_, _| panic!("a defect in one row"));
        assert!(row.outcome.terminated && observation.iter().all(|value| *value == 0.0));
        let mut expected = prototype.clone();
        let mut second = observation.clone();
        expected.reset(Some(9), &mut second);
        row.environment.reset(None, &mut observation);
        expected.reset(None, &mut second);
        assert_eq!(observation, second, "the row goes on with the next episode of its seed");
    }
}
