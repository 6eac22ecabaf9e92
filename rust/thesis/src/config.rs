//! Options of time stepping by either method.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor, value};
use serde::{Deserialize, Serialize};
use snake_core::ConfigError;
use snake_core::capabilities::Method;
use snake_core::error::{positive, time_step};
use snake_core::stepping::{ImplicitConfig, steps_in, tolerance, validate_iterations};

/// Options of the method `thesis`; `None` takes the model's own default.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "thesis", default)]
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
    /// # Errors
    /// Names the option that is not admissible.
    pub fn validate(&self) -> Result<(), ConfigError> {
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

/// The impulse that a velocity of 0.01 m/s, the largest tolerance of the method `implicit`, has at a link of Aiko, rounded
/// up \[N s\].
const LARGEST_IMPULSE_ERROR: f64 = 0.01;

/// The method and its options.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
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
}

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
        if !options_of(self.method).contains(&name.as_str()) {
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
        let (method, options) = (self.0.name(), options_of(self.0).join(", "));
        Err(D::Error::custom(format!("an option of method=\"{method}\": {options}")))
    }
}

/// The options that a method has.
fn options_of(method: Method) -> &'static [&'static str] {
    match method {
        Method::Thesis => &["step", "tolerance", "max_iterations", "r_t", "r_h", "r_n", "r_v"],
        Method::Implicit => {
            &["step", "tolerance", "max_iterations", "order", "step_tolerance", "impact_step", "precision"]
        }
    }
}
