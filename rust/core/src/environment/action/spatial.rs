//! The action of the spatial model: the part of the yaw angles, then that of the pitch angles.

use crate::environment::config::ActionMode;
use crate::environment::default_gait::DefaultGait;

use super::Parameter::{Amplitude, Frequency, Offset, Phase, PhaseShift};
use super::{ActionEntry, PITCH, YAW, entry, joint_entries};

/// The entries of an action, in order; action zero holds `gait`. All ranges together keep the references within 90
/// degrees.
pub fn spatial_entries(mode: ActionMode, gait: &DefaultGait, joints: usize) -> Vec<ActionEntry> {
    let mut entries = Vec::new();
    if mode != ActionMode::Joints {
        entries.extend(horizontal_wave(gait));
    }
    match mode {
        ActionMode::Gait => {}
        ActionMode::Joints => {
            entries.extend(joint_entries(YAW, joints, "yaw", [70.0, 150.0], "reference of a joint's yaw angle"));
        }
        ActionMode::Residual => {
            let meaning = "angle added to the horizontal wave at a joint";
            entries.extend(joint_entries(YAW, joints, "yaw_offset", [10.0, 60.0], meaning));
        }
    }
    if mode != ActionMode::Joints {
        entries.extend(vertical_wave(gait));
    }
    match mode {
        ActionMode::Gait => {}
        ActionMode::Joints => {
            let meaning = "reference of a joint's pitch angle; positive lowers the next link";
            entries.extend(joint_entries(PITCH, joints, "pitch", [45.0, 100.0], meaning));
        }
        ActionMode::Residual => {
            let meaning = "angle added to the vertical wave at a joint";
            entries.extend(joint_entries(PITCH, joints, "pitch_offset", [10.0, 60.0], meaning));
        }
    }
    entries
}

/// The amplitude ends at 60 degrees; the phase shift reaches zero, at which all joints bend alike and the robot rolls.
fn horizontal_wave(gait: &DefaultGait) -> [ActionEntry; 4] {
    let wave = &gait.yaw;
    let frequency = "angular frequency omega of both waves, negative: reverse";
    let shift = "phase shift beta between adjacent joints, of both waves";
    let offset = "offset gamma of all yaw angles, steers; positive: the head turns right";
    let reach = LARGEST_AMPLITUDE - wave.amplitude.to_degrees();
    [
        entry("amplitude", Amplitude(YAW), wave.amplitude, [reach, 50.0], "amplitude A of the horizontal wave"),
        entry("frequency", Frequency, wave.omega, [120.0, 240.0], frequency),
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
