//! The implicit scheme of the spatial model against trajectories of an independent implementation (`tests/data`).

mod common;

#[path = "common/spatial_runs.rs"]
mod runs;

use nalgebra::Vector3;
use runs::{implicit, on_course, rows, sidewinding, straight, undulation};
use snake_core::gait::CardanGait;
use snake_core::spatial_simulation::SpatialSimulation;

/// Worst distance of the CG of link 6 from the reference up to `duration` \[m\]; no stage may miss its tolerance.
fn worst_distance(name: &str, mut simulation: SpatialSimulation, gait: &CardanGait, duration: f64) -> f64 {
    let (mut worst, mut time, mut fallbacks, mut iterations) = (0.0_f64, 0.0, 0, 0);
    for row in rows(name).iter().take_while(|row| row[0] < duration + 1e-6) {
        let report = simulation.advance(row[0] - time, gait);
        assert!(!report.diverged && report.misses == 0, "{report:?}");
        time = row[0];
        fallbacks += report.fallbacks;
        iterations += report.iterations;
        let expected = Vector3::from_row_slice(&row[1..4]);
        worst = worst.max((simulation.state().pose[5].position - expected).norm());
    }
    println!("{name}: link 6 within {worst:.5} m to {duration} s, {iterations} solves, {fallbacks} fallbacks");
    worst
}

#[test]
fn follows_the_course_reference_for_ten_seconds() {
    let worst = worst_distance("table-7.5", on_course(&implicit(0.0025, 2)), &undulation(), 10.0);
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn follows_the_sidewinding_reference_for_fifteen_seconds() {
    let worst = worst_distance("sidewinding-isotropic", straight(&implicit(0.0025, 2)), &sidewinding(), 15.0);
    assert!(worst < 15e-3, "{worst}");
}

/// Pegs guide the robot and undo most of an error, so that steps ten times as long do on a course.
#[test]
fn follows_the_course_reference_in_long_steps() {
    let worst = worst_distance("table-7.5", on_course(&implicit(0.025, 2)), &undulation(), 10.0);
    assert!(worst < 4e-4, "{worst}");
}
