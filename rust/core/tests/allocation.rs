//! Nothing allocates in a step: every request to the allocator is counted.

mod common;

#[path = "common/requests.rs"]
mod requests;

use common::{START_FREE, adaptive, aiko, ground, implicit, table_7_5, thesis};
use snake_core::gait::Wave;
use snake_core::scene::START_7_5;

use requests::REQUESTS;

/// One warm-up sizes what depends on the pegs; after it, neither stepping with its events, nor placing
/// the robot again, nor changing to a field of no more pegs asks for memory.
#[test]
fn a_step_asks_for_no_memory() {
    let course = table_7_5();
    let free = ground([0.2, 0.5]);
    let wave = Wave::default();
    for (name, integrator) in [
        ("thesis", thesis(2.5e-4, 1e-6)),
        ("implicit 1", implicit(1e-2, 1)),
        ("implicit 2", implicit(1e-2, 2)),
        ("adaptive", adaptive(1e-4)),
    ] {
        for (place, scene, start) in [("course", &course, START_7_5), ("free", &free, START_FREE)] {
            let mut simulation = aiko(scene, start, &integrator);
            let state = simulation.state().clone();
            simulation.advance(0.05, &wave);
            let before = REQUESTS.get();
            let report = simulation.advance(1.0, &wave);
            simulation.place(&state);
            simulation.set_scene_pegs(&scene.obstacles);
            simulation.advance(0.5, &wave);
            let requests = REQUESTS.get() - before;
            println!("{name} {place}: {requests} requests in {} steps and {} events", report.steps, report.events);
            assert_eq!(requests, 0, "{name} {place}");
        }
    }
}
