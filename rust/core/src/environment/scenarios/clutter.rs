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
                  than along it. With `difficulty` the number of discs grows from 6 to 40, and the largest mass from a \
                  hundredth of the robot's to tenfold. Their friction on the ground is at most 0.4 to 0.8. Light discs \
                  give way, heavy ones have to be passed, or jam. Between two of those that resist with three tenths \
                  of the robot's weight there is room for it. The robot never starts inside a disc.",
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
        let mut discs = Vec::new();
        let start = self.ground.draw(placement, jitter, |region, pegs| {
            discs = self.scatter(difficulty, region, rng);
            pegs.clear();
            pegs.extend(discs.iter().map(|disc| disc.peg));
            None
        });
        // Those that had to make room for the robot are smaller, or gone.
        let disc_at = |peg: Peg| discs.iter().find(|disc| [disc.peg.x, disc.peg.y] == [peg.x, peg.y]);
        let left = placement.pegs.drain(..).filter_map(|peg| Some(Disc { peg, ..*disc_at(peg)? }.into()));
        let discs: Vec<Obstacle> = left.collect();
        placement.set_scene(Some(Arc::new(ObstacleGrid::of(&discs))));
        start
    }
}

/// A disc before it is an obstacle.
#[derive(Debug, Clone, Copy)]
struct Disc {
    peg: Peg,
    mass: f64,
    ground_friction: f64,
}

impl From<Disc> for Obstacle {
    fn from(Disc { peg, mass, ground_friction }: Disc) -> Self {
        Obstacle { mass: Some(mass), ground_friction, ..peg.into() }
    }
}

impl Clutter {
    /// Discs that do not overlap, ahead of the middle of the robot.
    fn scatter(&self, difficulty: f64, region: &PegRegion, rng: &mut Rng) -> Vec<Disc> {
        let mut discs: Vec<Disc> = Vec::new();
        let count = FEWEST + (difficulty * (MOST - FEWEST) as f64).round() as usize;
        let passage = PASSAGE * region.body_radius;
        let is_heavy = |disc: &Disc| disc.mass * disc.ground_friction > HEAVY * self.robot_mass;
        for _ in 0..TRIES * count {
            let disc = self.disc(difficulty, region, rng);
            let has_room = |other: &Disc| {
                let [one, two] = [&disc, other].map(|disc| Vector2::new(disc.peg.x, disc.peg.y));
                let gap = (one - two).norm() - disc.peg.radius - other.peg.radius;
                gap > if is_heavy(&disc) && is_heavy(other) { passage } else { region.clearance() }
            };
            if discs.len() < count && discs.iter().all(has_room) {
                discs.push(disc);
            }
        }
        discs
    }

    fn disc(&self, difficulty: f64, region: &PegRegion, rng: &mut Rng) -> Disc {
        let radius = region.radius(LARGEST, 1.0, rng);
        let (x, side) = (rng.uniform(0.0, region.x[1]), rng.around_zero(ACROSS * region.half_width));
        let mass = LIGHTEST * (HEAVIEST / LIGHTEST).powf(difficulty * rng.unit().sqrt()) * self.robot_mass;
        let roughest = ROUGHEST[0] + difficulty * (ROUGHEST[1] - ROUGHEST[0]);
        let ground_friction = rng.uniform(SMOOTHEST, roughest);
        Disc { peg: Peg { radius, x, y: region.centre_line + side }, mass, ground_friction }
    }
}

/// Number of discs at difficulty zero and one, and places tried for each.
const FEWEST: usize = 6;
const MOST: usize = 40;
const TRIES: usize = 20;

/// Largest radius in Aiko's scale \[m\].
const LARGEST: f64 = 0.1;

/// How far to the sides of the centre line they lie, as a share of the region's half width.
const ACROSS: f64 = 0.6;

/// Smallest mass, and largest one at difficulty one, over that of the robot.
const LIGHTEST: f64 = 0.01;
const HEAVIEST: f64 = 10.0;

/// Coefficients of friction on the ground, the largest at difficulty zero and one.
const SMOOTHEST: f64 = 0.1;
const ROUGHEST: [f64; 2] = [0.4, 0.8];

/// Friction of a heavy disc, over the weight of the robot.
const HEAVY: f64 = 0.3;

/// Least way between two heavy discs, over the half width of the robot.
const PASSAGE: f64 = 2.4;
