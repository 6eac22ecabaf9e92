//! The action of the planar model.

use crate::environment::config::ActionMode;
use crate::gait::Wave;

use super::Parameter::{Amplitude, Frequency, Offset, PhaseShift};
use super::{ActionEntry, YAW, entry, joint_entries};

/// The entries of an action, in order.
pub fn planar_entries(mode: ActionMode, joints: usize) -> Vec<ActionEntry> {
    match mode {
        ActionMode::Gait => wave_entries().into(),
        ActionMode::Joints => {
            joint_entries(YAW, joints, "joint_angle", [70.0, 150.0], "reference angle of a joint").collect()
        }
        ActionMode::Residual => {
            let meaning = "angle added to the wave at a joint";
            let offsets = joint_entries(YAW, joints, "joint_offset", [20.0, 60.0], meaning);
            wave_entries().into_iter().chain(offsets).collect()
        }
    }
}

/// The wave's parameters around the thesis's gait (T 7.3), which is action zero.
///
/// The ranges let an agent bend the body by more than a quarter turn to either side (gamma), shrink or
/// grow the wave, move it 2.5 times as fast as the thesis does, and reverse it slowly.
pub fn wave_entries() -> [ActionEntry; 4] {
    let wave = Wave::default();
    let frequency = "angular frequency omega of the wave, negative: reverse";
    let offset = "offset gamma of all joints, steers; positive: the head turns right";
    [
        entry("amplitude", Amplitude(YAW), wave.amplitude, [25.0, 50.0], "amplitude A of the travelling wave"),
        entry("frequency", Frequency, wave.omega, [120.0, 240.0], frequency),
        entry("phase_shift", PhaseShift, wave.beta, [25.0, 25.0], "phase shift beta between adjacent joints"),
        entry("offset", Offset(YAW), wave.gamma, [25.0, 50.0], offset),
    ]
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
        assert_eq!(planar_entries(ActionMode::Gait, 10).len(), 4);
        assert_eq!(planar_entries(ActionMode::Joints, 10).len(), 10);
        assert_eq!(planar_entries(ActionMode::Residual, 10).len(), 14);
        assert_eq!(planar_entries(ActionMode::Residual, 10)[4].name, "joint_offset_1");
    }

    #[test]
    fn values_and_actions_are_inverse() {
        for entry in planar_entries(ActionMode::Residual, 3) {
            for action in [-1.0, -0.3, 0.0, 1.0] {
                assert!((entry.normalised(entry.value(action)) - action).abs() < 1e-14);
            }
            assert!((entry.value(-1.0) - entry.low()).abs() < 1e-15 && (entry.value(1.0) - entry.high()).abs() < 1e-15);
        }
    }
}
