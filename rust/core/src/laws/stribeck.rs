use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, positive, within};
use crate::math::Real;

/// The Stribeck effect (T 7.5.4): friction falls once a body slides, `mu(v) = mu (1 - drop v^2 / (v^2 + speed^2))`.
///
/// mu is the coefficient of a body at rest, `mu (1 - drop)` that of one that slides fast. The form is that of Hess and
/// Soom (1990), one of those in the survey of Armstrong-Helouvry, Dupont and Canudas de Wit (1994); it takes a
/// single division and has a closed-form stopping distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stribeck {
    /// Share of the friction that is lost in fast sliding, in \[0, 1\]; zero switches the effect off.
    pub drop: f64,
    /// Sliding speed at which half of that is lost \[m/s\].
    pub speed: f64,
}

impl Default for Stribeck {
    fn default() -> Self {
        Self { drop: 0.0, speed: 0.02 }
    }
}

impl Stribeck {
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        within("drop", self.drop, 0.0, 1.0)?;
        positive("speed", self.speed)?;
        Ok(())
    }

    /// What is left of the friction at a squared sliding speed \[m^2/s^2\].
    pub fn share(&self, squared_speed: f64) -> f64 {
        remaining(self.drop, self.speed * self.speed, squared_speed)
    }
}

/// [`Stribeck::share`] in lanes; exactly one without the effect.
#[inline(always)]
pub fn remaining<T: Real>(drop: T, squared_scale: T, squared_speed: T) -> T {
    T::splat(1.0) - drop * (squared_speed / (squared_speed + squared_scale))
}
