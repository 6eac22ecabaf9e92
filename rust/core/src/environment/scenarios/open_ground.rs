//! Ground on which the robot starts anywhere and pegs make room for it.

use nalgebra::Vector2;

use crate::environment::config::EnvConfig;
use crate::environment::default_gait::DefaultGait;
use crate::environment::goal::{Goal, Target};
use crate::environment::start::{StartJitter, StartLine};
use crate::error::{ConfigError, require};
use crate::robot::Robot;
use crate::scene::Peg;

use super::peg_region::{GoalPath, PegRegion};
use super::{EpisodeStart, Placement, PushPointCounter};

/// Start, goal and peg region of the families whose pegs are drawn around the robot.
#[derive(Debug)]
pub struct OpenGround {
    line: StartLine,
    region: PegRegion,
    goal_distance: f64,
    goal_radius: f64,
    turn: f64,
    /// Push-points that every body length of the way must have; 0: pegs stay as they were drawn first.
    push_points: usize,
    counter: PushPointCounter,
}

impl OpenGround {
    /// Of a family that tries pegs at so many `places`.
    ///
    /// # Errors
    /// There are too many of them, or of the places where push-points are counted.
    pub fn new(config: &EnvConfig, robot: &Robot, places: impl Fn(&PegRegion) -> f64) -> Result<Self, ConfigError> {
        let DefaultGait { yaw, travel, .. } = config.default_gait();
        let line = StartLine::at_origin(yaw, robot).turned(-travel);
        let region = PegRegion::around(&line, config, robot);
        let counter = PushPointCounter::of(robot);
        let (length, windows) = (robot.total_length(), counter.windows(config.goal_distance));
        let needed = places(&region).max(if config.push_points > 0 { windows } else { 0.0 });
        let value = format!(
            "{:?} with robot.radius = {} m, {} links of {length} m together, goal_distance = {} m, \
             corridor_half_width = {} m",
            config.task,
            region.body_radius,
            robot.link_count(),
            config.goal_distance,
            config.corridor_half_width,
        );
        let expected = format!("lengths that need at most {MOST_PLACES:.0e} places for pegs; these need {needed:.1e}");
        require(needed <= MOST_PLACES, "task", value, &expected)?;
        Ok(Self {
            region,
            line,
            goal_distance: config.goal_distance,
            goal_radius: config.goal_radius,
            turn: config.turn,
            push_points: config.push_points,
            counter,
        })
    }

    /// The way to a goal point.
    pub fn path(&self) -> GoalPath {
        GoalPath { start: self.line.gravity_centre, length: self.goal_distance, turn: self.turn }
    }

    /// Puts the robot at its start, then draws pegs until there are enough push-points. `lay_out` replaces the pegs and
    /// returns the goal point, if there is one.
    pub fn draw(
        &self,
        placement: &mut Placement,
        jitter: &StartJitter,
        mut lay_out: impl FnMut(&PegRegion, &mut Vec<Peg>) -> Option<Vector2<f64>>,
    ) -> EpisodeStart {
        let start = self.line.deviated(placement.robot(), jitter);
        placement.assemble(&self.line, &start);
        let (radius, origin) = (self.goal_radius, placement.gravity_centre());
        let mut target = Target::Line { distance: self.goal_distance, centre_line: self.line.centre_line };
        for _ in 0..MAX_DRAWS {
            if let Some(centre) = lay_out(&self.region, &mut placement.pegs) {
                target = Target::Disc { centre, radius };
            }
            placement.clear_pegs(self.region.clearance(), self.region.smallest_radius());
            let goal = || Goal::new(target.clone(), origin, None);
            if self.push_points == 0 || self.counter.push_points(&goal(), &placement.pegs) >= self.push_points {
                break;
            }
        }
        EpisodeStart { start, target, speed: None }
    }
}

/// Most places at which a family may try to put a peg: a second's work.
const MOST_PLACES: f64 = 1e6;

/// Scenes drawn at most until one has as many push-points as required; the last one is kept.
const MAX_DRAWS: u32 = 100;
