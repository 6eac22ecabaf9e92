//! Coulomb friction seen from outside: sliding distance, stiction, direction of orthotropic sliding.

mod common;

use std::f64::consts::FRAC_PI_2;

use common::{Hold, LIMP, build, ground, links, moving_chain, schemes};
use snake_core::control::ControllerConfig;
use snake_core::planar::Twist;
use snake_core::robot::RobotConfig;
use snake_core::simulation::PlanarSimulation;
use snake_core::stepper::IntegratorConfig;

const G: f64 = 9.81;

/// A straight limp robot along the x axis, all links moving with `v`.
fn sliding(robot: &RobotConfig, friction: [f64; 2], v: [f64; 2], integrator: &IntegratorConfig) -> PlanarSimulation {
    let mut simulation = build(robot, &ground(friction), &LIMP, integrator);
    simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; robot.links - 1]);
    let twist = Twist::new(v[0], v[1], 0.0);
    let state = moving_chain(simulation.robot(), &simulation.state().pose.clone(), twist, &vec![0.0; robot.links - 1]);
    simulation.place(&state);
    simulation
}

/// A body sliding at v stops after v^2 / (2 mu g). The midpoint scheme and the second-order stages
/// integrate constant deceleration exactly and err only in the last step, by at most mu g h^2; implicit
/// Euler takes the velocity at the end of each step, which is short by exactly v h / 2 besides.
#[test]
fn a_sliding_robot_stops_after_v_squared_over_two_mu_g() {
    let (v, mu, h) = (0.5, 0.2, 2e-3);
    let exact = v * v / (2.0 * mu * G);
    for axis in 0..2 {
        for (name, integrator) in schemes(h) {
            let mut friction = [0.7, 0.7];
            friction[axis] = mu;
            let mut velocity = [0.0; 2];
            velocity[axis] = v;
            let mut simulation = sliding(&links(3), friction, velocity, &integrator);
            let start = simulation.state().pose[1][axis];
            simulation.advance(0.4, &Hold(0.0));
            let distance = simulation.state().pose[1][axis] - start;
            let expected = if name == "implicit 1" { exact - 0.5 * v * h } else { exact };
            println!("{name}: slid {distance:.6} m, expected {expected:.6} m");
            assert!((distance - expected).abs() < mu * G * h * h, "{name}: {distance} for {expected}");
            let speed = simulation.state().twist.iter().map(|u| u.norm()).fold(0.0, f64::max);
            assert!(speed < 1e-9, "{name} still moves at {speed:e} m/s: beyond the solver's tolerance");
        }
    }
}

/// On orthotropic ground a translating robot obeys v' = -g D^2 v / |D v|, so d ln v_y / d ln v_x is
/// (mu_y / mu_x)^2 and v_y^(mu_x^2) / v_x^(mu_y^2) is constant. Judged until a tenth of the speed remains,
/// where a step of 1 ms takes 5 % of it: the exponent is judged to 5 % of its change of about 2 mu_y^2.
#[test]
fn orthotropic_friction_turns_the_velocity_as_the_normal_of_the_ellipse_says() {
    let (mu_x, mu_y) = (0.2, 0.3);
    for (name, integrator) in schemes(1e-3) {
        let mut simulation = sliding(&links(2), [mu_x, mu_y], [0.3, 0.3], &integrator);
        let integral = |u: Twist| mu_x * mu_x * u.y.ln() - mu_y * mu_y * u.x.ln();
        let start = integral(simulation.state().twist[0]);
        let mut judged = 0;
        while simulation.state().twist[0].norm() > 0.042 {
            simulation.advance(1e-3, &Hold(0.0));
            let drift = integral(simulation.state().twist[0]) - start;
            assert!(drift.abs() < 0.05 * 2.0 * mu_y * mu_y, "{name}: {drift:e}");
            judged += 1;
        }
        assert!(judged > 80, "{judged}");
    }
}

/// Two links at a right angle with a constant joint torque: the friction at the two CGs alone resists.
/// The CGs lie d = L cos(phi/2) apart, and the power balance F d' = T phi' with d' = -L/2 sin(phi/2) phi'
/// gives the threshold T* = mu m g (L/2) sin(phi/2).
const THRESHOLD: f64 = 0.2 * (7.5 / 11.0) * G * 0.5 * 0.122 * std::f64::consts::FRAC_1_SQRT_2;

/// The drive saturates at its limit, so the torque is constant whatever the joint does.
fn bent_pair(torque: f64, integrator: &IntegratorConfig) -> PlanarSimulation {
    let pd = ControllerConfig { kp: 10.0, kd: 0.0, torque_limit: Some(torque), ..ControllerConfig::default() };
    let mut simulation = build(&links(2), &ground([0.2, 0.2]), &pd, integrator);
    simulation.place_chain(0.3, -0.2, 0.7, &[FRAC_PI_2]);
    simulation
}

#[test]
fn below_the_stiction_threshold_nothing_creeps_at_all() {
    for step in [1e-3, 1e-2] {
        for (name, integrator) in schemes(step) {
            for fraction in [0.5, 0.9, 0.999] {
                let mut simulation = bent_pair(fraction * THRESHOLD, &integrator);
                let start = simulation.state().pose.clone();
                let mut fastest: f64 = 0.0;
                for _ in 0..200 {
                    simulation.advance(step, &Hold(3.0));
                    fastest = simulation.state().twist.iter().map(|u| u.norm()).fold(fastest, f64::max);
                }
                let moved: f64 =
                    simulation.state().pose.iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                println!("{name} h {step} at {fraction} T*: fastest {fastest:.1e} rad/s, moved {moved:.1e}");
                // Omega = 2 v / L: a slip at the solver's tolerance of 1e-10 m/s is 2e-9 rad/s, and
                // residuals of 200 steps may add up in the pose.
                assert!(fastest < 1e-8 && moved < 200.0 * step * 1e-8, "{name} {fraction}: {fastest:e}");
            }
        }
    }
}

/// Just above the threshold the joint opens with phi'' = (T - T*) / (m L^2 sin^2(phi/2) / 8 + Theta / 2).
/// A tenth of a second bends the joint by about 0.01 rad, and T* with it by that times cot(phi/2) / 2.
#[test]
fn above_the_stiction_threshold_the_joint_accelerates_as_the_reduced_equation_says() {
    let (m, length, theta) = (7.5 / 11.0, 0.122, 1.32e-3);
    let inertia = m * length * length * 0.5 / 8.0 + 0.5 * theta;
    for (name, integrator) in schemes(1e-3) {
        for excess in [1.01, 1.1] {
            let mut simulation = bent_pair(excess * THRESHOLD, &integrator);
            let duration = 0.02;
            simulation.advance(duration, &Hold(3.0));
            let expected = (excess - 1.0) * THRESHOLD / inertia * duration;
            let rate = simulation.state().joint_rate(0);
            println!("{name} at {excess} T*: rate {rate:.6} rad/s, reduced equation {expected:.6}");
            assert!((rate / expected - 1.0).abs() < 0.02, "{name}: {rate} for {expected}");
        }
    }
}

/// The friction never does positive work, and the robot at rest without drive stays exactly at rest.
#[test]
fn friction_power_is_never_positive_and_rest_is_rest() {
    for (name, integrator) in schemes(5e-3) {
        let integrator = if name == "thesis" { common::thesis(2.5e-4, 1e-10) } else { integrator };
        let mut simulation = common::aiko(&ground([0.1, 0.4]), common::START_FREE, &integrator);
        let wave = snake_core::gait::Wave::default();
        for _ in 0..60 {
            let report = simulation.advance(5e-3, &wave);
            // P . gamma <= 0 for every link of every stage; the sum of 11 signed terms is exact enough.
            assert!(report.friction_work <= 1e-12, "{name}: {:e} J", report.friction_work);
        }
        let mut still = build(&links(11), &ground([0.2, 0.2]), &LIMP, &integrator);
        still.place_chain(0.1, 0.2, 0.3, &[0.4; 10]);
        let start = still.state().pose.clone();
        still.advance(0.5, &Hold(0.0));
        let moved = still.state().pose.iter().zip(&start).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(moved < 1e-14, "{name}: round-off of closing the joints only, {moved:e}");
    }
}
