//! Robots folded onto themselves.

use nalgebra::Vector2;
use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;

use crate::case::{Case, Motion};
use crate::spatial_case::{CardanMotion, SpatialCase};

/// Coils that are pressed together, joints that jump between folds, and waves whose bends close on the body.
pub fn coils(duration: f64) -> Vec<Case> {
    let motions = [
        ("coil", Motion::Hold(1.1)),
        ("coil against the stops", Motion::Hold(1.8)),
        ("jumping folds", Motion::Jump { angle: 1.3, rate: 1.7 }),
        ("closing bends", Motion::Wave(Wave { amplitude: 1.4, omega: 5.0, beta: -0.6, ..Wave::default() })),
    ];
    let mut cases = Vec::new();
    for (name, motion) in motions {
        for step in [1e-2, 2.5e-2, 5e-2] {
            for torque_limit in [Some(10.0), None] {
                let limit = torque_limit.map_or("no torque limit".to_owned(), |limit| format!("at most {limit} N m"));
                let mut case = Case::straight(format!("{name}, {limit}, h {step} s"), step, duration);
                case.motion = motion;
                case.controller = ControllerConfig { torque_limit, ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}

/// The same in 3D: helices that lie on themselves, flat coils and folds that jump, and waves in both axes.
pub fn spatial_coils(duration: f64) -> Vec<SpatialCase> {
    let wave = |amplitude, phase| Motion::Wave(Wave { amplitude, omega: 4.0, beta: -0.6, phase, ..Wave::default() });
    let motions = [
        ("helix", CardanMotion { yaw: Motion::Hold(1.1), pitch: Motion::Hold(0.15) }),
        ("flat coil", CardanMotion { yaw: Motion::Hold(1.1), pitch: Motion::Hold(0.0) }),
        ("arched coil", CardanMotion { yaw: Motion::Hold(0.0), pitch: Motion::Hold(1.0) }),
        (
            "jumping folds",
            CardanMotion { yaw: Motion::Jump { angle: 1.2, rate: 1.7 }, pitch: Motion::Jump { angle: 0.3, rate: 0.9 } },
        ),
        ("closing bends", CardanMotion { yaw: wave(1.3, 0.0), pitch: wave(0.4, 1.0) }),
    ];
    let mut cases = Vec::new();
    for (name, motion) in motions {
        for step in [1e-2, 2.5e-2] {
            for torque_limit in [Some(10.0), None] {
                let limit = torque_limit.map_or("no torque limit".to_owned(), |limit| format!("at most {limit} N m"));
                let mut case = SpatialCase::straight(format!("{name}, {limit}, h {step} s"), step, duration);
                case.posture = Some(vec![Vector2::zeros(); 10]);
                case.motion = motion;
                case.controller = ControllerConfig { torque_limit, ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}
