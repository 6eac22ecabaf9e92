//! The action of the planar model.

use crate::environment::config::ActionMode;
use crate::gait::Wave;

use super::Parameter::{Amplitude, Frequency, Offset, PhaseShift};
use super::{ANGLES, ActionEntry, JointAction, JointKind, Reach, YAW, entry, joint_entries};

/// The entries of an action, in order.
pub fn planar_entries(mode: ActionMode, joints: usize, reach: Reach) -> Vec<ActionEntry> {
    let of_joints = |name, kind, meaning| joint_entries(joints, vec![JointAction { axis: YAW, name, kind, meaning }]);
    match mode {
        ActionMode::Gait => wave_entries(reach).into(),
        ActionMode::Joints => {
            let kind = JointKind::Angle([ANGLES[YAW], reach.rate_about(YAW)]);
            of_joints("joint_angle", kind, "reference angle of a joint").collect()
        }
        ActionMode::Residual => {
            let meaning = "angle added to the wave at a joint";
            let offsets = of_joints("joint_offset", JointKind::Angle([20.0, 60.0]), meaning);
            wave_entries(reach).into_iter().chain(offsets).collect()
        }
        ActionMode::Velocities => {
            let meaning = "rate of the reference angle of a joint";
            of_joints("joint_velocity", JointKind::Rate(reach.rate_about(YAW)), meaning).collect()
        }
        ActionMode::Torques => {
            let meaning = "torque of an actuator, positive where it increases the joint angle";
            of_joints("joint_torque", JointKind::Torque(reach.torque), meaning).collect()
        }
    }
}

/// The wave's parameters around the thesis's gait (T 7.3), which is action zero.
///
/// The ranges let an agent bend the body by more than a quarter turn to either side (gamma), shrink or
/// grow the wave, move it as fast as the motors can, or 2.5 times as fast as the thesis does, and reverse it.
pub fn wave_entries(reach: Reach) -> [ActionEntry; 4] {
    let wave = Wave::default();
    let frequency = "angular frequency omega of the wave, negative: reverse";
    let offset = "offset gamma of all joints, steers; positive: the head turns right";
    [
        entry("amplitude", Amplitude(YAW), wave.amplitude, [25.0, 50.0], "amplitude A of the travelling wave"),
        entry("frequency", Frequency, wave.omega, reach.frequencies(wave.amplitude, wave.omega), frequency),
        entry("phase_shift", PhaseShift, wave.beta, [25.0, 25.0], "phase shift beta between adjacent joints"),
        entry("offset", Offset(YAW), wave.gamma, [25.0, 50.0], offset),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDEAL: Reach = Reach { torque: 7.0, ..Reach::UNLIMITED };

    #[test]
    fn action_zero_is_the_gait_of_the_thesis() {
        let [amplitude, frequency, phase_shift, offset] = wave_entries(IDEAL).map(|entry| entry.value(0.0));
        let wave = Wave { amplitude, omega: frequency, beta: phase_shift, gamma: offset, phase: 0.0 };
        assert_eq!(wave, Wave::default());
    }

    #[test]
    fn every_mode_lists_one_entry_an_action_element() {
        let entries = |mode| planar_entries(mode, 10, IDEAL);
        assert_eq!(entries(ActionMode::Gait).len(), 4);
        assert_eq!(entries(ActionMode::Joints).len(), 10);
        assert_eq!(entries(ActionMode::Residual).len(), 14);
        assert_eq!(entries(ActionMode::Residual)[4].name, "joint_offset_1");
        assert_eq!(entries(ActionMode::Velocities).len(), 10);
        let torque = &entries(ActionMode::Torques)[9];
        assert_eq!((torque.name.as_str(), torque.high(), torque.parameter.unit()), ("joint_torque_10", 7.0, "N m"));
    }

    #[test]
    fn the_fastest_wave_turns_joints_as_fast_as_their_motors() {
        let reach = Reach { rate: 4.8, ..IDEAL };
        let [amplitude, frequency, ..] = wave_entries(reach);
        assert!((amplitude.value(0.0) * frequency.high() - 4.8).abs() < 1e-12);
        assert_eq!(frequency.value(0.0), wave_entries(IDEAL)[1].value(0.0));
        let slow = &wave_entries(Reach { rate: 0.1, ..IDEAL })[1];
        assert!(slow.low().abs() < 1e-12, "the range begins at standstill");
        let rates = planar_entries(ActionMode::Velocities, 3, reach);
        assert!((rates[0].high() - 4.8).abs() < 1e-12);
        let angles = planar_entries(ActionMode::Joints, 3, reach);
        assert!((angles[0].slew - 4.8).abs() < 1e-12);
    }

    #[test]
    fn values_and_actions_are_inverse() {
        for entry in planar_entries(ActionMode::Residual, 3, IDEAL) {
            for action in [-1.0, -0.3, 0.0, 1.0] {
                assert!((entry.normalised(entry.value(action)) - action).abs() < 1e-14);
            }
            assert!((entry.value(-1.0) - entry.low()).abs() < 1e-15 && (entry.value(1.0) - entry.high()).abs() < 1e-15);
        }
    }
}
