//! A lattice maze after Liu, Onal and Fu (2021), scaled to Aiko: 5 x 6 posts between start and goal.
//!
//! Kept from there: the number of posts, their radius of 2 cm, jitter of the gaps, a goal 2 m away at an angle of 0 to
//! 90 degrees to the robot. Scaled: Aiko is thicker and longer, so posts stand half a wave of its gait apart, which
//! leaves passages of three body widths and three columns per body length.

use std::sync::Arc;

use nalgebra::Vector2;

use crate::scene::Peg;

use super::open_ground::OpenGround;
use super::peg_region::{GoalPath, PegRegion};
use super::{EpisodeStart, Family, GoalKind, ORTHOTROPIC, Placement, Scenario};

use crate::environment::rng::Rng;
use crate::environment::start::StartJitter;

pub const FAMILY: Family = Family {
    name: "maze",
    id: "SnakeMaze-v1",
    description: "A lattice of 5 x 6 posts after Liu, Onal and Fu (2021) on the way to a goal point. The goal lies up to \
                  `difficulty` times 90 degrees off the robot's direction, 2 m away. As there the posts have a radius \
                  of 2 cm, and the gaps jitter. The robot can move without posts, on the ground of `SnakeFree-v1`. \
                  Scaled to Aiko the posts stand half a wave of its gait apart, 0.367 m. A body length meets three \
                  columns, and passages are three body widths wide.",
    goal: GoalKind::Disc,
    friction: |_| ORTHOTROPIC,
    scenario: |config, robot| Ok(Arc::new(Maze(OpenGround::new(config, robot, |_| f64::from(COLUMNS * ROWS))?))),
    ..Family::DEFAULT
};

#[derive(Debug)]
struct Maze(OpenGround);

impl Scenario for Maze {
    fn draw(&self, placement: &mut Placement, difficulty: f64, jitter: &StartJitter, rng: &mut Rng) -> EpisodeStart {
        let path = self.0.path();
        self.0.draw(placement, jitter, |region, pegs| Some(maze(difficulty, &path, region, rng, pegs)))
    }
}

const COLUMNS: u32 = 6;
const ROWS: u32 = 5;

/// Jitter of a post along and across at difficulty one, as a share of the distance between posts.
const JITTER: f64 = 0.2;

/// Stands the posts around the middle of the way from the start to the goal; returns the goal.
fn maze(difficulty: f64, path: &GoalPath, region: &PegRegion, rng: &mut Rng, pegs: &mut Vec<Peg>) -> Vector2<f64> {
    let (sin, cos) = (difficulty * rng.around_zero(path.turn)).sin_cos();
    let (ahead, left) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
    let pitch = region.path.half_wave();
    let middle = path.start + 0.5 * path.length * ahead;
    let from_middle = |index: u32, count: u32| f64::from(index) - 0.5 * f64::from(count - 1);
    pegs.clear();
    for column in 0..COLUMNS {
        for row in 0..ROWS {
            let [along, across] = [from_middle(column, COLUMNS), from_middle(row, ROWS)]
                .map(|place| pitch * (place + rng.around_zero(difficulty * JITTER)));
            let post = middle + along * ahead + across * left;
            pegs.push(Peg { radius: region.smallest_radius(), x: post.x, y: post.y });
        }
    }
    path.start + path.length * ahead
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::peg_region::tests::{aiko_path, aiko_region};

    #[test]
    fn thirty_posts_lie_around_the_way_and_leave_passages_wider_than_the_body() {
        let (region, route, mut pegs) = (aiko_region(), aiko_path(), Vec::new());
        for seed in 0..50 {
            let goal = maze(1.0, &route, &region, &mut Rng::new(seed, 0), &mut pegs);
            assert_eq!(pegs.len(), 30);
            assert!((goal - route.start).norm() - 2.0 < 1e-12 && goal.x > -1e-12, "ahead or beside: {goal}");
            for (i, a) in pegs.iter().enumerate() {
                for b in &pegs[..i] {
                    assert!((a.x - b.x).hypot(a.y - b.y) - 0.04 > 0.105, "seed {seed}");
                }
            }
        }
    }

    #[test]
    fn at_difficulty_zero_the_goal_lies_straight_ahead() {
        let (route, mut pegs) = (aiko_path(), Vec::new());
        let goal = maze(0.0, &route, &aiko_region(), &mut Rng::new(4, 0), &mut pegs);
        assert!((goal - route.start - Vector2::new(2.0, 0.0)).norm() < 1e-12);
    }
}
