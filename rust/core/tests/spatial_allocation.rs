//! Nothing allocates in a step of the spatial model: every request to the allocator is counted.

mod common;

#[path = "common/requests.rs"]
mod requests;

#[path = "common/spatial_runs.rs"]
mod runs;

use common::thesis;
use runs::{implicit, on_course, sidewinding, straight, undulation};

use requests::REQUESTS;

/// One warm-up sizes what depends on the pegs; after it neither stepping nor placing the robot asks for memory.
#[test]
fn a_step_asks_for_no_memory() {
    for integrator in [thesis(2.5e-4, 2e-5), implicit(0.01, 1), implicit(0.01, 2)] {
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
