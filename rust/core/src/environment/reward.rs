//! The reward: a weighted sum of named terms.
//!
//! A term is one row of [`TERMS`]. The weights of the configuration, the `info` entries `reward_<name>`, the sum and
//! the documentation follow from the table.

use std::fmt;

use nalgebra::Vector2;
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::{ConfigError, finite};

use super::motion::Motion;

/// One control period, from which the terms are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Motion of the whole robot at the beginning and at the end of the period.
    pub before: Motion,
    pub after: Motion,
    /// Displacement of the CG towards the goal \[m\].
    pub progress: f64,
    /// Positive actuator work \[J\].
    pub positive_work: f64,
    /// Displacement that a commanded speed asks for, if one is commanded \[m\].
    pub commanded: Option<Vector2<f64>>,
    /// Mean squared change of the action.
    pub action_change: f64,
    /// Links pushed by a peg.
    pub contacts: u32,
    /// The goal was reached in this period.
    pub success: bool,
}

/// One term of the reward: weight times value.
#[derive(Debug)]
pub struct RewardTerm {
    pub name: &'static str,
    pub default_weight: f64,
    /// Unit of the value.
    pub unit: &'static str,
    pub description: &'static str,
    pub value: fn(&Transition) -> f64,
}

/// The terms, in the order in which they are added up.
///
/// At the thesis's speed of 0.16 m/s a control period of 0.05 s earns 0.008 by progress, and a goal 2 m away 2 in all.
/// Progress counts the CG of all links, never one link: a robot that stretches gains nothing by it. The weights are
/// those with which the shipped policies for fields, perturbed courses and all tasks were trained.
pub const TERMS: &[RewardTerm] = &[
    RewardTerm {
        name: "progress",
        default_weight: 1.0,
        unit: "m",
        description: "distance of the CG of the whole body towards the goal, gained in this step; 0 with a commanded \
                      speed",
        value: |t| if t.commanded.is_none() { t.progress } else { 0.0 },
    },
    RewardTerm {
        name: "tracking",
        default_weight: 1.0,
        unit: "m",
        description: "length of the displacement of the CG commanded for this step, minus its distance from the \
                      actual one; 0 without a commanded speed",
        value: |t| {
            let moved = t.after.position - t.before.position;
            t.commanded.map_or(0.0, |commanded| commanded.norm() - (moved - commanded).norm())
        },
    },
    RewardTerm {
        name: "energy",
        default_weight: 0.0002,
        unit: "J",
        description: "minus the positive work of the actuators",
        value: |t| -t.positive_work,
    },
    RewardTerm {
        name: "smoothness",
        default_weight: 0.002,
        unit: "1",
        description: "minus the mean squared change of the action",
        value: |t| -t.action_change,
    },
    RewardTerm {
        name: "success",
        default_weight: 3.0,
        unit: "1",
        description: "1 in the step that reaches the goal",
        value: |t| f64::from(t.success),
    },
];

/// Number of terms.
pub const TERM_COUNT: usize = TERMS.len();

static NAMES: [&str; TERM_COUNT] = {
    let mut names = [""; TERM_COUNT];
    let mut term = 0;
    while term < TERM_COUNT {
        names[term] = TERMS[term].name;
        term += 1;
    }
    names
};

fn index_of(name: &str) -> Option<usize> {
    NAMES.iter().position(|known| *known == name)
}

impl Transition {
    /// The value of each term without its weight, in the order of [`TERMS`].
    pub fn term_values(&self) -> [f64; TERM_COUNT] {
        std::array::from_fn(|term| (TERMS[term].value)(self))
    }
}

/// Weighted terms of one step's reward, in the order of [`TERMS`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RewardTerms(pub [f64; TERM_COUNT]);

impl RewardTerms {
    pub fn new(weights: &RewardWeights, values: &[f64; TERM_COUNT]) -> Self {
        Self(std::array::from_fn(|term| weights.0[term] * values[term]))
    }

    /// The reward.
    pub fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    /// The weighted term of a name.
    pub fn get(&self, name: &str) -> Option<f64> {
        index_of(name).map(|term| self.0[term])
    }
}

/// Weights of the terms, in the order of [`TERMS`]; a mapping of names to numbers in a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RewardWeights(pub [f64; TERM_COUNT]);

impl Default for RewardWeights {
    fn default() -> Self {
        Self(std::array::from_fn(|term| TERMS[term].default_weight))
    }
}

impl RewardWeights {
    /// The same weights but for the term of a name, if there is one.
    #[must_use]
    pub fn with(mut self, name: &str, weight: f64) -> Self {
        if let Some(term) = index_of(name) {
            self.0[term] = weight;
        }
        self
    }

    /// The weight of a term.
    pub fn get(&self, name: &str) -> Option<f64> {
        index_of(name).map(|term| self.0[term])
    }

    /// # Errors
    /// Names the weight that is not finite.
    pub fn validate(&self) -> Result<(), ConfigError> {
        NAMES.iter().zip(self.0).try_for_each(|(name, weight)| finite(name, weight).map(drop))
    }
}

impl Serialize for RewardWeights {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(TERM_COUNT))?;
        NAMES.iter().zip(self.0).try_for_each(|(name, weight)| map.serialize_entry(name, &weight))?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for RewardWeights {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("RewardWeights", &NAMES, Weights)
    }
}

/// Reads weights by name; those that are absent keep their defaults.
struct Weights;

impl<'de> Visitor<'de> for Weights {
    type Value = RewardWeights;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("struct RewardWeights")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<RewardWeights, A::Error> {
        let mut weights = RewardWeights::default();
        while let Some(TermIndex(term)) = map.next_key()? {
            weights.0[term] = map.next_value()?;
        }
        Ok(weights)
    }
}

/// A term by its name.
struct TermIndex(usize);

impl<'de> Deserialize<'de> for TermIndex {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;
        impl Visitor<'_> for Name {
            type Value = TermIndex;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("the name of a reward term")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TermIndex, E> {
                index_of(name).map(TermIndex).ok_or_else(|| E::unknown_field(name, &NAMES))
            }
        }
        deserializer.deserialize_identifier(Name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_weights_are_set_by_name() {
        for (term, name) in NAMES.iter().enumerate() {
            assert_eq!(index_of(name), Some(term));
            let weights = RewardWeights([0.0; TERM_COUNT]).with(name, 2.0);
            assert_eq!(weights.get(name), Some(2.0));
            assert_eq!(weights.0.iter().sum::<f64>(), 2.0);
        }
        assert_eq!(RewardWeights::default().get("beauty"), None);
    }

    #[test]
    fn weights_are_read_from_a_mapping_of_names() {
        let weights: RewardWeights = serde_json::from_str(r#"{"energy": 3.0}"#).unwrap();
        assert_eq!(weights, RewardWeights::default().with("energy", 3.0));
        assert_eq!(serde_json::from_str::<RewardWeights>(&serde_json::to_string(&weights).unwrap()).unwrap(), weights);
        let unknown = serde_json::from_str::<RewardWeights>(r#"{"beauty": 1.0}"#).unwrap_err().to_string();
        assert!(unknown.contains("unknown field `beauty`") && unknown.contains("`smoothness`"), "{unknown}");
    }

    #[test]
    fn a_weight_that_is_not_finite_is_named() {
        let error = RewardWeights::default().with("success", f64::NAN).validate().unwrap_err().to_string();
        assert!(error.contains("success"), "{error}");
    }
}
