//! The stress suite in its short form; `make stress` runs the long one. The two models are tested side by side.

use snake_stress::scenarios::{Effort, Scenario, in_space, in_the_plane};
use snake_stress::table::measure;

#[test]
fn no_scenario_in_the_plane_breaks_its_requirements() {
    require_sound(in_the_plane(Effort::Short, 0));
}

#[test]
fn no_scenario_in_space_breaks_its_requirements() {
    require_sound(in_space(Effort::Short, 0));
}

fn require_sound(scenarios: Vec<Scenario>) {
    let mut broken = Vec::new();
    for scenario in scenarios {
        let row = measure(&scenario);
        println!("{} {:.1} s", row.line(), row.seconds);
        broken.extend(row.broken.into_iter().map(|what| (scenario.name, what)));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}
