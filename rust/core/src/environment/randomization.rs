//! Domain randomisation over the thesis's own list of discrepancies (T 7.5.4).
//!
//! Every quantity has a range of its own; a range of one value, `[1, 1]` for a factor and zero for an
//! error, switches it off, and so do the defaults. Draws belong to an episode, those of a sensor to a step.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::control::ControlLaw;
use crate::error::{ConfigError, require, within};
use crate::noise::NoiseConfig;
use crate::robot::MOST_PLAY;
use crate::scene::Peg;
use crate::stepping::PlantParameters;

use super::rng::Rng;

/// Ranges `[low, high]` of uniform draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Randomization {
    /// Factor on both friction coefficients.
    pub friction: [f64; 2],
    /// Further factor on the coefficient across a link.
    pub anisotropy: [f64; 2],
    /// Factor on mass and inertia of all links.
    pub mass: [f64; 2],
    /// Factor on the largest torque of a joint.
    pub torque_limit: [f64; 2],
    /// How often the joint references take over a new action \[Hz\]; `None`: in every control period.
    pub reference_rate: Option<f64>,
    /// Time from an action to its effect on the references \[s\], in whole control periods.
    pub reference_delay: [f64; 2],
    /// Amplitudes of uniform noise on what is observed (T Table 7.4).
    pub noise: NoiseConfig,
    /// Largest error of a located peg's position, which stays the same for an episode \[m\].
    pub peg_error: f64,
    /// Backlash of the joints beyond the robot's own \[rad\].
    #[serde(alias = "free_play")]
    pub backlash: [f64; 2],
    /// Drop of friction in sliding beyond the ground's own, see [`crate::laws::Stribeck`].
    pub stribeck: [f64; 2],
}

impl Default for Randomization {
    fn default() -> Self {
        let same = [1.0, 1.0];
        Self {
            friction: same,
            anisotropy: same,
            mass: same,
            torque_limit: same,
            reference_rate: None,
            reference_delay: [0.0, 0.0],
            noise: NoiseConfig::default(),
            peg_error: 0.0,
            backlash: [0.0, 0.0],
            stribeck: [0.0, 0.0],
        }
    }
}

/// What an episode has drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EpisodeParameters {
    pub parameters: PlantParameters,
    /// \[s\]
    pub delay: f64,
}

impl Randomization {
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        range("friction", self.friction, [0.0, 10.0])?;
        range("anisotropy", self.anisotropy, [0.0, 10.0])?;
        range("mass", self.mass, [0.1, 10.0])?;
        range("torque_limit", self.torque_limit, [0.01, 10.0])?;
        range("reference_delay", self.reference_delay, [0.0, LONGEST_DELAY])?;
        if let Some(rate) = self.reference_rate {
            within("reference_rate", rate, SLOWEST_RATE, FASTEST_RATE)?;
        }
        self.noise.validate().map_err(|e| e.inside("noise"))?;
        within("peg_error", self.peg_error, 0.0, 1.0)?;
        range("backlash", self.backlash, [0.0, MOST_PLAY])?;
        range("stribeck", self.stribeck, [0.0, 1.0])
    }

    /// Checks what depends on the environment.
    ///
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate_for(&self, control_period: f64) -> Result<(), ConfigError> {
        self.validate()?;
        range("reference_delay", self.reference_delay, [0.0, LONGEST_DELAY.min(MOST_PERIODS * control_period)])?;
        if let Some(rate) = self.reference_rate {
            within("reference_rate", rate, SLOWEST_RATE, (1.0 + 1e-9) / control_period)?;
        }
        Ok(())
    }

    /// Checks what is added to a robot's backlash `play` \[rad\] and of the ground's `drop` of friction.
    ///
    /// # Errors
    /// Names the field, its value and the admissible range.
    pub fn validate_beyond(&self, play: f64, law: ControlLaw, drop: f64) -> Result<(), ConfigError> {
        let has_play = self.backlash != [0.0, 0.0];
        let expected = "[0, 0] with an input-output linearising controller";
        require(!has_play || law == ControlLaw::Pd, "backlash", format!("{:?}", self.backlash), expected)?;
        range("backlash", self.backlash, [0.0, MOST_PLAY - play])?;
        range("stribeck", self.stribeck, [0.0, 1.0 - drop])
    }

    /// Draws an episode's robot; as many numbers whatever the ranges.
    pub fn draw(&self, rng: &mut Rng) -> EpisodeParameters {
        let mut factor = |[low, high]: [f64; 2]| rng.uniform(low, high);
        let friction = factor(self.friction);
        let friction = Vector2::new(friction, friction * factor(self.anisotropy));
        let (mass, torque_limit) = (factor(self.mass), factor(self.torque_limit));
        let delay = factor(self.reference_delay);
        let (backlash, stribeck) = (factor(self.backlash), factor(self.stribeck));
        EpisodeParameters { parameters: PlantParameters { friction, mass, torque_limit, backlash, stribeck }, delay }
    }

    /// The pegs as the robot locates them, each off by a vector uniform in a disc.
    pub fn misplace(&self, rng: &mut Rng, pegs: &mut [Peg]) {
        for peg in pegs {
            let reach = self.peg_error * rng.unit().sqrt();
            let (sin, cos) = rng.around_zero(std::f64::consts::PI).sin_cos();
            (peg.x, peg.y) = (peg.x + reach * cos, peg.y + reach * sin);
        }
    }
}

fn range(field: &str, [low, high]: [f64; 2], [least, most]: [f64; 2]) -> Result<(), ConfigError> {
    let ok = least <= low && low <= high && high <= most;
    let expected = format!("[low, high] with {least} <= low <= high <= {most}");
    require(ok, field, format!("[{low}, {high}]"), &expected)
}

/// \[s\], and in control periods.
const LONGEST_DELAY: f64 = 10.0;
const MOST_PERIODS: f64 = 100.0;

/// \[Hz\]
const SLOWEST_RATE: f64 = 0.1;
const FASTEST_RATE: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_drawn_off_by_default() {
        assert_eq!(Randomization::default().draw(&mut Rng::new(3, 4)), EpisodeParameters::default());
    }

    #[test]
    fn draws_fill_their_ranges() {
        let ranges = Randomization {
            friction: [0.5, 1.5],
            anisotropy: [1.0, 2.0],
            mass: [0.9, 1.1],
            torque_limit: [0.5, 1.0],
            reference_delay: [0.05, 0.15],
            backlash: [0.02, 0.1],
            stribeck: [0.1, 0.4],
            ..Randomization::default()
        };
        let draws: Vec<EpisodeParameters> = (0..400).map(|seed| ranges.draw(&mut Rng::new(seed, 0))).collect();
        let spans = |read: fn(&EpisodeParameters) -> f64, [low, high]: [f64; 2]| {
            let values = || draws.iter().map(read);
            let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
            // Of 400 draws the nearest to an end is farther than a twentieth of the range once in 10^8 times.
            let near = 0.05 * (high - low);
            assert!(low <= least && least < low + near && high - near < most && most <= high, "{least} {most}");
        };
        spans(|drawn| drawn.parameters.friction.x, ranges.friction);
        spans(|drawn| drawn.parameters.friction.y / drawn.parameters.friction.x, ranges.anisotropy);
        spans(|drawn| drawn.parameters.mass, ranges.mass);
        spans(|drawn| drawn.parameters.torque_limit, ranges.torque_limit);
        spans(|drawn| drawn.delay, ranges.reference_delay);
        spans(|drawn| drawn.parameters.backlash, ranges.backlash);
        spans(|drawn| drawn.parameters.stribeck, ranges.stribeck);
    }

    #[test]
    fn ranges_that_are_not_admissible_are_named() {
        let good = Randomization::default();
        let cases = [
            ("friction", Randomization { friction: [-0.1, 1.0], ..good }),
            ("anisotropy", Randomization { anisotropy: [1.0, f64::NAN], ..good }),
            ("mass", Randomization { mass: [1.2, 0.8], ..good }),
            ("torque_limit", Randomization { torque_limit: [0.0, 1.0], ..good }),
            ("reference_delay", Randomization { reference_delay: [0.0, 6.0], ..good }),
            ("reference_rate", Randomization { reference_rate: Some(21.0), ..good }),
            ("peg_error", Randomization { peg_error: -0.1, ..good }),
            ("backlash", Randomization { backlash: [0.1, 2.0], ..good }),
            ("stribeck", Randomization { stribeck: [-0.1, 0.5], ..good }),
        ];
        for (field, randomization) in cases {
            assert_eq!(randomization.validate_for(0.05).unwrap_err().field, field);
        }
        let heavy = Randomization { mass: [1.0, 1.1], ..good };
        assert!(heavy.validate_for(0.05).is_ok());
    }
}
