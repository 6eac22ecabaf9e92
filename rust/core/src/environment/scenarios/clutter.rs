//! Discs and boxes that can be pushed, light and heavy ones, between the start and the goal line.

use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::Arc;

use nalgebra::Vector2;

use crate::environment::config::EnvConfig;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::ConfigError;
use crate::obstacles::{Obstacle, ObstacleGrid, Shape};
use crate::robot::Robot;
use crate::scene::Peg;

use super::open_ground::OpenGround;
use super::peg_region::PegRegion;
use super::{EpisodeStart, Family, ORTHOTROPIC, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "clutter",
    id: "SnakeClutter-v1",
    description: "Discs and boxes that can be pushed lie in the way to the goal line. The ground resists sliding across a \
                  link more than along it. With `difficulty` their number grows from 6 to 40, and the largest mass from \
                  a hundredth of the robot's to tenfold. Their friction on the ground is at most 0.4 to 0.8. Light ones \
                  give way, heavy ones have to be passed, or jam. Between two of those that resist with three tenths \
                  of the robot's weight there is room for it. The robot never starts inside any.",
    friction: |_| ORTHOTROPIC,
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

    /// Discs and boxes that do not overlap, ahead of the middle of the robot.
    fn scatter(&self, difficulty: f64, region: &PegRegion, rng: &mut Rng) -> Vec<Loose> {
        let mut loose: Vec<Loose> = Vec::new();
        let count = FEWEST + (difficulty * (MOST - FEWEST) as f64).round() as usize;
        let passage = PASSAGE * region.body_radius;
        let is_heavy = |one: &Loose| one.mass * one.ground_friction > HEAVY * self.robot_mass;
        for _ in 0..TRIES * count {
            let one = self.loose(difficulty, region, rng);
            let has_room = |other: &Loose| {
                let [here, there] = [&one, other].map(|one| Vector2::new(one.bound.x, one.bound.y));
                let gap = (here - there).norm() - one.bound.radius - other.bound.radius;
                gap > if is_heavy(&one) && is_heavy(other) { passage } else { region.clearance() }
            };
            if loose.len() < count && loose.iter().all(has_room) {
                loose.push(one);
            }
        }
        loose
    }

    fn loose(&self, difficulty: f64, region: &PegRegion, rng: &mut Rng) -> Loose {
        let radius = region.radius(LARGEST, 1.0, rng);
        let (x, side) = (rng.uniform(0.0, region.x[1]), rng.around_zero(ACROSS * region.half_width));
        let mass = LIGHTEST * (HEAVIEST / LIGHTEST).powf(difficulty * rng.unit().sqrt()) * self.robot_mass;
        let roughest = ROUGHEST[0] + difficulty * (ROUGHEST[1] - ROUGHEST[0]);
        let ground_friction = rng.uniform(SMOOTHEST, roughest);
        let edges = [rng.uniform(0.0, PI), rng.uniform(SLIMMEST, FRAC_PI_4)];
        let edges = (rng.unit() < BOXES).then_some(edges);
        Loose { bound: Peg { radius, x, y: region.centre_line + side }, mass, ground_friction, edges }
    }
}

impl Scenario for Clutter {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let mut loose = Vec::new();
        let start = self.ground.draw(placement, jitter, |region, pegs| {
            loose = self.scatter(difficulty, region, rng);
            pegs.clear();
            pegs.extend(loose.iter().map(|one| one.bound));
            None
        });
        // Those that had to make room for the robot are smaller, or gone.
        let at = |bound: Peg| loose.iter().find(|one| [one.bound.x, one.bound.y] == [bound.x, bound.y]);
        let left = placement.pegs.drain(..).filter_map(|bound| Some(Loose { bound, ..*at(bound)? }.into()));
        let obstacles: Vec<Obstacle> = left.collect();
        placement.set_scene(Some(Arc::new(ObstacleGrid::of(&obstacles))));
        start
    }
}

/// What can be pushed, before it is an obstacle.
#[derive(Debug, Clone, Copy)]
struct Loose {
    /// The disc, or the circle around the box.
    bound: Peg,
    mass: f64,
    ground_friction: f64,
    /// Of a box: its angle, and the angle between its first side and its diagonal \[rad\].
    edges: Option<[f64; 2]>,
}

impl From<Loose> for Obstacle {
    fn from(Loose { bound, mass, ground_friction, edges }: Loose) -> Self {
        let shape = edges.map_or(Shape::Circle(bound), |[angle, diagonal]| {
            let size = [diagonal.cos(), diagonal.sin()].map(|share| 2.0 * bound.radius * share);
            Shape::Box { size, x: bound.x, y: bound.y, angle }
        });
        Obstacle { mass: Some(mass), ground_friction, ..Obstacle::endless(shape) }
    }
}

/// Number of discs and boxes at difficulty zero and one, and places tried for each.
const FEWEST: usize = 6;
const MOST: usize = 40;
const TRIES: usize = 20;

/// Largest radius of a disc, or of the circle around a box, in Aiko's scale \[m\].
const LARGEST: f64 = 0.1;

/// How far to the sides of the centre line they lie, as a share of the region's half width.
const ACROSS: f64 = 0.6;

/// Smallest mass, and largest one at difficulty one, over that of the robot.
const LIGHTEST: f64 = 0.01;
const HEAVIEST: f64 = 10.0;

/// Coefficients of friction on the ground, the largest at difficulty zero and one.
const SMOOTHEST: f64 = 0.1;
const ROUGHEST: [f64; 2] = [0.4, 0.8];

/// Share of the boxes, and the smallest angle between their first side and their diagonal: sides as 1 to 2.4 \[rad\].
const BOXES: f64 = 0.5;
const SLIMMEST: f64 = PI / 8.0;

/// Friction of a heavy one, over the weight of the robot.
const HEAVY: f64 = 0.3;

/// Least way between two heavy ones, over the half width of the robot.
const PASSAGE: f64 = 2.4;
