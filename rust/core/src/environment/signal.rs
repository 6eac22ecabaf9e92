//! Signals: what a step reports beside the observation, in a fixed order.
//!
//! A signal is one row of [`SIGNALS`], or of [`RobotModel::SIGNALS`] where only one model has it; the weighted reward
//! terms come first. `info` of the Python environments follows from the rows. The same signals exist after a reset and
//! after a step.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::reward::{RewardTerms, TERM_COUNT, TERMS};
use super::robot_model::RobotModel;

/// Type of a signal in `info`; here every signal is an f64.
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
    /// The values of the reward's terms without weights.
    pub term_values: [f64; TERM_COUNT],
    pub progress: f64,
    pub positive_work: f64,
    pub motor_power: f64,
    pub electrical_power: f64,
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
    pub unconverged: u32,
    pub fallbacks: u32,
    pub diverged: bool,
    pub penetrated: bool,
    pub time: f64,
}

/// A signal that is read from a `T`.
#[derive(Debug)]
pub struct Signal<T> {
    pub name: &'static str,
    pub kind: SignalKind,
    pub unit: &'static str,
    pub description: &'static str,
    pub value: fn(&T) -> f64,
}

/// The signals that every environment has beside its reward terms, in order.
pub const SIGNALS: &[Signal<Summary>] = &[
    float("progress", "m", "distance of the CG towards the goal, gained in this step", |s| s.progress),
    float("positive_work", "J", "actuator work of this step: max(torque x rate, 0) over joint axes and time", |s| {
        s.positive_work
    }),
    float("motor_power", "W", "mechanical power of all actuators together, mean over this step", |s| s.motor_power),
    float(
        "electrical_power",
        "W",
        "what motors draw, heat included, nothing where they would give energy back; 0 without `motor`",
        |s| s.electrical_power,
    ),
    float("distance", "m", "distance of the CG towards the goal, gained since the start", |s| s.distance),
    float("lateral_offset", "m", "CG to the left of the centre line, or of the straight way to the goal point", |s| {
        s.lateral_offset
    }),
    float("heading_error", "rad", "angle from the goal direction to the body direction", |s| s.heading_error),
    float("speed", "m/s", "distance over time since the start", |s| s.speed),
    float(
        "energy",
        "J",
        "`positive_work` of all steps since the start; with `energy=\"electrical\"` what motors drew",
        |s| s.energy,
    ),
    float("cost_of_transport", "1", "`energy` over weight times absolute `distance`, at least 0.01 m", |s| {
        s.cost_of_transport
    }),
    boolean("jam", "CG slower than 0.02 m/s for more than 0.3 s", |s| s.jam.into()),
    float("jam_ratio", "1", "share of the episode's steps that were jammed", |s| s.jam_ratio),
    boolean("is_success", "the goal has been reached", |s| s.is_success.into()),
    boolean("left_corridor", "the CG has left the corridor, or strayed from the goal point", |s| {
        s.left_corridor.into()
    }),
    integer("contacts", "links pushed by an obstacle in this step", |s| s.contacts.into()),
    float("residual", "m/s", "worst certified residual of the contact solver in this step", |s| s.residual),
    integer("iterations", "iterations of the contact solver in this step", |s| s.iterations.into()),
    integer("fallbacks", "solves of this step that Newton's method left to the fallback", |s| s.fallbacks.into()),
    integer("unconverged", "solves of this step that missed their tolerance", |s| s.unconverged.into()),
    integer("misses", "deprecated: the same as `unconverged`", |s| s.unconverged.into()),
    boolean("diverged", "the computation diverged and was stopped", |s| s.diverged.into()),
    boolean("penetrated", "a link ended more than 1 mm inside an obstacle or another link", |s| s.penetrated.into()),
    float("time", "s", "time since the start", |s| s.time),
];

/// Number of signals that every environment has: the reward terms, then [`SIGNALS`].
pub const COUNT: usize = TERM_COUNT + SIGNALS.len();

/// One value for each of them.
pub type SignalRow = [f64; COUNT];

/// Name, type, unit and meaning of one entry of `info`.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalInfo {
    pub name: Cow<'static, str>,
    pub kind: SignalKind,
    pub unit: &'static str,
    pub description: Cow<'static, str>,
}

/// All signals of an environment with a robot model, in order.
pub fn signals_of<M: RobotModel>() -> Vec<SignalInfo> {
    let rewards = TERMS.iter().map(|term| SignalInfo {
        name: format!("reward_{}", term.name).into(),
        kind: SignalKind::Float,
        unit: "1",
        description: format!("weighted reward term: {}", term.description).into(),
    });
    rewards.chain(SIGNALS.iter().map(Signal::info)).chain(M::SIGNALS.iter().map(Signal::info)).collect()
}

impl Summary {
    /// The values of the signals that every environment has.
    pub fn signals(&self) -> SignalRow {
        let mut row = [0.0; COUNT];
        let (rewards, others) = row.split_at_mut(TERM_COUNT);
        rewards.copy_from_slice(&self.reward.0);
        others.iter_mut().zip(SIGNALS).for_each(|(value, signal)| *value = (signal.value)(self));
        row
    }
}

impl<T> Signal<T> {
    fn info(&self) -> SignalInfo {
        let Self { name, kind, unit, description, .. } = *self;
        SignalInfo { name: name.into(), kind, unit, description: description.into() }
    }
}

/// A row of type float.
pub const fn float<T>(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    value: fn(&T) -> f64,
) -> Signal<T> {
    Signal { name, kind: SignalKind::Float, unit, description, value }
}

/// A row of type bool, whose value is 0 or 1.
pub const fn boolean<T>(name: &'static str, description: &'static str, value: fn(&T) -> f64) -> Signal<T> {
    Signal { name, kind: SignalKind::Bool, unit: "1", description, value }
}

/// A row of type int.
pub const fn integer<T>(name: &'static str, description: &'static str, value: fn(&T) -> f64) -> Signal<T> {
    Signal { name, kind: SignalKind::Int, unit: "1", description, value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{PlanarRobot, SpatialRobot};

    #[test]
    fn names_are_distinct() {
        for signals in [signals_of::<PlanarRobot>(), signals_of::<SpatialRobot>()] {
            let mut names: Vec<_> = signals.iter().map(|signal| &signal.name).collect();
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        }
    }

    #[test]
    fn values_follow_the_table() {
        let mut summary = Summary { time: 2.5, jam: true, contacts: 3, ..Summary::default() };
        summary.reward.0[TERMS.iter().position(|term| term.name == "energy").unwrap()] = -0.5;
        let (row, signals) = (summary.signals(), signals_of::<PlanarRobot>());
        let value = |name| row[signals.iter().position(|signal| signal.name == name).unwrap()];
        let names = ["time", "jam", "contacts", "energy", "reward_energy"];
        assert_eq!(names.map(value), [2.5, 1.0, 3.0, 0.0, -0.5]);
    }
}
