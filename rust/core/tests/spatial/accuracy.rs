//! The implicit scheme of the spatial model against trajectories of an independent implementation (`tests/data`).

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::gait::{CardanGait, CardanTarget, Gait, Reference, Wave};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::twist_of;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{Unannounced, ground};
use snake_test_support::spatial::{implicit, lying, on_course, rows, sidewinding, straight, undulation};

/// Worst distance of the CG of link 6 from the reference up to `duration` \[m\]; no stage may miss its tolerance.
fn worst_distance(name: &str, mut simulation: SpatialSimulation, gait: &CardanGait, duration: f64) -> f64 {
    let (mut worst, mut time, mut fallbacks, mut iterations) = (0.0_f64, 0.0, 0, 0);
    for row in rows(name).iter().take_while(|row| row[0] < duration + 1e-6) {
        let report = simulation.advance(row[0] - time, gait);
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        time = row[0];
        fallbacks += report.fallbacks;
        iterations += report.iterations;
        let expected = Vector3::from_row_slice(&row[1..4]);
        worst = worst.max((simulation.state().pose[5].position - expected).norm());
    }
    println!("{name}: link 6 within {worst:.5} m to {duration} s, {iterations} solves, {fallbacks} fallbacks");
    worst
}

/// Steps that are taken in full close to the solution do not lead back to where they came from.
#[test]
fn long_steps_on_the_course_do_not_go_round() {
    let mut fallbacks = 0;
    for step in (3..=12).map(|k| 0.01 * f64::from(k)).chain([0.025, 1.0 / 15.0]) {
        let report = on_course(&implicit(step, 2)).advance(5.0, &undulation());
        println!("step {step}: {} linear solves, {} fallbacks", report.iterations, report.fallbacks);
        assert!(report.unconverged == 0, "step {step}: {report:?}");
        // A stage that went round would take up to 200.
        assert!(report.iterations < 10_000, "step {step}: {report:?}");
        fallbacks += report.fallbacks;
    }
    assert!(fallbacks <= 4, "{fallbacks} fallbacks in twelve runs");
}

#[test]
fn follows_the_course_reference_for_ten_seconds() {
    let worst = worst_distance("table-7.5", on_course(&implicit(0.0025, 2)), &undulation(), 10.0);
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn follows_the_sidewinding_reference_for_fifteen_seconds() {
    let worst = worst_distance("sidewinding-isotropic", straight(&implicit(0.0025, 2)), &sidewinding(), 15.0);
    assert!(worst < 5e-3, "{worst}");
}

/// Pegs guide the robot and undo most of an error, so that steps ten times as long do on a course.
#[test]
fn follows_the_course_reference_in_long_steps() {
    let worst = worst_distance("table-7.5", on_course(&implicit(0.025, 2)), &undulation(), 10.0);
    assert!(worst < 4e-4, "{worst}");
}

/// Soft start lets the reference of 17 joint axes jump by up to 3 degrees, and a stiff joint throws its link: what long
/// steps smear there is never made good. Parts end at the jumps, and shorten there where these are not announced.
#[test]
fn jumps_of_the_reference_are_met_where_they_are() {
    let frictions = [0.16, 0.18, 0.2, 0.22, 0.24];
    let exact = frictions.map(|friction| sidewound(friction, 0.001, &sidewinding()));
    let mean_error = |gait: &dyn Fn(f64) -> Vector3<f64>| {
        let errors: Vec<f64> = frictions.iter().zip(&exact).map(|(&mu, end)| (gait(mu) - end).norm()).collect();
        println!("sidewinding from rest in steps of 50 ms: link 6 within {errors:.4?} m after 5 s");
        errors.iter().sum::<f64>() / errors.len() as f64
    };
    let met = mean_error(&|friction| sidewound(friction, 0.05, &sidewinding()));
    let found = mean_error(&|friction| sidewound(friction, 0.05, &Unannounced(sidewinding())));
    println!("mean {met:.4} m; {found:.4} m where the jumps are not announced");
    assert!(met < 0.005 && found < 0.005, "{met} {found}");
}

/// Where link 6 is after 5 s of sidewinding from rest.
fn sidewound(friction: f64, step: f64, gait: &impl Reference<CardanTarget>) -> Vector3<f64> {
    let posture = [Vector2::zeros(); 10];
    let mut simulation = lying(&ground([friction; 2]), [0.0, 0.0, PI], &posture, &implicit(step, 2));
    simulation.advance(5.0, gait);
    simulation.state().pose[5].position
}

/// What a solver is told about the last step only helps it: a robot that forgets all forces every few steps goes the
/// same way, though most of the time the model leaves open how its contacts share the weight.
#[test]
fn the_path_does_not_depend_on_warm_starts() {
    let config = ImplicitConfig { tolerance: Some(1e-7), ..implicit(0.005, 1) };
    let mut remembering = on_course(&config);
    let mut forgetting = on_course(&config);
    for _ in 0..40 {
        remembering.advance(0.025, &undulation());
        let state = forgetting.state().clone();
        forgetting.place(&state);
        forgetting.advance(0.025, &undulation());
    }
    let poses = remembering.state().pose.iter().zip(&forgetting.state().pose);
    let apart = poses.map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-7, "{apart} m apart after a second");
}

/// A robot that spins while it slides, as far as all of it slides: smooth motion under contact, friction and drives, and
/// impacts of no account.
#[test]
fn the_schemes_have_their_orders() {
    let end = |step: f64, order: u32| {
        let config = ImplicitConfig {
            tolerance: Some(1e-7),
            step_tolerance: Some(1.0),
            impact_step: Some(1e-6),
            ..implicit(step, order)
        };
        let mut simulation = straight(&config);
        let mut state = simulation.state().clone();
        let (centre, spin) = (state.pose[5].position, Vector3::z() * 2.0);
        for (pose, twist) in state.pose.iter().zip(&mut state.twist) {
            let v = Vector3::new(0.8, 1.0, 0.0) + spin.cross(&(pose.position - centre));
            *twist = twist_of(v, pose.orientation.inverse_transform_vector(&spin));
        }
        simulation.place(&state);
        let still = CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) };
        simulation.advance(0.16, &still);
        simulation.state().pose[5].position
    };
    let exact = end(2.5e-4, 2);
    for (order, least) in [(1, 0.9), (2, 1.8)] {
        let errors: Vec<f64> = [0.04, 0.02, 0.01].iter().map(|&step| (end(step, order) - exact).norm()).collect();
        let observed = 0.5 * (errors[0] / errors[2]).log2();
        println!("order {order}: errors {errors:?} m, observed order {observed:.2}");
        assert!(observed > least, "order {order}: {errors:?}");
    }
}
