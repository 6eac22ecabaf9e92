//! Discs that can be pushed, light and heavy ones, between the start and the goal line.

use std::sync::Arc;

use nalgebra::Vector2;

use crate::environment::config::{EnvConfig, ModelKind};
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::{ConfigError, require};
use crate::obstacles::{Obstacle, ObstacleGrid};
use crate::robot::Robot;
use crate::scene::Peg;

use super::open_ground::OpenGround;
use super::peg_region::PegRegion;
use super::{EpisodeStart, Family, ORTHOTROPIC, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "clutter",
    id: "SnakeClutter-v1",
    description: "Discs that can be pushed lie in the way to the goal line. The ground resists sliding across a link more \
                  than along it. With `difficulty` the number of discs grows from 6 to 18, and the largest mass from a \
                  hundredth of the robot's to all of it. Masses are spread evenly in the logarithm. Light discs give way, \
                  heavy ones have to be passed. The robot never starts inside a disc.",
    friction: |_| ORTHOTROPIC,
    validate: |config| {
        let expected = "\"planar\" for the task \"clutter\"";
        require(config.model == ModelKind::Planar, "model", config.model.name().name(), expected)
    },
    scenario: |config, robot| Ok(Arc::new(Clutter::new(config, robot)?)),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Clutter {
    ground: OpenGround,
    robot_mass: f64,
}

impl Clutter {
    fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        let ground = OpenGround::new(config, robot, |_| (TRIES * MOST) as f64)?;
        Ok(Self { ground, robot_mass: robot.total_mass() })
    }
}

impl Scenario for Clutter {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let start = self.ground.draw(placement, jitter, |region, pegs| {
            scatter(difficulty, region, rng, pegs);
            None
        });
        let discs: Vec<_> = placement.pegs.drain(..).map(|peg| self.disc(peg, difficulty, rng)).collect();
        placement.set_scene(Some(Arc::new(ObstacleGrid::of(&discs))));
        start
    }
}

impl Clutter {
    fn disc(&self, peg: Peg, difficulty: f64, rng: &mut Rng) -> Obstacle {
        let mass = LIGHTEST * (1.0 / LIGHTEST).powf(difficulty * rng.unit()) * self.robot_mass;
        Obstacle { mass: Some(mass), ground_friction: rng.uniform(SMOOTHEST, ROUGHEST), ..peg.into() }
    }
}

/// Replaces `pegs` by discs that do not overlap, ahead of the middle of the robot.
fn scatter(difficulty: f64, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) {
    pegs.clear();
    let count = FEWEST + (difficulty * (MOST - FEWEST) as f64).round() as usize;
    for _ in 0..TRIES * count {
        let radius = region.radius(LARGEST, 1.0, rng);
        let (x, side) = (rng.uniform(0.0, region.x[1]), rng.around_zero(ACROSS * region.half_width));
        let peg = Peg { radius, x, y: region.centre_line + side };
        let gap =
            |other: &Peg| (Vector2::new(x, peg.y) - Vector2::new(other.x, other.y)).norm() - other.radius - radius;
        if pegs.len() < count && pegs.iter().all(|other| gap(other) > region.clearance()) {
            pegs.push(peg);
        }
    }
}

/// Number of discs at difficulty zero and one, and places tried for each.
const FEWEST: usize = 6;
const MOST: usize = 18;
const TRIES: usize = 20;

/// Largest radius in Aiko's scale \[m\].
const LARGEST: f64 = 0.1;

/// How far to the sides of the centre line they lie, as a share of the region's half width.
const ACROSS: f64 = 0.6;

/// Smallest mass over that of the robot.
const LIGHTEST: f64 = 0.01;

/// Coefficients of friction on the ground.
const SMOOTHEST: f64 = 0.1;
const ROUGHEST: f64 = 0.4;
