//! What advances a robot that is simulated by itself.

use std::fmt::Debug;

use crate::capabilities::Method;
use crate::error::ConfigError;
use crate::stepping::{Driven, Fleet, ImplicitConfig, Model};

/// A way to advance one robot, with its workspace.
pub trait Scheme<M: Model>: Debug + Clone {
    /// Largest step \[s\].
    fn step(&self) -> f64;

    /// Integrates over `duration` in equal steps no longer than [`Self::step`].
    fn advance(&mut self, system: &M::System, robot: Driven<M>, duration: f64);

    /// The robot was placed: clears what earlier steps have left.
    fn clear(&mut self) {}
}

/// The options of a scheme.
pub trait SchemeConfig<M: Model> {
    type Scheme: Scheme<M>;

    const METHOD: Method;

    /// # Errors
    /// Names the option that is not admissible.
    fn validate(&self) -> Result<(), ConfigError>;

    fn scheme(&self, system: &M::System) -> Self::Scheme;
}

impl<M: Model> Scheme<M> for Fleet<M> {
    fn step(&self) -> f64 {
        self.accuracy().step
    }

    fn advance(&mut self, system: &M::System, robot: Driven<M>, duration: f64) {
        self.advance_all(system, &mut [robot], duration);
    }
}

impl<M: Model> SchemeConfig<M> for ImplicitConfig {
    type Scheme = Fleet<M>;

    const METHOD: Method = Method::Implicit;

    fn validate(&self) -> Result<(), ConfigError> {
        ImplicitConfig::validate(self)
    }

    fn scheme(&self, system: &M::System) -> Fleet<M> {
        Fleet::new(*self, system, 1)
    }
}
