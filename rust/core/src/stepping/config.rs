//! Options of time stepping: one type per method.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor, value};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, positive, require, time_step, within};

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

impl Method {
    /// Name in configurations.
    pub fn name(self) -> &'static str {
        match self {
            Method::Thesis => "thesis",
            Method::Implicit => "implicit",
        }
    }

    /// The options that the method has.
    fn options(self) -> &'static [&'static str] {
        match self {
            Method::Thesis => &["step", "tolerance", "max_iterations", "r_t", "r_h", "r_n", "r_v"],
            Method::Implicit => {
                &["step", "tolerance", "max_iterations", "order", "step_tolerance", "impact_step", "precision"]
            }
        }
    }
}

/// Options of the method `thesis`; `None` takes the model's own default.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ThesisConfig {
    /// Largest step \[s\]; a run divides its sampling interval into equal steps no longer than this.
    pub step: f64,
    /// epsilon of (T 3.81) \[N s\].
    pub tolerance: Option<f64>,
    /// Iterations after which a step is given up and counts as unconverged (T Remark 3.1).
    pub max_iterations: u32,
    /// r_T of (T 3.79), (T 4.114).
    pub r_t: Option<f64>,
    /// r_H of (T 3.78), (T 4.116).
    pub r_h: f64,
    /// r_N of (T 4.113); the spatial model only.
    pub r_n: f64,
    /// r_V of (T 4.115); the spatial model only.
    pub r_v: f64,
}

impl Default for ThesisConfig {
    fn default() -> Self {
        Self { step: 2.5e-4, tolerance: None, max_iterations: 10_000, r_t: None, r_h: 0.01, r_n: 0.1, r_v: 0.05 }
    }
}

impl ThesisConfig {
    /// Number of equal steps that divide `duration`.
    pub fn steps_in(&self, duration: f64) -> u32 {
        steps_in(duration, self.step)
    }

    fn validate(&self) -> Result<(), ConfigError> {
        time_step("step", self.step)?;
        self.tolerance.map_or(Ok(0.0), |value| tolerance(value, LARGEST_IMPULSE_ERROR))?;
        validate_iterations(self.max_iterations)?;
        self.r_t.map_or(Ok(0.0), |value| positive("r_t", value))?;
        for (name, value) in [("r_h", self.r_h), ("r_n", self.r_n), ("r_v", self.r_v)] {
            positive(name, value)?;
        }
        Ok(())
    }
}

/// How accurate the method `implicit` is, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// The cheapest that keeps the bias of work within 4 %.
    Fast,
    /// For learning.
    #[default]
    Default,
    /// For judging what was learned.
    Fine,
}

impl Precision {
    /// Lengths, velocities and times of [`Accuracy`] over those of the default.
    pub(crate) fn scale(self) -> f64 {
        match self {
            Precision::Fast => 2.0,
            Precision::Default => 1.0,
            Precision::Fine => 0.05,
        }
    }
}

/// What bounds the error of the method `implicit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Largest step \[s\].
    pub step: f64,
    /// Accuracy of the velocities in a stage \[m/s\].
    pub tolerance: f64,
    /// Largest accepted deviation of a part of a step from its prediction, for any point of the robot \[m\].
    pub step_tolerance: f64,
    /// Length of the Euler steps that take an impact \[s\].
    pub impact_step: f64,
}

/// Options of the method `implicit`; `None` takes the model's own default at the precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ImplicitConfig {
    /// Largest step \[s\]; a run divides its sampling interval into equal steps no longer than this.
    pub step: Option<f64>,
    /// Accuracy of the velocities \[m/s\] (T 3.81 != D11); of a smooth plant of the minimal model, relative.
    pub tolerance: Option<f64>,
    /// Iterations after which a stage is given up and counts as unconverged (T Remark 3.1).
    pub max_iterations: u32,
    /// 1 is implicit Euler, 2 the two-stage L-stable SDIRK.
    pub order: u32,
    /// Order 2: largest accepted deviation of a part of a step from its prediction, for any point of the robot \[m\].
    pub step_tolerance: Option<f64>,
    /// Order 2: length of the implicit Euler steps that take an impact \[s\].
    pub impact_step: Option<f64>,
    /// Scales the defaults of all three tolerances.
    pub precision: Precision,
}

impl Default for ImplicitConfig {
    fn default() -> Self {
        Self {
            step: None,
            tolerance: None,
            max_iterations: 200,
            order: 2,
            step_tolerance: None,
            impact_step: None,
            precision: Precision::Default,
        }
    }
}

impl ImplicitConfig {
    /// Largest step; that of the plane and of 3D if no other was chosen \[s\].
    pub fn step(&self) -> f64 {
        self.step.unwrap_or(0.025)
    }

    /// The accuracy that was chosen; `default` is that of the model.
    ///
    /// A step that is shorter than the default one tightens the default tolerance of a step with its cube, as smooth
    /// motion deviates: then all parts shorten in proportion, and the scheme keeps its order.
    pub fn accuracy(&self, default: &Accuracy) -> Accuracy {
        let (scale, step) = (self.precision.scale(), self.step.unwrap_or(default.step));
        let shorter = if step < default.step { (step / default.step).powi(3) } else { f64::INFINITY };
        Accuracy {
            step,
            tolerance: self.tolerance.unwrap_or(scale * default.tolerance),
            step_tolerance: self.step_tolerance.unwrap_or(scale.min(shorter) * default.step_tolerance),
            impact_step: self.impact_step.unwrap_or(scale * default.impact_step),
        }
    }

    fn validate(&self) -> Result<(), ConfigError> {
        time_step("step", self.step())?;
        self.tolerance.map_or(Ok(0.0), |value| tolerance(value, LARGEST_VELOCITY_ERROR))?;
        validate_iterations(self.max_iterations)?;
        require((1..=2).contains(&self.order), "order", self.order, "1 or 2")?;
        for (name, value) in [("step_tolerance", self.step_tolerance), ("impact_step", self.impact_step)] {
            value.map_or(Ok(0.0), |value| positive(name, value))?;
        }
        Ok(())
    }
}

/// The method and its options.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "method", rename_all = "lowercase")]
pub enum IntegratorConfig {
    Thesis(ThesisConfig),
    Implicit(ImplicitConfig),
}

impl Default for IntegratorConfig {
    fn default() -> Self {
        ImplicitConfig::default().into()
    }
}

impl From<ThesisConfig> for IntegratorConfig {
    fn from(config: ThesisConfig) -> Self {
        Self::Thesis(config)
    }
}

impl From<ImplicitConfig> for IntegratorConfig {
    fn from(config: ImplicitConfig) -> Self {
        Self::Implicit(config)
    }
}

impl IntegratorConfig {
    /// A method with its default options.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Thesis => ThesisConfig::default().into(),
            Method::Implicit => ImplicitConfig::default().into(),
        }
    }

    /// # Errors
    /// Names the option that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
        match self {
            Self::Thesis(config) => config.validate(),
            Self::Implicit(config) => config.validate(),
        }
    }

    pub fn method(&self) -> Method {
        match self {
            Self::Thesis(_) => Method::Thesis,
            Self::Implicit(_) => Method::Implicit,
        }
    }

    /// The options of `implicit`; `None` for the other method.
    pub fn implicit(&self) -> Option<ImplicitConfig> {
        match *self {
            Self::Implicit(config) => Some(config),
            Self::Thesis(_) => None,
        }
    }

    /// Largest step \[s\].
    pub fn step(&self) -> f64 {
        match self {
            Self::Thesis(config) => config.step,
            Self::Implicit(config) => config.step(),
        }
    }

    /// The same with another largest step \[s\].
    #[must_use]
    pub fn with_step(self, step: f64) -> Self {
        match self {
            Self::Thesis(config) => ThesisConfig { step, ..config }.into(),
            Self::Implicit(config) => ImplicitConfig { step: Some(step), ..config }.into(),
        }
    }

    /// Number of equal steps that divide `duration`.
    pub fn steps_in(&self, duration: f64) -> u32 {
        steps_in(duration, self.step())
    }

    /// Rejects a duration, `name`, of more steps than `most`.
    ///
    /// # Errors
    /// Names the duration and the step.
    pub fn require_steps(&self, duration: f64, most: u32, name: &str) -> Result<(), ConfigError> {
        let expected = format!("at most {most} steps of integrator.step = {:e} s", self.step());
        require(duration / self.step() <= f64::from(most), name, duration, &expected)
    }
}

fn tolerance(value: f64, largest: f64) -> Result<f64, ConfigError> {
    positive("tolerance", value)?;
    within("tolerance", value, 0.0, largest)
}

fn validate_iterations(iterations: u32) -> Result<(), ConfigError> {
    let expected = format!("an integer in [1, {MOST_ITERATIONS}]");
    require((1..=MOST_ITERATIONS).contains(&iterations), "max_iterations", iterations, &expected)
}

/// Error of a velocity beyond which sliding at the speed of a robot, 0.1 m/s, is not told from sticking \[m/s\].
const LARGEST_VELOCITY_ERROR: f64 = 0.01;

/// The impulse that such a velocity has at a link of Aiko, rounded up \[N s\].
const LARGEST_IMPULSE_ERROR: f64 = 0.01;

const MOST_ITERATIONS: u32 = 1_000_000;

/// Most steps of one control period, each divided into at most 1,000 parts of at most `max_iterations` iterations.
pub const MOST_STEPS_PER_PERIOD: u32 = 100_000;

/// Number of equal steps no longer than `step` that divide `duration`.
pub fn steps_in(duration: f64, step: f64) -> u32 {
    (duration / step - STEP_SLACK).ceil().max(1.0) as u32
}

/// A ratio of durations this close to a whole number counts as whole.
const STEP_SLACK: f64 = 1e-9;

// By hand: the derived implementation for a tagged enum does not report which field fails.
impl<'de> Deserialize<'de> for IntegratorConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("IntegratorConfig", &["method"], MethodFirst)
    }
}

/// Reads the method, `implicit` if left out, which must come first, and then its options.
struct MethodFirst;

impl<'de> Visitor<'de> for MethodFirst {
    type Value = IntegratorConfig;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a method and its options")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<IntegratorConfig, A::Error> {
        let mut pending = map.next_key::<String>()?;
        let mut method = Method::default();
        if pending.as_deref() == Some("method") {
            method = map.next_value()?;
            pending = map.next_key()?;
        }
        let options = value::MapAccessDeserializer::new(Options { map, pending, method });
        match method {
            Method::Thesis => ThesisConfig::deserialize(options).map(IntegratorConfig::Thesis),
            Method::Implicit => ImplicitConfig::deserialize(options).map(IntegratorConfig::Implicit),
        }
    }
}

/// The options of a method; any other is rejected.
struct Options<A> {
    map: A,
    /// A name that was read before.
    pending: Option<String>,
    method: Method,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Options<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        let name = match self.pending.take() {
            Some(name) => name,
            None => match self.map.next_key::<String>()? {
                Some(name) => name,
                None => return Ok(None),
            },
        };
        if !self.method.options().contains(&name.as_str()) {
            self.map.next_value_seed(Refusal(self.method))?;
        }
        seed.deserialize(name.into_deserializer()).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

/// Stands for the value of a key that is not an option of the method, so that the error names that key.
struct Refusal(Method);

impl<'de> DeserializeSeed<'de> for Refusal {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, _: D) -> Result<(), D::Error> {
        let (method, options) = (self.0.name(), self.0.options().join(", "));
        Err(D::Error::custom(format!("an option of method=\"{method}\": {options}")))
    }
}
