//! Inputs of the controller at each instant: measurements with noise, references, a held torque.

use snake_core::control::{ControllerConfig, Treatment};
use snake_core::gait::{JointTarget, Reference};

use crate::minimal::{Feedback, Measurement, MinimalState, Model, Noise};

/// Controller of one robot with its clock.
#[derive(Debug, Clone)]
pub struct Controller {
    feedback: Feedback,
    noise: Noise,
    /// Errors of the present measurement.
    error: Measurement,
    measured: Measurement,
    pub targets: Vec<JointTarget>,
    /// tau held since the last sampling instant \[N m\].
    pub held: Vec<f64>,
    /// Control periods that have begun.
    periods: u64,
    start: f64,
}

impl Controller {
    pub fn new(config: ControllerConfig, noise: Noise, model: &Model) -> Self {
        let joints = model.joint_count();
        Self {
            feedback: Feedback::new(config, model),
            noise,
            error: Measurement::new(joints),
            measured: Measurement::new(joints),
            targets: vec![JointTarget::default(); joints],
            held: vec![0.0; joints],
            periods: 0,
            start: 0.0,
        }
    }

    /// Clears held torques; control periods count from `time`.
    pub fn restart(&mut self, time: f64) {
        self.held.fill(0.0);
        (self.periods, self.start) = (0, time);
    }

    pub fn config(&self) -> &ControllerConfig {
        &self.feedback.config
    }

    /// When the next control period begins; infinite without periods \[s\].
    pub fn next_period(&self) -> f64 {
        match self.config().treatment {
            Treatment::Period(period) => self.start + self.periods as f64 * period,
            _ => f64::INFINITY,
        }
    }

    /// Begins a control period if one is due.
    pub fn tick(&mut self, model: &Model, state: &MinimalState, reference: &impl Reference<JointTarget>) {
        if self.next_period() <= state.time + ROUND_OFF {
            self.periods += 1;
            self.sample(model, state, reference);
        }
    }

    /// Begins a step: a new torque where it is held over one.
    pub fn begin_step(&mut self, model: &Model, state: &MinimalState, reference: &impl Reference<JointTarget>) {
        if self.config().treatment == Treatment::Step {
            self.sample(model, state, reference);
        }
    }

    /// Holds the torque of the present state as measured, with new errors.
    fn sample(&mut self, model: &Model, state: &MinimalState, reference: &impl Reference<JointTarget>) {
        self.noise.draw(&mut self.error);
        self.measured.take(state);
        self.measured.add(&self.error);
        reference.targets(state.time, &mut self.targets);
        self.feedback.torque(model, &self.measured, &self.targets, state.time, &mut self.held);
    }
}

/// Times closer to each other than this count as equal \[s\].
pub const ROUND_OFF: f64 = 1e-10;
