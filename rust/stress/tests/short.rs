//! The stress suite in its short form; `make stress` runs the long one.

use snake_stress::scenarios::{Effort, all};
use snake_stress::table::measure;

#[test]
fn no_scenario_breaks_its_requirements() {
    let mut broken = Vec::new();
    for scenario in all(Effort::Short, 0) {
        let row = measure(&scenario);
        println!("{} {:.1} s", row.line(), row.seconds);
        broken.extend(row.broken.into_iter().map(|what| (scenario.name, what)));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}
