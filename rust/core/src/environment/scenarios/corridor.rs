//! A corridor whose walls are rows of pegs, straight at first, then bent along an arc.
//!
//! Pegs stand in pairs, one in each wall, where the body of the gait crosses the centre line: there both
//! push it forward (T 5.5). Between the pegs of a wall the body does not fit.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Vector2;

use crate::scene::Peg;

use super::open_ground::OpenGround;
use super::peg_region::{GoalPath, PegRegion};
use super::{EpisodeStart, Family, GoalKind, Placement, Scenario};

use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;

pub const FAMILY: Family = Family {
    name: "corridor",
    id: "SnakeCorridor-v1",
    description: "A corridor whose walls are rows of pegs, with the goal point at its end. It begins straight and bends \
                  along an arc by up to `difficulty` times 90 degrees. `difficulty` also widens the \
                  corridor beyond the width that fits the gait and moves pegs along the walls.",
    goal: GoalKind::Disc,
    scenario: |config, robot| Ok(Arc::new(Corridor(OpenGround::new(config, robot, places)?))),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Corridor(OpenGround);

impl Scenario for Corridor {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let path = self.0.path();
        self.0.draw(placement, jitter, |region, pegs| Some(corridor(difficulty, &path, region, rng, pegs)))
    }
}

/// Gap between the body of the gait and the pegs: at difficulty zero, and the widest at difficulty one \[m\].
/// Beyond 3.5 cm the gait no longer pushes; a wave of larger amplitude does.
const SLACK: [f64; 2] = [0.006, 0.07];

/// Share of the body's width that is open between neighbouring pegs of a wall.
const OPENING: f64 = 0.9;

/// Jitter of a peg along the corridor at difficulty one, as a share of the distance between pegs.
const JITTER: f64 = 0.2;

/// Number of pegs, at most.
fn places(region: &PegRegion) -> f64 {
    2.0 * ((region.x[1] - region.x[0]) / region.path.half_wave() + 1.0)
}

/// Builds the walls; returns the goal, on the centre line `path.length` from the start.
fn corridor(difficulty: f64, path: &GoalPath, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) -> Vector2<f64> {
    let turn = difficulty * rng.around_zero(path.turn);
    let centre_line = CentreLine::new(path, region, turn);
    let pitch = region.path.half_wave();
    let slack = region.scale() * rng.uniform(SLACK[0], SLACK[0] + difficulty * (SLACK[1] - SLACK[0]));
    let fit = Fit::new(region, slack);
    let curved = [-1.0, 1.0].map(|side| fit.wall(side * centre_line.curvature));
    let straight = fit.wall(0.0);
    let first_crossing = region.head[0] + region.path.displacement(0.0, region.path.crossing()).x - path.start.x;
    let first = ((region.x[0] - path.start.x - first_crossing) / pitch).ceil() as i32;
    let last = ((region.x[1] - path.start.x - first_crossing) / pitch).floor() as i32;
    pegs.clear();
    for station in first..=last {
        for (side, curved) in [-1.0, 1.0].into_iter().zip(curved) {
            let jitter = rng.around_zero(difficulty * JITTER);
            let along = first_crossing + (f64::from(station) + jitter) * pitch;
            let wall = if centre_line.is_curved(along) { curved } else { straight };
            let centre = centre_line.at(along) + side * wall.offset * centre_line.left(along);
            pegs.push(Peg { radius: wall.radius, x: centre.x, y: centre.y });
        }
    }
    centre_line.at(path.length)
}

/// A straight line along +x, an arc, and a straight line again, by the distance from the start.
struct CentreLine {
    start: Vector2<f64>,
    /// Where the arc begins and ends \[m\].
    arc: [f64; 2],
    /// Positive to the left \[1/m\].
    curvature: f64,
}

/// One wall where a peg stands: distance of its pegs from the centre line, and their radius \[m\].
#[derive(Debug, Clone, Copy)]
struct Wall {
    offset: f64,
    radius: f64,
}

impl CentreLine {
    /// Bent by `turn` \[rad\] between the head at the start and the goal.
    fn new(path: &GoalPath, region: &PegRegion, turn: f64) -> Self {
        let begin = (region.head[0] - path.start.x).min(0.5 * path.length);
        Self { start: path.start, arc: [begin, path.length], curvature: turn / (path.length - begin) }
    }

    /// Direction \[rad\].
    fn angle(&self, along: f64) -> f64 {
        self.curvature * (along.clamp(self.arc[0], self.arc[1]) - self.arc[0])
    }

    fn left(&self, along: f64) -> Vector2<f64> {
        let (sin, cos) = self.angle(along).sin_cos();
        Vector2::new(-sin, cos)
    }

    fn at(&self, along: f64) -> Vector2<f64> {
        let on_arc = (along.clamp(self.arc[0], self.arc[1]) - self.arc[0]).max(0.0);
        // The chord of an arc points half way between the directions of its ends.
        let half = 0.5 * self.curvature * on_arc;
        let chord = if half == 0.0 { on_arc } else { on_arc * half.sin() / half };
        let (sin, cos) = half.sin_cos();
        let (end_sin, end_cos) = self.angle(along).sin_cos();
        let beyond = (along - self.arc[1]).max(0.0);
        self.start
            + Vector2::new(along.min(self.arc[0]), 0.0)
            + chord * Vector2::new(cos, sin)
            + beyond * Vector2::new(end_cos, end_sin)
    }

    fn is_curved(&self, along: f64) -> bool {
        (self.arc[0]..self.arc[1]).contains(&along)
    }
}

/// Fits walls to the body of the gait.
struct Fit {
    /// The natural path up to a wave away from a crossing of the centre line, which is the origin \[m\].
    path: Vec<Vector2<f64>>,
    pitch: f64,
    opening: f64,
    /// Distance of the path to the rim of a peg \[m\].
    clearance: f64,
}

impl Fit {
    fn new(region: &PegRegion, slack: f64) -> Self {
        let crossing = region.path.crossing();
        let phases = (-STEPS..=STEPS).map(|step| crossing + PI * f64::from(step) / f64::from(STEPS));
        Self {
            path: phases.map(|phase| region.path.displacement(crossing, phase)).collect(),
            pitch: region.path.half_wave(),
            opening: OPENING * 2.0 * region.body_radius,
            clearance: region.body_radius + slack,
        }
    }

    /// Distance of the path to a peg's centre beside the crossing \[m\].
    fn distance(&self, offset: f64) -> f64 {
        let centre = Vector2::new(0.0, offset);
        self.path.iter().map(|point| (point - centre).norm()).fold(f64::INFINITY, f64::min)
    }

    /// The wall on the side to which the centre line bends with `curvature` \[1/m\] (negative: away from it).
    /// The body clears its pegs by the slack, and the rest of the distance between two pegs, which is
    /// `pitch (1 - curvature offset)`, is the opening.
    fn wall(&self, curvature: f64) -> Wall {
        let radius = |offset: f64| 0.5 * (self.pitch * (1.0 - curvature * offset) - self.opening);
        let (mut low, mut high) = (0.0, 2.0 * self.pitch);
        for _ in 0..BISECTIONS {
            let offset = 0.5 * (low + high);
            let fits = self.distance(offset) > radius(offset) + self.clearance;
            (low, high) = if fits { (low, offset) } else { (offset, high) };
        }
        Wall { offset: high, radius: radius(high) }
    }
}

/// Points of the path to either side of the crossing.
const STEPS: i32 = 64;

/// They find an offset to a nanometre.
const BISECTIONS: u32 = 30;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::peg_region::tests::{aiko_path, aiko_region};

    #[test]
    fn no_body_leaves_a_regular_corridor_between_two_pegs_of_a_wall() {
        let (region, route) = (aiko_region(), aiko_path());
        for turn in [-1.5, 0.0, 1.0] {
            let line = CentreLine::new(&route, &region, turn);
            let fit = Fit::new(&region, 0.01);
            for side in [-1.0, 1.0] {
                for along in [0.0, 1.0, 1.5] {
                    let wall = fit.wall(if line.is_curved(along) { side * line.curvature } else { 0.0 });
                    let pegs = [along, along + 0.3673].map(|s| line.at(s) + side * wall.offset * line.left(s));
                    let opening = (pegs[1] - pegs[0]).norm() - 2.0 * wall.radius;
                    // A chord is shorter than its arc, by 2 % at most here.
                    assert!(opening < 0.105 && opening > 0.08, "{opening} at {along}, turn {turn}");
                }
            }
        }
    }

    #[test]
    fn the_centre_line_has_the_length_and_direction_of_its_parts() {
        let (region, route) = (aiko_region(), aiko_path());
        let line = CentreLine::new(&route, &region, 1.2);
        let mut length = 0.0;
        let points: Vec<Vector2<f64>> = (0..=3000).map(|k| line.at(0.001 * f64::from(k))).collect();
        for pair in points.windows(2) {
            length += (pair[1] - pair[0]).norm();
        }
        assert!((length - 3.0).abs() < 1e-6);
        assert!((line.angle(2.0) - 1.2).abs() < 1e-15 && line.angle(3.0) == line.angle(2.0));
        let last = points[3000] - points[2999];
        assert!((last.y.atan2(last.x) - 1.2).abs() < 1e-9);
    }
}
