//! Nothing allocates in a step: every request to the allocator is counted.

use snake_core::control::ControllerConfig;
use snake_core::gait::Wave;
use snake_core::laws::Stribeck;
use snake_core::robot::RobotConfig;
use snake_core::scene::{START_7_5, SceneConfig};
use snake_test_support::planar::{START_FREE, aiko, build, ground, implicit, posture, table_7_5, thesis};

use snake_test_support::allocation::REQUESTS;

/// One warm-up sizes what depends on the pegs; after it, neither stepping with its events, nor placing
/// the robot again, nor changing to a field of no more pegs asks for memory.
#[test]
fn a_step_does_not_allocate() {
    let course = table_7_5();
    let free = ground([0.2, 0.5]);
    let wave = Wave::default();
    for (name, integrator) in
        [("thesis", thesis(2.5e-4, 1e-6)), ("implicit 1", implicit(1e-2, 1)), ("implicit 2", implicit(1e-2, 2))]
    {
        for (place, scene, start) in [("course", &course, START_7_5), ("free", &free, START_FREE)] {
            let mut simulation = aiko(scene, start, &integrator);
            let state = simulation.state().clone();
            let pegs = simulation.pegs().to_vec();
            simulation.advance(0.05, &wave);
            let before = REQUESTS.get();
            let report = simulation.advance(1.0, &wave);
            simulation.place(&state);
            simulation.set_scene_pegs(&pegs);
            simulation.advance(0.5, &wave);
            let requests = REQUESTS.get() - before;
            println!("{name} {place}: {requests} requests in {} steps and {} events", report.steps, report.events);
            assert_eq!(requests, 0, "{name} {place}");
        }
    }
}

/// Neither do backlash and falling friction.
#[test]
fn nor_does_a_step_of_a_loose_robot() {
    let wave = Wave::default();
    let robot = RobotConfig { backlash: 0.07, ..RobotConfig::default() };
    let scene = SceneConfig { stribeck: Stribeck { drop: 0.3, speed: 0.02 }, ..table_7_5() };
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
