//! Pegs where they hurt.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::obstacles::{Obstacle, Peg};

use crate::case::{Case, Motion};

/// A funnel whose rows of pegs converge to less than the robot's width: driven or thrown into it, it jams.
pub fn wedge(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for (angle, slow) in [(0.05, 0.1), (0.2, 1.0), (0.5, 5.0)] {
        for step in [1e-2, 5e-2] {
            let mut case = Case::straight(format!("half angle {angle}, {slow} m/s, h {step} s"), step, duration);
            case.scene.obstacles = obstacles(funnel(angle));
            case.velocity = [-slow, 0.0];
            case.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
            cases.push(case.clone());
            case.name = format!("half angle {angle}, undulating, h {step} s");
            case.velocity = [-0.2, 0.0];
            case.motion = Motion::Wave(Wave { amplitude: 0.3, omega: 3.0, ..Wave::default() });
            cases.push(case);
        }
    }
    cases
}

fn obstacles(pegs: Vec<Peg>) -> Vec<Obstacle> {
    pegs.into_iter().map(Into::into).collect()
}

/// Two rows along -x from just ahead of the robot, closing to 4 cm where the robot is 10.5 cm wide.
fn funnel(angle: f64) -> Vec<Peg> {
    let radius = 0.03;
    let mouth = 0.07 + radius;
    let rows = 0..14;
    let peg = |k: usize, side: f64| {
        let along = 0.06 * k as f64;
        Peg { radius, x: -0.15 - along, y: side * (mouth - along * angle).max(0.02 + radius) }
    };
    rows.flat_map(|k| [peg(k, 1.0), peg(k, -1.0)]).collect()
}

/// Thin pegs in the cracks between the caps of neighbouring links, while the robot bends.
pub fn crack(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for radius in [1e-3, 2e-3, 5e-3] {
        for step in [2e-3, 1e-2, 5e-2] {
            for (name, motion) in [
                ("waves", Motion::Wave(Wave { amplitude: 0.5, omega: 4.0, ..Wave::default() })),
                ("bends", Motion::Hold(0.4)),
                ("jumps", Motion::Jump { angle: 0.5, rate: 2.1 }),
            ] {
                let mut case = Case::straight(format!("{name}, peg of {radius} m, h {step} s"), step, duration);
                case.scene.obstacles = (1..11).step_by(2).map(|joint| notch_peg(joint, radius).into()).collect();
                case.motion = motion;
                case.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
                cases.push(case);
            }
        }
    }
    cases
}

/// A peg that touches the caps of both links at `joint` of the straight robot, in turns above and below.
fn notch_peg(joint: usize, radius: f64) -> Peg {
    let (half, cap, centre) = (0.061, 0.0525, 0.0393);
    let beside: f64 = half - centre;
    let across = ((cap + radius) * (cap + radius) - beside * beside).sqrt();
    let side = if joint % 4 == 1 { 1.0 } else { -1.0 };
    Peg { radius, x: (2.0 * joint as f64 - 1.0) * half, y: side * across }
}

/// Pegs inside the robot at the start: next to a link's centre line, on it, and several at once.
pub fn deep(duration: f64) -> Vec<Case> {
    let sets: [(&str, Vec<Peg>); 5] = [
        ("2 cm deep", vec![Peg { radius: 0.05, x: 0.5, y: 0.0825 }]),
        ("on the centre line", vec![Peg { radius: 0.02, x: 0.488, y: 0.0 }]),
        ("large, over two links", vec![Peg { radius: 0.3, x: 0.55, y: 0.2 }]),
        ("from both sides", vec![Peg { radius: 0.05, x: 0.5, y: 0.09 }, Peg { radius: 0.05, x: 0.5, y: -0.09 }]),
        (
            "all along, both sides",
            (0..10)
                .map(|k| Peg { radius: 0.03, x: 0.122 * f64::from(k), y: if k % 2 == 0 { 0.06 } else { -0.06 } })
                .collect(),
        ),
    ];
    let mut cases = Vec::new();
    for (name, pegs) in sets {
        for step in [1e-2, 5e-2] {
            let mut case = Case::straight(format!("{name}, h {step} s"), step, duration);
            case.scene.obstacles = obstacles(pegs.clone());
            case.controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
            cases.push(case);
        }
    }
    cases
}

/// A robot thrown at a peg.
pub fn fast(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for speed in [1.0, 10.0, 100.0] {
        for step in [1e-3, 1e-2, 5e-2] {
            for (name, velocity, peg) in [
                ("head on", [-speed, 0.0], Peg { radius: 0.05, x: -0.6, y: 0.0 }),
                ("sideways", [0.0, speed], Peg { radius: 0.05, x: 0.61, y: 0.5 }),
                ("glancing", [-speed, 0.0], Peg { radius: 0.05, x: -0.6, y: 0.07 }),
            ] {
                let mut case = Case::straight(format!("{name}, {speed} m/s, h {step} s"), step, duration);
                case.scene.obstacles = vec![peg.into()];
                case.velocity = velocity;
                cases.push(case);
            }
        }
    }
    cases
}

/// A limp robot without friction thrown among pegs: nothing can give it energy.
pub fn limp(duration: f64) -> Vec<Case> {
    let mut cases = Vec::new();
    for speed in [1.0, 10.0, 100.0] {
        for step in [1e-3, 1e-2, 5e-2] {
            for order in [1, 2] {
                let name = format!("{speed} m/s, h {step} s, order {order}");
                let mut case = Case::straight(name, step, duration);
                case.scene.obstacles = (0..60)
                    .map(|k| Peg { radius: 0.05, x: 0.4 * f64::from(k % 12) - 2.0, y: 0.5 + 0.4 * f64::from(k / 12) })
                    .map(Into::into)
                    .collect();
                case.scene.friction = [0.0, 0.0];
                case.controller = ControllerConfig { kp: 0.0, kd: 0.0, ..ControllerConfig::default() };
                case.integrator.order = order;
                case.velocity = [-0.3 * speed, speed];
                cases.push(case);
            }
        }
    }
    cases
}
