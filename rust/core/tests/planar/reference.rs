//! Trajectories of an independent implementation (`tests/data`), every link, every 0.1 s.

use snake_core::scene::START_7_5;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{START_FREE, distance_from_reference, ground, table_7_5};

/// The default scheme at its default step and tolerance against the converged limit.
#[test]
fn default_scheme_is_within_3_mm_of_the_limit_in_free_undulation() {
    let worst = distance_from_reference(
        "isotropic-converged",
        &ground([0.2, 0.2]),
        START_FREE,
        &ImplicitConfig::default(),
        5.0,
    );
    assert!(worst < 3e-3, "{worst:e}");
}

#[test]
fn default_scheme_is_within_1_mm_of_the_limit_on_the_course() {
    let worst =
        distance_from_reference("table-7.5-converged", &table_7_5(), START_7_5, &ImplicitConfig::default(), 5.0);
    assert!(worst < 1e-3, "{worst:e}");
}
