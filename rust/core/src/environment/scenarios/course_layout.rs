//! The courses of the thesis: pegs of a table, and those that continue it to the goal.

use crate::environment::config::EnvConfig;
use crate::environment::goal::Target;
use crate::environment::perturbation::{Course, Perturbation};
use crate::environment::start::{StartJitter, StartLine};
use crate::error::{ConfigError, require};
use crate::robot::{PerLink, Robot, RobotConfig};
use crate::scene::{Peg, TABLE_7_5};

use super::peg_region::PegRegion;
use super::{EpisodeStart, Placement};

/// One course: where the robot starts and which pegs stand there.
#[derive(Debug)]
pub struct CourseLayout {
    pub line: StartLine,
    /// The pegs of the table, unless they have been taken away.
    pub table: Vec<Option<Peg>>,
    /// Those that continue it.
    pub continuation: Vec<Peg>,
    goal_distance: f64,
}

impl CourseLayout {
    /// The thesis's start among a course's pegs; Table 7.5 is continued to the goal.
    pub fn new(course: Course, config: &EnvConfig, robot: &Robot, perturbation: &Perturbation) -> Self {
        let line = StartLine::on_course(course.start(config.model), robot);
        let end = PegRegion::around(&line, config, robot).x[1];
        let continuation = if course == Course::Table75 { continued(end) } else { Vec::new() };
        let table = perturbation.fixed_pegs(course);
        Self { line, table, continuation, goal_distance: config.goal_distance }
    }

    /// The start nearest to the full deviation, in halvings, that clears the pegs; the nominal one does.
    pub fn start_among_pegs(&self, placement: &mut Placement, jitter: &StartJitter) -> EpisodeStart {
        let target = Target::Line { distance: self.goal_distance, centre_line: self.line.centre_line };
        EpisodeStart { start: placement.free_start(&self.line, jitter), target, speed: None }
    }
}

/// The courses were laid out for links of Aiko's shape; their number and inertia are free.
///
/// # Errors
/// Names the length that differs.
pub fn require_aiko(config: &EnvConfig) -> Result<(), ConfigError> {
    let aiko = RobotConfig::default();
    let shape = [
        ("robot.length", &config.robot.length, &aiko.length),
        ("robot.contact_half_length", &config.robot.contact_half_length, &aiko.contact_half_length),
        ("robot.radius", &config.robot.radius, &aiko.radius),
        ("robot.cg_offset", &config.robot.cg_offset, &aiko.cg_offset),
    ];
    for (field, value, of_aiko) in shape {
        let expected = format!("{} for a course of the thesis, whose pegs fit Aiko's links", describe(of_aiko));
        require(same_everywhere(value, of_aiko), field, describe(value), &expected)?;
    }
    Ok(())
}

fn same_everywhere(quantity: &PerLink, expected: &PerLink) -> bool {
    let expected = expected.values()[0];
    quantity.values().iter().all(|value| (value - expected).abs() <= 1e-9 * expected)
}

fn describe(quantity: &PerLink) -> String {
    match quantity {
        PerLink::Same(value) => value.to_string(),
        PerLink::Each(values) => format!("{values:?}"),
    }
}

/// More pegs like those of (T Table 7.5), from its last one up to `x_end`: two metres of travel bring the head
/// beyond the thesis's last peg, and without pegs the robot would stop there.
/// They keep the mean spacing and the mean y of the two rows of the table.
pub fn continued(x_end: f64) -> Vec<Peg> {
    let [radius, last_x, _] = TABLE_7_5[6];
    let spacing = (last_x - TABLE_7_5[0][1]) / 6.0;
    let places = (1..).map(|k| (k, last_x + f64::from(k) * spacing));
    places.take_while(|(_, x)| *x <= x_end).map(|(k, x)| Peg { radius, x, y: row_mean(k as usize) }).collect()
}

/// Mean y of the table's row to which the peg `k` places after its last one belongs.
fn row_mean(k: usize) -> f64 {
    let row: Vec<f64> = TABLE_7_5.iter().skip(k % 2).step_by(2).map(|peg| peg[2]).collect();
    row.iter().sum::<f64>() / row.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternates_on_from_the_table() {
        let pegs = continued(3.4);
        assert_eq!(pegs.len(), 3);
        assert!((pegs[0].x - 2.627).abs() < 1e-9 && (pegs[0].y - 0.0026667).abs() < 1e-6);
        assert!((pegs[1].y - 0.1785).abs() < 1e-9);
    }
}
