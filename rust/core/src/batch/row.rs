//! One environment of a batch.

use crate::environment::signal::Summary;
use crate::environment::{Environment, Outcome, RobotModel};

/// One environment and what its last step or reset returned.
#[derive(Debug, Clone)]
pub struct Row<M: 'static> {
    pub environment: Environment<M>,
    pub outcome: Outcome,
    /// The signals that only its model has.
    pub own_signals: Vec<f64>,
}

impl<M: RobotModel> Row<M> {
    pub fn new(environment: Environment<M>) -> Self {
        let outcome = environment.outcome();
        let mut row = Self { environment, outcome, own_signals: vec![0.0; M::SIGNALS.len()] };
        row.keep(outcome);
        row
    }

    /// Keeps what a step or reset has returned, and reads its model's own signals while the robot is in the cache.
    pub fn keep(&mut self, outcome: Outcome) {
        self.outcome = outcome;
        for (value, signal) in self.own_signals.iter_mut().zip(M::SIGNALS) {
            *value = (signal.value)(self.environment.model());
        }
    }

    /// Replaces the environment; the row ends, flagged as diverged.
    pub fn give_up(&mut self, prototype: &Environment<M>, observation: &mut [f32]) {
        self.environment.recover(prototype);
        self.keep(broken());
        observation.fill(0.0);
    }
}

/// The outcome of a row that panicked.
fn broken() -> Outcome {
    let signals = Summary { diverged: true, ..Summary::default() }.signals();
    Outcome { reward: 0.0, terminated: false, truncated: true, signals }
}
