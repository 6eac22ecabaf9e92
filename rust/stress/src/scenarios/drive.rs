//! Steps, gains and torque limits.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;

use crate::case::{Case, Motion};

/// From 1 ms to a whole control period, both orders, loose and tight tolerances.
pub fn steps(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for step in [1e-3, 5e-3, 1e-2, 2.5e-2, 5e-2] {
        for order in [1, 2] {
            for tolerance in [1e-6, 1e-8] {
                let mut case =
                    Case::course(format!("h {step} s, order {order}, tolerance {tolerance:e}"), step, duration);
                case.integrator.order = order;
                case.integrator.tolerance = Some(tolerance);
                cases.push(case);
            }
        }
    }
    cases
}

/// From limp to rigid.
pub fn gains(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for kp in [0.0, 1.0, 30.0, 800.0, 3e4, 1e6] {
        for kd in [0.0, 2.0, 1e3] {
            for step in [1e-2, 5e-2] {
                let mut case = Case::course(format!("k_P {kp:e}, k_D {kd:e}, h {step} s"), step, duration);
                case.controller = ControllerConfig { kp, kd, ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}

/// Drives at their limit nearly all the time, in both directions.
pub fn torque_limit(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for limit in [1e-3, 0.1, 1.0, 10.0] {
        for step in [1e-2, 5e-2] {
            for (name, kp, motion) in [
                ("wave", 1e6, Motion::Wave(Wave { omega: 20.0, ..Wave::default() })),
                ("jumps", 1e4, Motion::Jump { angle: 0.6, rate: 7.3 }),
                ("hold", 1e6, Motion::Hold(0.3)),
            ] {
                let mut case = Case::course(format!("{name}, {limit} N m, k_P {kp:e}, h {step} s"), step, duration);
                case.posture =
                    Some((0..10).map(|joint| Wave::default().amplitude * (joint as f64 * -0.87).sin()).collect());
                case.controller = ControllerConfig { kp, torque_limit: Some(limit), ..ControllerConfig::default() };
                case.motion = motion;
                cases.push(case);
            }
        }
    }
    cases
}
