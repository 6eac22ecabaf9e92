use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, positive, require};

/// Which time-stepping scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Midpoint time stepping, Algorithm 3.1 and explicit PD, as printed.
    Thesis,
    /// Implicit stages with exactly eliminated joints and certified contacts.
    #[default]
    Implicit,
}

/// What a user may choose about time stepping; `None` takes the method's own default.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegratorConfig {
    pub method: Method,
    /// Largest step \[s\]; a run divides its sampling interval into equal steps no longer than this.
    pub step: Option<f64>,
    /// `thesis`: epsilon of (T 3.81) \[N s\]. `implicit`: accuracy of the velocities \[m/s\] (T 3.81 != D11).
    pub tolerance: Option<f64>,
    /// Iterations after which a step is given up and counted as a miss (T Remark 3.1).
    pub max_iterations: Option<u32>,
    /// `implicit`: 1 is implicit Euler, 2 the two-stage L-stable SDIRK.
    pub order: u32,
    /// `implicit`, order 2: implicit-Euler steps that at most replace a step in which a peg's force changes abruptly.
    pub event_substeps: u32,
    /// `implicit`, order 2: deviation of a stage from its prediction beyond which that is so \[m\].
    pub event_tolerance: Option<f64>,
    /// `thesis`: r_T of (T 3.79), (T 4.114).
    pub r_t: Option<f64>,
    /// `thesis`: r_H of (T 3.78), (T 4.116).
    pub r_h: f64,
    /// `thesis`, spatial model: r_N of (T 4.113).
    pub r_n: f64,
    /// `thesis`, spatial model: r_V of (T 4.115).
    pub r_v: f64,
}

impl Default for IntegratorConfig {
    fn default() -> Self {
        Self {
            method: Method::Implicit,
            step: None,
            tolerance: None,
            max_iterations: None,
            order: 2,
            event_substeps: 4,
            event_tolerance: None,
            r_t: None,
            r_h: 0.01,
            r_n: 0.1,
            r_v: 0.05,
        }
    }
}

impl IntegratorConfig {
    /// # Errors
    /// Names the option that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        positive("step", self.step())?;
        positive("tolerance", self.tolerance())?;
        require(self.max_iterations() >= 1, "max_iterations", self.max_iterations(), "an integer >= 1")?;
        require((1..=2).contains(&self.order), "order", self.order, "1 or 2")?;
        let substeps = self.event_substeps;
        require((1..=1000).contains(&substeps), "event_substeps", substeps, "an integer in [1, 1000]")?;
        for (name, value) in [("event_tolerance", self.event_tolerance), ("r_t", self.r_t)] {
            value.map_or(Ok(0.0), |value| positive(name, value))?;
        }
        for (name, value) in [("r_h", self.r_h), ("r_n", self.r_n), ("r_v", self.r_v)] {
            positive(name, value)?;
        }
        Ok(())
    }

    pub fn step(&self) -> f64 {
        self.step.unwrap_or(match self.method {
            Method::Thesis => 2.5e-4,
            Method::Implicit => 0.025,
        })
    }

    /// Number of equal steps that divide `duration`.
    pub fn steps_in(&self, duration: f64) -> u32 {
        (duration / self.step() - STEP_SLACK).ceil().max(1.0) as u32
    }

    /// How often a step in which a peg's force changes abruptly is halved before it is taken as Euler steps.
    pub(crate) fn event_halvings(&self) -> usize {
        (self.event_substeps.max(2).ilog2() - 1) as usize
    }

    /// Euler steps at the end of the halvings.
    pub(crate) fn event_steps(&self) -> u32 {
        self.event_substeps.div_ceil(1 << self.event_halvings())
    }

    pub fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(match self.method {
            Method::Thesis => 2e-5,
            Method::Implicit => 1e-6,
        })
    }

    pub fn max_iterations(&self) -> u32 {
        self.max_iterations.unwrap_or(match self.method {
            Method::Thesis => 10_000,
            Method::Implicit => 200,
        })
    }
}

/// A ratio of durations this close to a whole number counts as whole.
const STEP_SLACK: f64 = 1e-9;
