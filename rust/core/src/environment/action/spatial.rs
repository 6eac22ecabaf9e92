//! The action of the spatial model: the waves, then the joints one by one, yaw before pitch as everywhere.

use crate::environment::config::ActionMode;
use crate::environment::default_gait::DefaultGait;
use crate::robot::Axes;

use super::Parameter::{Amplitude, Frequency, Offset, Phase, PhaseShift};
use super::{ANGLES, ActionEntry, JointAction, JointKind, PITCH, Reach, YAW, entry, joint_entries};

/// The entries of an action, in order; action zero holds `gait`, all ranges together keep the references
/// within 90 degrees.
pub fn spatial_entries(mode: ActionMode, gait: &DefaultGait, axes: &[Axes], reach: Reach) -> Vec<ActionEntry> {
    let joint_entries = |all| joint_entries(axes.len(), all).filter_map(|entry| of_own_axis(entry, axes));
    let of_axis = |axis, name, kind, meaning| JointAction { axis, name, kind, meaning };
    let waves = || horizontal_wave(gait, reach).into_iter().chain(vertical_wave(gait));
    match mode {
        ActionMode::Gait => waves().collect(),
        ActionMode::Joints => {
            let yaw = JointKind::Angle([ANGLES[YAW], reach.rate_about(YAW)]);
            let pitch = JointKind::Angle([ANGLES[PITCH], reach.rate_about(PITCH)]);
            let meaning = "reference of a joint's pitch angle; positive lowers the next link";
            let all = vec![
                of_axis(YAW, "yaw", yaw, "reference of a joint's yaw angle"),
                of_axis(PITCH, "pitch", pitch, meaning),
            ];
            joint_entries(all).collect()
        }
        ActionMode::Residual => {
            let offset = || JointKind::Angle([10.0, 60.0]);
            let all = vec![
                of_axis(YAW, "yaw_offset", offset(), "angle added to the horizontal wave at a joint"),
                of_axis(PITCH, "pitch_offset", offset(), "angle added to the vertical wave at a joint"),
            ];
            waves().chain(joint_entries(all)).collect()
        }
        ActionMode::Velocities => {
            let all = vec![
                of_axis(
                    YAW,
                    "yaw_velocity",
                    JointKind::Rate(reach.rate_about(YAW)),
                    "rate of the reference of a yaw angle",
                ),
                of_axis(
                    PITCH,
                    "pitch_velocity",
                    JointKind::Rate(reach.rate_about(PITCH)),
                    "rate of that of a pitch angle",
                ),
            ];
            joint_entries(all).collect()
        }
        ActionMode::Torques => {
            let torque = || JointKind::Torque(reach.torque);
            let all = vec![
                of_axis(YAW, "yaw_torque", torque(), "torque that increases a yaw angle"),
                of_axis(PITCH, "pitch_torque", torque(), "torque that increases a pitch angle"),
            ];
            joint_entries(all).collect()
        }
    }
}

/// The entry where its joint has the axis, with the name of that.
fn of_own_axis(entry: ActionEntry, axes: &[Axes]) -> Option<ActionEntry> {
    let (axis, joint) = entry.parameter.of_joint()?;
    let name = match axes[joint] {
        Axes::About(_) => entry.name.replacen(["yaw", "pitch"][axis], axes[joint].name(axis), 1),
        _ => entry.name,
    };
    axes[joint].has(axis).then_some(ActionEntry { name, ..entry })
}

/// The amplitude ends at 60 degrees; the phase shift reaches zero, at which all joints bend alike and the robot rolls.
fn horizontal_wave(gait: &DefaultGait, reach: Reach) -> [ActionEntry; 4] {
    let wave = &gait.yaw;
    let frequency = "angular frequency omega of both waves, negative: reverse";
    let shift = "phase shift beta between adjacent joints, of both waves";
    let offset = "offset gamma of all yaw angles, steers; positive: the head turns right";
    let growth = LARGEST_AMPLITUDE - wave.amplitude.to_degrees();
    [
        entry("amplitude", Amplitude(YAW), wave.amplitude, [growth, 50.0], "amplitude A of the horizontal wave"),
        entry("frequency", Frequency, wave.omega, reach.frequencies(wave.amplitude, wave.omega), frequency),
        entry("phase_shift", PhaseShift, wave.beta, [50.0, 50.0], shift),
        entry("offset", Offset(YAW), wave.gamma, [20.0, 50.0], offset),
    ]
}

fn vertical_wave(gait: &DefaultGait) -> [ActionEntry; 2] {
    let phase = "phase of the vertical wave against the horizontal one";
    [
        entry("lift", Amplitude(PITCH), gait.lift, [20.0, 50.0], "amplitude A_v of the vertical wave"),
        entry("lift_phase", Phase(PITCH), gait.lift_phase, [180.0, 180.0], phase),
    ]
}

/// \[deg\]
const LARGEST_AMPLITUDE: f64 = 60.0;
