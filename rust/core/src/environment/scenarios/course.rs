//! The course of (T Table 7.5), continued to the goal.

use std::sync::Arc;

use crate::environment::perturbation::{Course as Table, Perturbation};
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;

use super::course_layout::{CourseLayout, require_aiko};
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "course",
    id: "SnakeCourse-v1",
    description: "The course of Table 7.5 of the thesis: seven pegs of 12.5 cm radius that fit the gait (7.3), \
                  continued to the goal. The scripted gait gets through; an agent can be faster, or spend less energy.",
    validate: require_aiko,
    scenario: |config, robot| {
        Ok(Arc::new(Course(CourseLayout::new(Table::Table75, config, robot, &Perturbation::default()))))
    },
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Course(CourseLayout);

impl Scenario for Course {
    fn draw(&self, placement: &mut Placement, _: f64, jitter: &StartJitter, _: &mut Rng) -> EpisodeStart {
        let Self(layout) = self;
        placement.pegs.clear();
        placement.pegs.extend(layout.table.iter().flatten().chain(&layout.continuation));
        layout.start_among_pegs(placement, jitter)
    }
}
