//! Nothing allocates in a step: every request to the allocator is counted.

use snake_test_support::allocation::REQUESTS;
use snake_test_support::spatial::{on_course, sidewinding, straight, undulation};

use crate::thesis;

/// One warm-up sizes what depends on the pegs; after it neither stepping nor placing the robot asks for memory.
#[test]
fn a_step_does_not_allocate() {
    let method = thesis(2.5e-4, 2e-5);
    for (mut simulation, gait) in [(on_course(&method), undulation()), (straight(&method), sidewinding())] {
        let start = simulation.state().clone();
        simulation.advance(0.05, &gait);
        let before = REQUESTS.get();
        simulation.advance(1.0, &gait);
        simulation.place(&start);
        simulation.advance(0.5, &gait);
        assert_eq!(REQUESTS.get() - before, 0);
    }
}
