//! Robots under way: friction, gains, masses and numbers of links.

use snake_core::control::ControllerConfig;
use snake_core::robot::RobotConfig;
use snake_core::scene::{START_SPATIAL_7_3, TABLE_7_3};

use crate::case::{pegs, weighted};
use crate::spatial_case::{CardanMotion, SpatialCase};

/// Four gaits, with and without the pegs of Table 7.3, each at 10 ms and, with a torque limit of 5 N m, at 25 ms.
pub fn friction(mu: [f64; 2], duration: f64) -> Vec<SpatialCase> {
    let gaits = [
        ("undulation", CardanMotion::undulation()),
        ("sidewinding", CardanMotion::sidewinding(30f64.to_radians(), 10f64.to_radians())),
        ("rolling", CardanMotion::rolling()),
        ("high waves", CardanMotion::sidewinding(50f64.to_radians(), 40f64.to_radians())),
    ];
    let mut cases = Vec::new();
    for (gait, motion) in gaits {
        for among_pegs in [false, true] {
            for (step, torque_limit) in [(1e-2, None), (2.5e-2, Some(5.0))] {
                let name = format!("mu {mu:?}, {gait}, pegs {among_pegs}, h {step} s");
                let mut case = SpatialCase::straight(name, step, duration);
                case.scene.friction = mu;
                case.motion = motion;
                case.controller = ControllerConfig { torque_limit, ..ControllerConfig::default() };
                if among_pegs {
                    let [x, y, yaw] = START_SPATIAL_7_3;
                    (case.place, case.attitude) = ([x, y, 0.0], [yaw, 0.0, 0.0]);
                    case.scene.obstacles = pegs(&TABLE_7_3);
                }
                cases.push(case);
            }
        }
    }
    cases
}

/// From limp to rigid.
pub fn gains(duration: f64) -> Vec<SpatialCase> {
    let mut cases = Vec::new();
    for kp in [0.0, 1.0, 30.0, 800.0, 1e5] {
        for kd in [0.0, 2.0, 100.0] {
            for step in [1e-2, 5e-2] {
                let mut case = SpatialCase::course(format!("k_P {kp:e}, k_D {kd:e}, h {step} s"), step, duration);
                case.controller = ControllerConfig { kp, kd, ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}

/// Whether the link of an index is one of the heavy ones.
type IsHeavy = fn(usize) -> bool;

/// Mass ratios up to a thousand along the chain, winding on the ground.
pub fn mass_ratios(duration: f64) -> Vec<SpatialCase> {
    let mut cases = Vec::new();
    for ratio in [10f64, 1e3] {
        let heavy: [(&str, IsHeavy); 3] =
            [("first link", |i| i == 0), ("middle link", |i| i == 5), ("every other link", |i| i % 2 == 0)];
        for (name, is_heavy) in heavy {
            for step in [1e-2, 5e-2] {
                let mut case = SpatialCase::straight(format!("{name} heavy, 1:{ratio:e}, h {step} s"), step, duration);
                case.robot = weighted(11, |i| if is_heavy(i) { 1.0 } else { 1.0 / ratio });
                case.motion = CardanMotion::sidewinding(0.5, 0.2);
                case.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}

/// From 2 to 50 links.
pub fn links(duration: f64) -> Vec<SpatialCase> {
    let mut cases = Vec::new();
    for links in [2, 3, 11, 30, 50] {
        for step in [1e-2, 5e-2] {
            for (name, motion) in
                [("undulation", CardanMotion::undulation()), ("sidewinding", CardanMotion::sidewinding(0.5, 0.2))]
            {
                let mut case = SpatialCase::straight(format!("{links} links, {name}, h {step} s"), step, duration);
                case.robot = RobotConfig { links, ..RobotConfig::default() };
                case.motion = motion;
                cases.push(case);
            }
        }
    }
    cases
}
