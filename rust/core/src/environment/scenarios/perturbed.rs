//! The courses of (T Tables 7.3 and 7.5) with pegs out of place (T 7.3.4).

use std::sync::Arc;

use crate::environment::config::EnvConfig;
use crate::environment::perturbation::{Perturbation, Shift};
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::{ConfigError, require};
use crate::robot::Robot;
use crate::scene::Peg;

use super::course_layout::{CourseLayout, require_aiko};
use super::placement::CLEARANCE;
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "perturbed",
    id: "SnakePerturbed-v1",
    description: "The courses of Tables 7.3 and 7.5 with pegs out of place, as in Figure 7.8 of the thesis. With the \
                  probability `difficulty` a peg is missing, and two more are shifted by up to `difficulty` times one \
                  link diameter. The headline case is `perturbation={\"course\": \"table-7.3\", \"without\": [3], \
                  \"removed\": 0, \"shifted\": 0}`, where the thesis's gait fails.",
    validate: require_aiko,
    scenario: |config, robot| Ok(Arc::new(Perturbed::new(config, robot)?)),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Perturbed {
    /// The courses that may be drawn.
    layouts: Vec<CourseLayout>,
    perturbation: Perturbation,
}

impl Scenario for Perturbed {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let index = if self.layouts.len() > 1 { rng.index(self.layouts.len()) } else { 0 };
        let layout = &self.layouts[index];
        self.perturb(layout, placement, difficulty, rng);
        layout.start_among_pegs(placement, jitter)
    }
}

impl Perturbed {
    /// # Errors
    /// A peg that is moved would touch the robot at the start.
    fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        let perturbation = config.perturbation.clone();
        let courses = perturbation.course.choices().iter();
        let layouts = courses.map(|&course| CourseLayout::new(course, config, robot, &perturbation)).collect();
        let scenario = Self { layouts, perturbation };
        scenario.require_room(&mut Placement::new(robot))?;
        Ok(scenario)
    }

    /// Pegs that always stand elsewhere leave room for the robot.
    fn require_room(&self, placement: &mut Placement) -> Result<(), ConfigError> {
        for layout in &self.layouts {
            placement.assemble(&layout.line, &layout.line.nominal);
            for (k, &(j, ..)) in self.perturbation.moved.iter().enumerate() {
                let Some(peg) = layout.table.get(j - 1).copied().flatten() else { continue };
                let gap = placement.gap_to(&peg);
                let expected = "a place that leaves the robot room at its start";
                let value = format!("{:?}, {gap:.4} m from the robot", [peg.x, peg.y]);
                require(gap > 0.0, &format!("perturbation.moved[{k}]"), value, expected)?;
            }
        }
        Ok(())
    }

    /// Draws the pegs. One that would touch the robot at its nominal start is shifted by halves of its shift until it
    /// does not.
    fn perturb(&self, layout: &CourseLayout, placement: &mut Placement, difficulty: f64, rng: &mut Rng) {
        placement.assemble(&layout.line, &layout.line.nominal);
        let (mut table, mut shifts) = (layout.table.clone(), Vec::new());
        self.perturbation.draw(difficulty, rng, &mut table, &mut shifts);
        for Shift { peg, by } in shifts {
            let Some(peg) = &mut table[peg] else { continue };
            let shifted = |factor: f64| Peg { x: peg.x + factor * by.x, y: peg.y + factor * by.y, ..*peg };
            let mut candidates = (0..MAX_HALVINGS).map(|k| shifted(0.5f64.powi(k)));
            *peg = candidates.find(|peg| placement.gap_to(peg) > CLEARANCE).unwrap_or(*peg);
        }
        placement.pegs.clear();
        placement.pegs.extend(table.iter().flatten().chain(&layout.continuation));
    }
}

/// Halvings of a peg's shift before the peg stays where it is.
const MAX_HALVINGS: i32 = 7;
