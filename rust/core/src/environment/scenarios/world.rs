//! Episodes whose scene, start or goal is prescribed instead of drawn.

use std::sync::Arc;

use nalgebra::Vector2;

use crate::environment::config::EnvConfig;
use crate::environment::default_gait::DefaultGait;
use crate::environment::goal::{Goal, Target};
use crate::environment::polyline::Polyline;
use crate::environment::raised_chain::Raised;
use crate::environment::rng::Rng;
use crate::environment::start::{Start, StartJitter, StartLine};
use crate::error::{ConfigError, require};
use crate::obstacles::{ObstacleGrid, Shape};
use crate::robot::Robot;
use crate::simulation::require_apart;

use super::placement::CLEARANCE;
use super::{EpisodeStart, Placement, Scenario};

/// What is prescribed for an episode; the family of scenes draws what is absent.
#[derive(Debug, Clone, Default)]
pub struct World {
    pub obstacles: Option<Arc<ObstacleGrid>>,
    pub start: Option<OwnStart>,
    pub goal: Option<OwnGoal>,
    /// Commanded speed \[m/s\].
    pub speed: Option<f64>,
}

/// A goal of the user's.
#[derive(Debug, Clone, PartialEq)]
pub enum OwnGoal {
    /// The line `distance` \[m\] ahead of the start; `None`: the corridor's centre line leads through the CG there.
    Line { distance: f64, centre_line: Option<f64> },
    /// The disc of `radius` \[m\] around a point.
    Disc { centre: Vector2<f64>, radius: f64 },
    /// A path to follow up to its last `radius` \[m\].
    Path { path: Polyline, radius: f64 },
    /// A direction, at this angle from +x \[rad\].
    Direction { angle: f64 },
}

/// A start of the user's.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnStart {
    /// CG of link 1 \[m\].
    pub position: Vector2<f64>,
    /// Absolute angle of link 1 \[rad\].
    pub angle: f64,
    /// Joint angles \[rad\]; none: the posture of the gait.
    pub joint_angle: Option<Vec<f64>>,
    /// How a robot of the spatial model does not lie flat; none: it does.
    pub raised: Option<Raised>,
}

impl OwnStart {
    fn height(&self) -> Option<f64> {
        self.raised.as_ref().and_then(|raised| raised.height)
    }
}

/// Lays out episodes in worlds.
#[derive(Debug, Clone)]
pub struct WorldLayout {
    /// The start on open ground.
    line: StartLine,
    goal_distance: f64,
    /// Smallest radius of a peg that is left where a drawn one makes room for the robot \[m\].
    smallest_radius: f64,
}

impl WorldLayout {
    pub fn new(config: &EnvConfig, robot: &Robot) -> Self {
        let DefaultGait { yaw, travel, .. } = config.default_gait();
        Self {
            line: StartLine::at_origin(yaw, robot).turned(-travel),
            goal_distance: config.goal_distance,
            smallest_radius: SMALLEST_SHARE * robot.links[0].radius,
        }
    }

    /// # Errors
    /// The robot would start in the ground, inside an obstacle of the world, or in its goal.
    pub fn check(&self, world: &World, placement: &mut Placement) -> Result<(), ConfigError> {
        if let Some(height) = world.start.as_ref().and_then(OwnStart::height) {
            self.place(world, placement);
            let lowest = height - placement.gap_to_ground();
            let expected = format!("at least {lowest:.4} m, where the robot touches the ground");
            require(height >= lowest, "start.position[2]", height, &expected)?;
        }
        if let Some(obstacles) = &world.obstacles {
            require_apart(obstacles)?;
            self.place(world, placement);
            // A robot rests on obstacles that have a top face.
            let near = placement.within_reach(obstacles, 0.0).into_iter().map(|j| (j, obstacles.obstacle(j)));
            for (j, obstacle) in near.filter(|(_, obstacle)| obstacle.height.is_none()) {
                let gap = placement.gap_to_obstacle(&obstacle);
                let shape = match &obstacle.shape {
                    Shape::Circle(peg) => format!("{:?}", [peg.radius, peg.x, peg.y]),
                    wall => format!("{wall:?}"),
                };
                let value = format!("{shape}, {gap:.4} m from the robot");
                require(gap > 0.0, &format!("scene.obstacles[{j}]"), value, "a place that leaves the start free")?;
            }
        }
        match (&world.start, &world.goal) {
            (Some(_), Some(OwnGoal::Disc { centre, radius })) => {
                self.place(world, placement);
                let distance = (centre - placement.gravity_centre()).norm();
                let value = format!("{distance:.3} m from the start");
                require(distance > *radius, "goal", value, "a point beyond its radius")
            }
            (_, Some(OwnGoal::Path { path, radius })) => {
                self.place(world, placement);
                let span = Goal::new(path_target(path, *radius), placement.gravity_centre(), None).span();
                let value = format!("{span:.3} m of the path before its last {radius} m");
                require(span > 0.0, "goal", value, "a path that leads on from the start by more than its radius")
            }
            _ => Ok(()),
        }
    }

    /// Draws what the world leaves open, with the random numbers of the episode.
    pub fn draw(
        &self,
        world: &World,
        family: &dyn Scenario,
        (placement, difficulty): (&mut Placement, f64),
        jitter: &StartJitter,
        rng: &mut Rng,
    ) -> EpisodeStart {
        placement.set_scene(world.obstacles.clone());
        let drawn = match &world.obstacles {
            None => family.draw(placement, difficulty, jitter, rng),
            Some(_) => {
                let target = Target::Line { distance: self.goal_distance, centre_line: self.line.centre_line };
                EpisodeStart { start: self.line.nominal, target, speed: None }
            }
        };
        let start = match (&world.start, &world.obstacles) {
            (Some(_), _) => self.place(world, placement),
            (None, Some(_)) => placement.free_start(&self.line, jitter),
            (None, None) => drawn.start,
        };
        if world.obstacles.is_none() && world.start.is_some() {
            placement.clear_pegs(CLEARANCE, self.smallest_radius);
        }
        let target = target(world, drawn.target, placement.gravity_centre().y);
        EpisodeStart { start, target, speed: world.speed.or(drawn.speed) }
    }

    /// Puts the robot at the world's start, or the nominal one.
    fn place(&self, world: &World, placement: &mut Placement) -> Start {
        let Some(OwnStart { position, angle, joint_angle, raised }) = &world.start else {
            placement.assemble(&self.line, &self.line.nominal);
            return self.line.nominal;
        };
        let start = Start { has_own_posture: joint_angle.is_some(), ..Start::of_gait(*position, *angle) };
        match joint_angle {
            Some(joint_angle) => placement.assemble_posture(&start, joint_angle),
            None => placement.assemble(&self.line, &start),
        }
        if let Some(raised) = raised {
            placement.raise(&start, raised);
        }
        start
    }
}

/// The goal of the world, or the one drawn; a line of either leads through `y`, the CG's at the start, if it has moved.
fn target(world: &World, drawn: Target, y: f64) -> Target {
    let through = |centre_line: f64| if world.start.is_some() { y } else { centre_line };
    match (&world.goal, drawn) {
        (Some(OwnGoal::Disc { centre, radius }), _) => Target::Disc { centre: *centre, radius: *radius },
        (Some(OwnGoal::Path { path, radius }), _) => path_target(path, *radius),
        (Some(OwnGoal::Direction { angle }), _) => Target::Direction { angle: *angle },
        (Some(OwnGoal::Line { distance, centre_line }), Target::Line { centre_line: of_family, .. }) => {
            Target::Line { distance: *distance, centre_line: centre_line.unwrap_or_else(|| through(of_family)) }
        }
        (Some(OwnGoal::Line { distance, centre_line }), _) => {
            Target::Line { distance: *distance, centre_line: centre_line.unwrap_or(y) }
        }
        (None, Target::Line { distance, centre_line }) => Target::Line { distance, centre_line: through(centre_line) },
        (None, other) => other,
    }
}

fn path_target(path: &Polyline, radius: f64) -> Target {
    Target::Path { path: path.clone(), radius }
}

const SMALLEST_SHARE: f64 = 0.2;
