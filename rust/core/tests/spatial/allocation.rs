//! Nothing allocates in a step of the spatial model: every request to the allocator is counted.

use nalgebra::Vector2;
use snake_core::obstacles::ObstacleGrid;
use snake_core::scene::SceneConfig;
use snake_core::spatial::{SpatialFleet, SpatialScripted};
use snake_test_support::planar::table_7_5;
use snake_test_support::spatial::{implicit, lying, on_course, sidewinding, straight, undulation};

use snake_test_support::allocation::REQUESTS;
use snake_test_support::lanes::WIDE;

/// One warm-up sizes what depends on the pegs; after it neither stepping nor placing the robot asks for memory.
#[test]
fn a_step_does_not_allocate() {
    for integrator in [implicit(0.01, 1), implicit(0.01, 2)] {
        for (mut simulation, gait) in [(on_course(&integrator), undulation()), (straight(&integrator), sidewinding())] {
            let start = simulation.state().clone();
            simulation.advance(0.05, &gait);
            let before = REQUESTS.get();
            simulation.advance(1.0, &gait);
            simulation.place(&start);
            simulation.advance(0.5, &gait);
            assert_eq!(REQUESTS.get() - before, 0, "{integrator:?}");
        }
    }
}

/// On rough ground many stages are left to the fallback.
#[test]
fn a_step_that_takes_the_fallback_does_not_allocate() {
    let rough = SceneConfig { friction: [2.0, 2.0], ..table_7_5() };
    let posture: Vec<_> = (0..10).map(|j| Vector2::new(0.4 * (f64::from(j) * 1.7).sin(), 0.0)).collect();
    let mut simulation = lying(&rough, [5.0, 0.0, 0.3], &posture, &implicit(0.01, 2));
    simulation.advance(0.05, &undulation());
    let before = REQUESTS.get();
    let report = simulation.advance(1.0, &undulation());
    assert!(report.fallbacks > 10, "{report:?}");
    assert_eq!(REQUESTS.get() - before, 0);
}

/// Robots side by side, of which all but one are among pegs; some steps are divided.
#[test]
fn a_step_of_a_fleet_does_not_allocate() {
    let config = implicit(0.025, 2);
    let start = on_course(&config);
    let system = start.system();
    let mut robots: Vec<_> = (0..9)
        .map(|k| {
            let pegs = ObstacleGrid::of(&table_7_5().obstacles[..k.min(7)]);
            let mut robot =
                SpatialScripted::new(&system.robot, pegs, start.state().pose[0], &[Vector2::zeros(); 10], undulation());
            robot.body.state.copy_from(start.state());
            robot
        })
        .collect();
    let mut fleet = SpatialFleet::new(config, system, WIDE.max(robots.len()));
    fleet.advance(system, robots.iter_mut().map(SpatialScripted::driven), 0.1);
    let before = REQUESTS.get();
    fleet.advance(system, robots.iter_mut().map(SpatialScripted::driven), 1.0);
    assert_eq!(REQUESTS.get() - before, 0);
    assert!(robots.iter().any(|robot| robot.body.statistics.events > 0), "no step was divided");
}
