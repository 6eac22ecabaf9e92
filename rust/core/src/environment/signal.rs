//! Signals: what a step reports beside the observation, in a fixed order.
//!
//! A signal is one row of [`SIGNALS`]; `info` of the Python environments is generated from it. The same
//! signals exist after a reset and after a step.

use serde::{Deserialize, Serialize};

use super::reward::RewardTerms;

/// Type of a signal outside; inside every signal is an f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalKind {
    Float,
    Bool,
    Int,
}

impl SignalKind {
    pub fn name(self) -> &'static str {
        match self {
            SignalKind::Float => "float",
            SignalKind::Bool => "bool",
            SignalKind::Int => "int",
        }
    }
}

/// What happened in one control period and in the episode so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Summary {
    pub reward: RewardTerms,
    pub progress: f64,
    pub positive_work: f64,
    pub distance: f64,
    pub lateral_offset: f64,
    pub heading_error: f64,
    pub speed: f64,
    pub energy: f64,
    pub cost_of_transport: f64,
    pub jam: bool,
    pub jam_ratio: f64,
    pub is_success: bool,
    pub left_corridor: bool,
    pub contacts: u32,
    pub residual: f64,
    pub iterations: u32,
    pub misses: u32,
    pub fallbacks: u32,
    pub diverged: bool,
    pub time: f64,
}

/// Name, kind and meaning of a signal that is read from a `T`.
#[derive(Debug)]
pub struct Signal<T> {
    pub name: &'static str,
    pub kind: SignalKind,
    pub unit: &'static str,
    pub description: &'static str,
    pub(super) read: fn(&T) -> f64,
}

impl<T> Signal<T> {
    pub fn value(&self, of: &T) -> f64 {
        (self.read)(of)
    }
}

/// Number of signals that every environment has.
pub const COUNT: usize = SIGNALS.len();

/// One value for each of them.
pub type SignalRow = [f64; COUNT];

/// The signals of every environment, in order.
pub const SIGNALS: [Signal<Summary>; 23] = [
    float("reward_progress", "1", "weighted reward term: progress", |s| s.reward.progress),
    float("reward_energy", "1", "weighted reward term: positive actuator work", |s| s.reward.energy),
    float("reward_smoothness", "1", "weighted reward term: change of the action", |s| s.reward.smoothness),
    float("reward_success", "1", "weighted reward term: goal reached", |s| s.reward.success),
    float("progress", "m", "distance of the CG towards the goal, gained in this step", |s| s.progress),
    float("positive_work", "J", "positive actuator work of this step", |s| s.positive_work),
    float("distance", "m", "distance of the CG towards the goal, gained since the start", |s| s.distance),
    float("lateral_offset", "m", "CG to the left of the centre line, or of the way to the goal point", |s| {
        s.lateral_offset
    }),
    float("heading_error", "rad", "angle from the goal direction to the body direction", |s| s.heading_error),
    float("speed", "m/s", "distance over time since the start", |s| s.speed),
    float("energy", "J", "positive actuator work since the start", |s| s.energy),
    float("cost_of_transport", "1", "energy over weight times distance", |s| s.cost_of_transport),
    boolean("jam", "CG slower than 0.02 m/s for more than 0.3 s", |s| s.jam.into()),
    float("jam_ratio", "1", "share of the episode's steps that were jammed", |s| s.jam_ratio),
    boolean("is_success", "the goal has been reached", |s| s.is_success.into()),
    boolean("left_corridor", "the CG has left the corridor, or strayed from the goal point", |s| {
        s.left_corridor.into()
    }),
    integer("contacts", "links pushed by a peg in this step", |s| s.contacts.into()),
    float("residual", "m/s", "worst certified residual of the contact solver in this step", |s| s.residual),
    integer("iterations", "iterations of the contact solver in this step", |s| s.iterations.into()),
    integer("fallbacks", "solves of this step that Newton's method left to the fallback", |s| s.fallbacks.into()),
    integer("misses", "solves of this step that missed their tolerance", |s| s.misses.into()),
    boolean("diverged", "the computation diverged and was stopped", |s| s.diverged.into()),
    float("time", "s", "time since the start", |s| s.time),
];

impl Summary {
    /// The values of all signals.
    pub fn signals(&self) -> SignalRow {
        let table: &'static [Signal<Summary>; COUNT] = &SIGNALS;
        std::array::from_fn(|signal| table[signal].value(self))
    }
}

const fn float(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    read: fn(&Summary) -> f64,
) -> Signal<Summary> {
    Signal { name, kind: SignalKind::Float, unit, description, read }
}

const fn boolean(name: &'static str, description: &'static str, read: fn(&Summary) -> f64) -> Signal<Summary> {
    Signal { name, kind: SignalKind::Bool, unit: "1", description, read }
}

const fn integer(name: &'static str, description: &'static str, read: fn(&Summary) -> f64) -> Signal<Summary> {
    Signal { name, kind: SignalKind::Int, unit: "1", description, read }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_rows_follow_the_table() {
        let mut names = SIGNALS.map(|signal| signal.name);
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        let row = Summary { time: 2.5, jam: true, contacts: 3, ..Summary::default() }.signals();
        let value = |name| row[SIGNALS.iter().position(|signal| signal.name == name).unwrap()];
        assert_eq!([value("time"), value("jam"), value("contacts"), value("energy")], [2.5, 1.0, 3.0, 0.0]);
    }
}
