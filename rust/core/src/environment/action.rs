//! What an action means: the affine map from [-1, 1] to gait parameters and joint angles.

use crate::gait::Wave;

use super::config::ActionMode;
use super::filtered_parameter::Limits;
use super::symmetry::Parity::{self, Even, Odd};

/// Wave parameters, in the order of the action: amplitude, frequency, phase shift, offset.
pub const WAVE_PARAMETERS: usize = 4;

/// One entry of the action: `value = centre + half_range * action` for actions in [-1, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct ActionEntry {
    pub name: String,
    pub centre: f64,
    pub half_range: f64,
    /// Largest rate at which the value follows the action \[unit/s\].
    pub slew: f64,
    pub unit: &'static str,
    pub meaning: &'static str,
    /// What a reflection of the robot does to it.
    pub parity: Parity,
}

impl ActionEntry {
    pub fn low(&self) -> f64 {
        self.centre - self.half_range
    }

    pub fn high(&self) -> f64 {
        self.centre + self.half_range
    }

    pub fn limits(&self) -> Limits {
        Limits { low: self.low(), high: self.high(), slew: self.slew }
    }

    /// The physical value of an action in [-1, 1].
    pub fn value(&self, action: f64) -> f64 {
        self.centre + self.half_range * action
    }

    /// The inverse of [`ActionEntry::value`].
    pub fn normalised(&self, value: f64) -> f64 {
        (value - self.centre) / self.half_range
    }
}

/// The entries of an action, in order.
pub fn entries(mode: ActionMode, joints: usize) -> Vec<ActionEntry> {
    match mode {
        ActionMode::Gait => wave_entries().into(),
        ActionMode::Joints => {
            joint_entries(joints, "joint_angle", [70.0, 150.0], Odd, "reference angle of a joint").collect()
        }
        ActionMode::Residual => wave_entries()
            .into_iter()
            .chain(joint_entries(joints, "joint_offset", [20.0, 60.0], Odd, "angle added to the wave at a joint"))
            .collect(),
    }
}

/// The wave's parameters around the thesis's gait (T 7.3), which is action zero.
///
/// The ranges let an agent bend the body by more than a quarter turn to either side (gamma), shrink or
/// grow the wave, move it 2.5 times as fast as the thesis does, and reverse it slowly.
pub fn wave_entries() -> [ActionEntry; WAVE_PARAMETERS] {
    let wave = Wave::default();
    let unit = "rad";
    [
        entry("amplitude", wave.amplitude, [25.0, 50.0], Even, unit, "amplitude A of the travelling wave"),
        entry(
            "frequency",
            wave.omega,
            [120.0, 240.0],
            Even,
            "rad/s",
            "angular frequency omega of the wave, negative: reverse",
        ),
        entry("phase_shift", wave.beta, [25.0, 25.0], Even, unit, "phase shift beta between adjacent joints"),
        entry(
            "offset",
            wave.gamma,
            [25.0, 50.0],
            Odd,
            unit,
            "offset gamma of all joints, steers; positive: the head turns right",
        ),
    ]
}

/// One entry for each joint; `degrees` as in [`entry`].
pub(super) fn joint_entries(
    joints: usize,
    name: &'static str,
    degrees: [f64; 2],
    parity: Parity,
    meaning: &'static str,
) -> impl Iterator<Item = ActionEntry> {
    (1..=joints).map(move |joint| entry(format!("{name}_{joint}"), 0.0, degrees, parity, "rad", meaning))
}

/// An entry with its half range \[deg\] and slew limit \[deg/s\], per second more where the unit is a rate.
pub(super) fn entry(
    name: impl Into<String>,
    centre: f64,
    degrees: [f64; 2],
    parity: Parity,
    unit: &'static str,
    meaning: &'static str,
) -> ActionEntry {
    let [half_range, slew] = degrees.map(f64::to_radians);
    ActionEntry { name: name.into(), centre, half_range, slew, unit, meaning, parity }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn action_zero_is_the_gait_of_the_thesis() {
        let [amplitude, frequency, phase_shift, offset] = wave_entries().map(|entry| entry.value(0.0));
        let wave = Wave { amplitude, omega: frequency, beta: phase_shift, gamma: offset, phase: 0.0 };
        assert_eq!(wave, Wave::default());
    }

    #[test]
    fn every_mode_lists_one_entry_an_action_element() {
        assert_eq!(entries(ActionMode::Gait, 10).len(), 4);
        assert_eq!(entries(ActionMode::Joints, 10).len(), 10);
        assert_eq!(entries(ActionMode::Residual, 10).len(), 14);
        assert_eq!(entries(ActionMode::Residual, 10)[4].name, "joint_offset_1");
    }

    #[test]
    fn values_and_actions_are_inverse() {
        for entry in entries(ActionMode::Residual, 3) {
            for action in [-1.0, -0.3, 0.0, 1.0] {
                assert!((entry.normalised(entry.value(action)) - action).abs() < 1e-14);
            }
            assert!((entry.value(-1.0) - entry.low()).abs() < 1e-15 && (entry.value(1.0) - entry.high()).abs() < 1e-15);
        }
    }
}
