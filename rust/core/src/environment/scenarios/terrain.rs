//! Uneven ground of one of several kinds between the start and the goal line.
//!
//! Lengths are for Aiko and grow with the radius of the robot. The ground under the start and before the heights begin is
//! level; they grow to their full size over a body width more. Beside the field the ground is a plane.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::environment::config::{EnvConfig, ModelKind, TerrainKind};
use crate::environment::default_gait::DefaultGait;
use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;
use crate::error::{ConfigError, require};
use crate::obstacles::{GroundFriction, Heights, Obstacle, ObstacleGrid, Shape};
use crate::robot::Robot;

use super::open_ground::OpenGround;
use super::peg_region::PegRegion;
use super::{EpisodeStart, Family, Placement, Scenario};

pub const FAMILY: Family = Family {
    name: "terrain",
    id: "SnakeTerrain-v1",
    description: "Uneven ground between the start and the goal line, in proportion to `difficulty`. `terrain` is its \
                  kind. \"rough\" is a sum of 24 waves of 0.5 to 2 m, with 5 cm root mean square at difficulty one. \
                  \"blocks\" are squares of 0.4 m, up to 12 cm high. \"stairs\" go up and down in steps of 0.5 m and \
                  up to 8 cm. \"ramps\" are slopes of up to 15 degrees. \"mixed\" draws one for each episode. The robot \
                  starts on level ground, and action zero is the sidewinding of (7.5). The ground is a height field; links \
                  have the coefficients of friction along and across them on its slopes.",
    model: ModelKind::Spatial,
    has_pegs: false,
    on_request: &["ground"],
    friction: |_| GROUND,
    gait: |_| DefaultGait::sidewinding(),
    validate: |config| {
        let is_symmetric = config.friction_backward.is_none_or(|backward| backward == config.ground().friction[0]);
        let expected = "None for the task \"terrain\", whose ground is uneven";
        require(is_symmetric, "friction_backward", config.friction_backward.unwrap_or_default(), expected)
    },
    scenario: |config, robot| Ok(Arc::new(Terrain::new(config, robot)?)),
    ..Family::DEFAULT
};

/// Friction on which ramps can be climbed.
const GROUND: [f64; 2] = [0.5, 0.5];

#[derive(Debug)]
struct Terrain {
    ground: OpenGround,
    kind: TerrainKind,
}

impl Terrain {
    fn new(config: &EnvConfig, robot: &Robot) -> Result<Self, ConfigError> {
        let cells = |region: &PegRegion| {
            let [columns, rows] = size(region);
            (columns * rows) as f64
        };
        Ok(Self { ground: OpenGround::new(config, robot, cells)?, kind: config.terrain })
    }
}

impl Scenario for Terrain {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let mut heights = None;
        let start = self.ground.draw(placement, jitter, |region, pegs| {
            pegs.clear();
            let kind = match self.kind {
                TerrainKind::Mixed => KINDS[rng.index(KINDS.len())],
                kind => kind,
            };
            heights = Some(draw_heights(kind, difficulty, region, rng));
            None
        });
        let shape = heights.map(|heights| Shape::HeightField(Arc::new(heights)));
        let field: Vec<_> = shape.into_iter().map(Obstacle::endless).collect();
        placement.set_scene(Some(Arc::new(ObstacleGrid::of(&field))));
        start
    }
}

/// Points of the grid along x and y.
fn size(region: &PegRegion) -> [usize; 2] {
    let spacing = SPACING * region.scale();
    [region.x[1] - region.x[0] + 2.0 * BEYOND * region.scale(), 2.0 * region.half_width]
        .map(|length| (length / spacing).ceil() as usize + 1)
}

fn draw_heights(kind: TerrainKind, difficulty: f64, region: &PegRegion, rng: &mut Rng) -> Heights {
    let scale = region.scale();
    let [columns, rows] = size(region);
    let begins = region.head[0].max(0.0) + LEVEL * scale;
    let origin = [region.x[0], region.centre_line - region.half_width];
    let of_kind = profile(kind, region.x[1] - begins, rng);
    let height = |i: usize, j: usize| {
        let [x, y] = [(i, 0), (j, 1)].map(|(index, axis)| origin[axis] + index as f64 * SPACING * scale);
        let ahead = (x - begins) / scale;
        if ahead <= 0.0 { 0.0 } else { scale * difficulty * (ahead / RISE).min(1.0) * of_kind(ahead, y / scale) }
    };
    Heights {
        height: (0..columns).map(|i| (0..rows).map(|j| height(i, j)).collect()).collect(),
        spacing: SPACING * scale,
        origin,
        friction: GroundFriction::OfGround,
    }
}

/// Height at difficulty one so far `ahead` of where the heights begin and beside the centre line, in Aiko's scale \[m\].
fn profile(kind: TerrainKind, length: f64, rng: &mut Rng) -> Box<dyn Fn(f64, f64) -> f64> {
    match kind {
        TerrainKind::Rough | TerrainKind::Mixed => {
            let waves: Vec<_> = (0..WAVES).map(|_| Wave::draw(rng)).collect();
            let power: f64 = waves.iter().map(|wave| 0.5 * wave.length * wave.length).sum();
            Box::new(move |x, y| ROUGHNESS / power.sqrt() * waves.iter().map(|wave| wave.height(x, y)).sum::<f64>())
        }
        TerrainKind::Blocks => {
            let places = (length / BLOCK).ceil() as usize + 2;
            let blocks: Vec<Vec<f64>> =
                (0..places).map(|_| (0..BLOCKS_ACROSS).map(|_| rng.uniform(0.0, HIGHEST_BLOCK)).collect()).collect();
            Box::new(move |x, y| {
                let across = (y / BLOCK).floor() + (BLOCKS_ACROSS / 2) as f64;
                blocks[(x / BLOCK) as usize % places][across.clamp(0.0, (BLOCKS_ACROSS - 1) as f64) as usize]
            })
        }
        TerrainKind::Stairs => {
            let steps = 1 + rng.index(3);
            Box::new(move |x, _| {
                let step = (x / TREAD) as usize % (2 * steps);
                STEP * (step + 1).min(2 * steps - step - 1) as f64
            })
        }
        TerrainKind::Ramps => {
            let run = rng.uniform(0.6, 1.2);
            Box::new(move |x, _| {
                let within = x % (3.0 * run);
                STEEPEST * within.min(run).min(3.0 * run - within).max(0.0)
            })
        }
    }
}

/// A wave of the ground.
struct Wave {
    /// Its wave vector \[1/m\] and phase.
    along: [f64; 2],
    phase: f64,
    length: f64,
}

impl Wave {
    fn draw(rng: &mut Rng) -> Self {
        let length = SHORTEST * (LONGEST / SHORTEST).powf(rng.unit());
        let (sin, cos) = (TAU * rng.unit()).sin_cos();
        Self { along: [cos, sin].map(|part| TAU / length * part), phase: TAU * rng.unit(), length }
    }

    /// In proportion to its length.
    fn height(&self, x: f64, y: f64) -> f64 {
        self.length * (self.along[0] * x + self.along[1] * y + self.phase).cos()
    }
}

/// What "mixed" draws from.
const KINDS: [TerrainKind; 4] = [TerrainKind::Rough, TerrainKind::Blocks, TerrainKind::Stairs, TerrainKind::Ramps];

/// Of the grid \[m\].
const SPACING: f64 = 0.1;

/// Level ground ahead of the head at the start, and way over which heights grow to their size \[m\].
const LEVEL: f64 = 0.1;
const RISE: f64 = 0.3;

/// Ground behind the goal that the region of pegs does not have \[m\].
const BEYOND: f64 = 0.5;

/// Waves of rough ground, their lengths, and its root mean square height at difficulty one \[m\].
const WAVES: usize = 24;
const SHORTEST: f64 = 0.5;
const LONGEST: f64 = 2.0;
const ROUGHNESS: f64 = 0.05;

/// Side of a block and its height at most \[m\].
const BLOCK: f64 = 0.4;
const HIGHEST_BLOCK: f64 = 0.12;
const BLOCKS_ACROSS: usize = 16;

/// Depth and height of a step \[m\].
const TREAD: f64 = 0.5;
const STEP: f64 = 0.08;

/// Slope of a ramp at difficulty one: tan 15 degrees.
const STEEPEST: f64 = 0.268;
