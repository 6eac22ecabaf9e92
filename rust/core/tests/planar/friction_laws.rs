//! Coulomb friction seen from outside: sliding distance, stiction, direction of orthotropic sliding.

use snake_test_support::friction_scenes::{G, THRESHOLD, bent_pair, slides_along_the_normal_of_the_ellipse, sliding};
use snake_test_support::planar::{Hold, LIMP, build, ground, links};

use crate::{fit_for_the_gait, schemes};

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
            let mut simulation = sliding(&links(3), &ground(friction), velocity, &integrator);
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

#[test]
fn orthotropic_friction_turns_the_velocity_as_the_normal_of_the_ellipse_says() {
    let friction = [0.2, 0.3];
    for (name, integrator) in schemes(1e-3) {
        let simulation = sliding(&links(2), &ground(friction), [0.3, 0.3], &integrator);
        slides_along_the_normal_of_the_ellipse(name, simulation, friction);
    }
}

#[test]
fn below_the_stiction_threshold_nothing_creeps_at_all() {
    for step in [1e-3, 1e-2] {
        for (name, integrator) in schemes(step) {
            for fraction in [0.5, 0.9, 0.999] {
                let mut simulation = bent_pair(fraction * THRESHOLD, &ground([0.2, 0.2]), &integrator);
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
            let mut simulation = bent_pair(excess * THRESHOLD, &ground([0.2, 0.2]), &integrator);
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
    for (name, integrator) in fit_for_the_gait(5e-3, 1e-10) {
        let mut simulation =
            snake_test_support::planar::aiko(&ground([0.1, 0.4]), snake_test_support::planar::START_FREE, &integrator);
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
