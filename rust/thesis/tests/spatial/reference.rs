//! The thesis's scheme of the spatial model against trajectories of an independent implementation: links
//! 1, 6 and 11, every 0.1 s.

use nalgebra::Vector3;
use snake_core::gait::CardanGait;
use snake_core::simulation::Simulation;
use snake_core::spatial::Spatial;
use snake_test_support::spatial::{on_course, rows, sidewinding, straight, undulation};
use snake_thesis::spatial::SpatialThesis;

use crate::thesis;

/// Worst distances of the CGs of links 6, 1 and 11 from the reference, up to `duration`.
fn worst_distance(
    name: &str,
    mut simulation: Simulation<Spatial, SpatialThesis>,
    gait: &CardanGait,
    duration: f64,
) -> [f64; 3] {
    let (mut worst, mut time) = ([0.0_f64; 3], 0.0);
    for row in rows(name).iter().take_while(|row| row[0] < duration + 1e-6) {
        let report = simulation.advance(row[0] - time, gait);
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        time = row[0];
        for (k, link) in [5, 0, 10].into_iter().enumerate() {
            let expected = Vector3::from_row_slice(&row[1 + 3 * k..4 + 3 * k]);
            worst[k] = worst[k].max((simulation.state().pose[link].position - expected).norm());
        }
    }
    println!("{name}: within {worst:?} m of links 6, 1, 11 to {duration} s");
    worst
}

/// At the printed step; the tolerance of Table 7.2, 2e-5 N s, gives 0.13 mm.
#[test]
fn thesis_follows_the_course_reference_for_ten_seconds() {
    let worst = worst_distance("table-7.5", on_course(&thesis(2.5e-4, 1e-6)), &undulation(), 10.0);
    assert!(worst.iter().all(|&distance| distance < 2e-4), "{worst:?}");
}

/// How the contacts share the weight is left open by the model, and friction depends on it: stopping the iteration at
/// 2e-5, 1e-6 or 1e-8 N s moves link 6 by several millimetres.
#[test]
fn thesis_follows_the_sidewinding_reference_for_fifteen_seconds() {
    let worst = worst_distance("sidewinding-isotropic", straight(&thesis(2.5e-4, 1e-6)), &sidewinding(), 15.0);
    assert!(worst[0] < 15e-3, "{worst:?}");
}
