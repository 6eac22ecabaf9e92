//! Nothing allocates in a step: every request to the allocator is counted. See also scheme_laws.rs.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::obstacles::Patch;
use snake_core::robot::RobotConfig;
use snake_core::scene::{START_7_5, SceneConfig};
use snake_test_support::planar::{aiko, build, implicit, posture, table_7_5};

use snake_test_support::allocation::REQUESTS;

/// A robot with backlash on ground with falling friction, some of it ice.
#[test]
fn nor_does_a_step_of_a_loose_robot() {
    let wave = Wave::default();
    let robot = RobotConfig { backlash: 0.07.into(), ..RobotConfig::default() };
    let ice = Patch { vertices: vec![[-9.0, 0.1], [9.0, 0.1], [0.0, 9.0]], factor: 0.5 };
    let stribeck = Stribeck { drop: 0.3, speed: 0.02 };
    let scene = SceneConfig { stribeck, patches: vec![ice], ..table_7_5() };
    for integrator in [implicit(1e-2, 1), implicit(1e-2, 2)] {
        let mut simulation = build(&robot, &scene, &ControllerConfig::default(), &integrator);
        simulation.place_chain(START_7_5[0], START_7_5[1], START_7_5[2], &posture(&wave, 10));
        simulation.advance(0.05, &wave);
        let before = REQUESTS.get();
        simulation.advance(1.0, &wave);
        assert_eq!(REQUESTS.get() - before, 0, "{integrator:?}");
    }
}

/// Nor does the fallback of a robot that jams among rough pegs.
#[test]
fn nor_does_a_step_among_rough_pegs() {
    let mut scene = table_7_5();
    scene.obstacles.iter_mut().for_each(|obstacle| obstacle.friction = 1.0);
    let wave = Wave::default();
    let mut simulation = aiko(&scene, START_7_5, &implicit(1e-2, 2));
    simulation.advance(0.05, &wave);
    let before = REQUESTS.get();
    let report = simulation.advance(4.0, &wave);
    assert!(report.fallbacks > 0, "the fallback was not needed");
    assert_eq!(REQUESTS.get() - before, 0);
}
