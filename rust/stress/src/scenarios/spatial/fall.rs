//! Robots that fall, tumble, fly, or start in an odd posture.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::obstacles::{Obstacle, Shape};
use snake_core::scene::Peg;

use crate::spatial_case::{CardanMotion, SpatialCase};

/// Dropped from 10 cm, level and tilted, in steps from the thesis's to a whole control period.
pub fn drops(duration: f64) -> Vec<SpatialCase> {
    let mut cases = Vec::new();
    for step in [2.5e-4, 1e-3, 1e-2, 2.5e-2, 5e-2] {
        for order in [1, 2] {
            for (name, pitch, roll) in [("level", 0.0, 0.0), ("tilted", 0.2, 0.4)] {
                // As many steps for all but the longest.
                let lasts = duration.min(2000.0 * step);
                let mut case = SpatialCase::straight(format!("{name}, h {step} s, order {order}"), step, lasts);
                case.integrator.order = order;
                case.attitude = [0.3, pitch, roll];
                case.height = 0.1;
                cases.push(case);
            }
        }
    }
    cases
}

/// Upright, on its side, upside down, folded; with drives that hold and without.
pub fn postures(duration: f64) -> Vec<SpatialCase> {
    let attitudes: [(&str, [f64; 3]); 5] = [
        ("upright", [0.0, FRAC_PI_2, 0.0]),
        ("head down", [0.0, -FRAC_PI_2, 0.3]),
        ("nearly upright", [0.4, FRAC_PI_2 - 1e-9, 0.0]),
        ("on its side", [0.3, 0.0, FRAC_PI_2]),
        ("upside down", [0.3, 0.0, PI]),
    ];
    let mut cases = Vec::new();
    for (name, attitude) in attitudes {
        for bend in [0.0, 0.6] {
            for step in [1e-2, 5e-2] {
                for (drives, kp, kd) in [("held", 800.0, 2.0), ("limp", 0.0, 0.0)] {
                    let name = format!("{name}, joints {bend} rad, {drives}, h {step} s");
                    let mut case = SpatialCase::straight(name, step, duration);
                    case.attitude = attitude;
                    case.posture = Some((0..10).map(|j| Vector2::new(bend, -bend * f64::from(j % 3 - 1))).collect());
                    case.controller = ControllerConfig { kp, kd, ..ControllerConfig::default() };
                    cases.push(case);
                }
            }
        }
    }
    cases
}

/// A limp chain without friction thrown high up, spinning: without contacts.
pub fn flight(duration: f64) -> Vec<SpatialCase> {
    let mut cases = Vec::new();
    for spin in [1.0, 5.0, 20.0] {
        for step in [1e-3, 1e-2, 2.5e-2, 5e-2] {
            for order in [1, 2] {
                let name = format!("{spin} rad/s, h {step} s, order {order}");
                let mut case = SpatialCase::straight(name, step, duration).limp();
                case.integrator.order = order;
                case.height = 1e4;
                case.posture = Some((0..10).map(|j| Vector2::new(0.3, 0.2 * (f64::from(j) * 1.3).sin())).collect());
                case.velocity = Vector3::new(1.0, -2.0, 3.0);
                case.spin = Vector3::new(0.3, 0.5, 0.8) * spin;
                cases.push(case);
            }
        }
    }
    cases
}

/// A limp chain without friction thrown over and off the edges of obstacles of finite height.
pub fn edges(duration: f64) -> Vec<SpatialCase> {
    let solid = |shape, height| Obstacle { height: Some(height), ..Obstacle::endless(shape) };
    let block = |size, x, y, height| solid(Shape::Box { size, x, y, angle: 0.0 }, height);
    let post = |radius, x, y, height| solid(Shape::Circle(Peg { radius, x, y }), height);
    let places = [
        ("over a sill", vec![block([0.3, 3.0], -0.4, 0.0, 0.03)], 0.0),
        ("over a low post", vec![post(0.1, -0.4, 0.02, 0.03)], 0.0),
        ("onto a block", vec![block([0.2, 0.2], 0.5, 0.03, 0.2)], 0.05),
        ("onto a post", vec![post(0.1, 0.5, 0.03, 0.2)], 0.05),
        (
            "down stairs",
            (0..5).map(|k| block([3.0 - 0.4 * f64::from(k), 2.0], 1.0, 0.0, 0.05 * f64::from(k + 1))).collect(),
            0.05,
        ),
    ];
    let mut cases = Vec::new();
    for (name, obstacles, height) in places {
        for step in [1e-3, 1e-2, 2.5e-2, 5e-2] {
            for order in [1, 2] {
                let name = format!("{name}, h {step} s, order {order}");
                let mut case = SpatialCase::straight(name, step, duration).limp();
                (case.integrator.order, case.height) = (order, height);
                case.scene.obstacles = obstacles.clone();
                case.velocity = Vector3::new(-0.8, 0.1, 0.0);
                case.attitude = [PI + 0.4, 0.0, 0.0];
                cases.push(case);
            }
        }
    }
    cases
}

/// Pegs that touch the end spheres of both links at a joint, from one side and, with a little play, from both, while
/// the robot moves.
pub fn crack(duration: f64) -> Vec<SpatialCase> {
    let (half, sphere, cap) = (0.061, 0.0393, 0.0525);
    // The chain lies towards -x.
    let notch = |joint: u32, side: f64, radius: f64, play: f64| {
        let across = (f64::powi(cap + radius, 2) - f64::powi(half - sphere, 2)).sqrt();
        Peg { radius, x: -f64::from(2 * joint - 1) * half, y: side * (across + play) }
    };
    let motions = [
        ("waves", CardanMotion::undulation()),
        ("winds", CardanMotion::sidewinding(0.5, 0.2)),
        ("rolls", CardanMotion::rolling()),
    ];
    let mut cases = Vec::new();
    for radius in [2e-3, 5e-2] {
        for both in [false, true] {
            for (name, motion) in motions {
                for step in [1e-2, 2.5e-2] {
                    let name = format!("{name}, pegs of {radius} m, both sides {both}, h {step} s");
                    let mut case = SpatialCase::straight(name, step, duration);
                    let side = |joint: u32| if joint.is_multiple_of(2) { 1.0 } else { -1.0 };
                    let alternating = (1..11).step_by(3).map(|joint| notch(joint, side(joint), radius, 0.0).into());
                    case.scene.obstacles = alternating.collect();
                    if both {
                        case.scene.obstacles.extend([1.0, -1.0].map(|side| notch(5, side, radius, PLAY).into()));
                    }
                    case.motion = motion;
                    case.posture = Some(vec![Vector2::zeros(); 10]);
                    case.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
                    cases.push(case);
                }
            }
        }
    }
    cases
}

/// Between a joint and each of two pegs that hold it from both sides \[m\]. Without any the joint can bend by nothing
/// at all, and what its drive asks for is a force without bound.
const PLAY: f64 = 1e-4;
