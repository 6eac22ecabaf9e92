//! Whether a scene can be passed: a geometric rule after (T 5.5): obstacle-aided locomotion needs three push-points.
//!
//! The rule counts, in every stretch of the way from start to goal that is as long as the robot, the pegs that
//! can serve as push-points, and takes the smallest of these numbers. A peg can serve if
//! 1. the robot reaches it: its rim is no farther from the way than the body of the largest wave that an action
//!    can command extends;
//! 2. the robot passes it: on one side at least no other peg stands nearer than a body's width;
//! 3. it is a push-point of its own: at least a quarter of a wave after the one before.
//!
//! It distinguishes the thesis's cases (T 7.3.4): three on the courses of (T Tables 7.3 and 7.5), also with peg 3
//! moved, two with peg 3 removed. It is a rule, neither sufficient nor necessary: it ignores forces.

use nalgebra::Vector2;

use crate::environment::action::{Reach, wave_entries};
use crate::environment::goal::{Goal, Target};
use crate::environment::path::NaturalPath;
use crate::gait::Wave;
use crate::obstacles::ObstacleGrid;
use crate::robot::Robot;
use crate::scene::Peg;

use super::peg_region::largest_radius;

/// Data of a robot that the rule needs \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PushPointCounter {
    /// Length of the stretched robot.
    length: f64,
    /// Half width of the robot.
    body: f64,
    /// How far the robot's rim gets from its way.
    across: f64,
    quarter_wave: f64,
}

/// The straight path from an origin to a goal.
struct StraightPath {
    start: Vector2<f64>,
    ahead: Vector2<f64>,
    length: f64,
}

impl PushPointCounter {
    pub fn of(robot: &Robot) -> Self {
        Self::new(robot.total_length(), robot.link_count(), largest_radius(robot))
    }

    /// For a robot of `links` equal links, `length` long when it is stretched.
    fn new(length: f64, links: usize, body: f64) -> Self {
        let link = length / links as f64;
        let wave = Wave::default();
        let largest = Wave { amplitude: wave_entries(Reach::UNLIMITED)[0].high(), ..wave };
        let across = NaturalPath::new(&largest, link).height() + body;
        Self { length, body, across, quarter_wave: 0.5 * NaturalPath::new(&wave, link).half_wave() }
    }

    /// The smallest number of push-points in any body length on the straight way from `goal.origin` to the goal.
    pub fn push_points(&self, goal: &Goal, pegs: &[Peg]) -> usize {
        let path = StraightPath::to(goal);
        let grid = ObstacleGrid::new(pegs);
        let mut places: Vec<f64> =
            pegs.iter().filter(|peg| self.serves(&path, peg, &grid)).map(|p| path.along(p)).collect();
        places.sort_unstable_by(f64::total_cmp);
        let steps = self.windows(path.length) as u32;
        let middles = (0..=steps).map(|step| path.length * f64::from(step) / f64::from(steps));
        middles.map(|middle| self.count(&places, middle)).min().unwrap_or(0)
    }

    /// Number of steps from one stretch of a way of some length to the next.
    pub fn windows(&self, length: f64) -> f64 {
        (length / (self.length * WINDOW_STEP)).ceil()
    }

    /// Push-points among `places`, in order, of a robot whose middle is at `middle`.
    fn count(&self, places: &[f64], middle: f64) -> usize {
        let mut last = f64::NEG_INFINITY;
        let first = places.partition_point(|place| place - middle < -0.5 * self.length);
        let near = places[first..].iter().take_while(|place| (*place - middle).abs() <= 0.5 * self.length);
        near.filter(|place| {
            let counts = **place >= last + self.quarter_wave;
            last = if counts { **place } else { last };
            counts
        })
        .count()
    }

    fn serves(&self, path: &StraightPath, peg: &Peg, pegs: &ObstacleGrid) -> bool {
        let is_reached = path.across(peg).abs() - peg.radius <= self.across;
        // All others leave room.
        let close = || pegs.near(peg.x, peg.y, (peg.radius + 2.0 * self.body) * (1.0 + 1e-9)).map(|j| &pegs.pegs()[j]);
        is_reached && [-1.0, 1.0].iter().any(|side| close().all(|other| self.leaves_room(path, peg, other, *side)))
    }

    /// Whether the robot fits between two pegs, or need not, because `other` is not beside `peg` on that side.
    fn leaves_room(&self, path: &StraightPath, peg: &Peg, other: &Peg, side: f64) -> bool {
        let distance = (other.x - peg.x).hypot(other.y - peg.y);
        let is_beside = side * (path.across(other) - path.across(peg)) > BESIDE * distance;
        !is_beside || distance - peg.radius - other.radius >= 2.0 * self.body
    }
}

impl StraightPath {
    fn to(goal: &Goal) -> Self {
        let (ahead, length) = match goal.target {
            Target::Line { distance, .. } => (Vector2::new(1.0, 0.0), distance),
            Target::Direction { angle } => (Vector2::new(angle.cos(), angle.sin()), 0.0),
            Target::Disc { .. } | Target::Path { .. } => {
                let way = goal.point() - goal.origin;
                (way.normalize(), way.norm())
            }
        };
        let start = match goal.target {
            Target::Line { centre_line, .. } => Vector2::new(goal.origin.x, centre_line),
            _ => goal.origin,
        };
        Self { start, ahead, length }
    }

    fn along(&self, peg: &Peg) -> f64 {
        self.ahead.dot(&(Vector2::new(peg.x, peg.y) - self.start))
    }

    fn across(&self, peg: &Peg) -> f64 {
        self.ahead.perp(&(Vector2::new(peg.x, peg.y) - self.start))
    }
}

/// Step from one stretch of the way to the next, in robot lengths.
const WINDOW_STEP: f64 = 0.02;

/// Sine of the angle to the way from which on one peg is beside another.
const BESIDE: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::scenarios::continued;
    use crate::scene::{TABLE_7_3, TABLE_7_5};

    fn aiko() -> PushPointCounter {
        PushPointCounter::new(11.0 * 0.122, 11, 0.0525)
    }

    fn push_points(pegs: &[Peg], x: f64, centre_line: f64) -> usize {
        let target = Target::Line { distance: 2.0, centre_line };
        aiko().push_points(&Goal::new(target, Vector2::new(x, centre_line), None), pegs)
    }

    #[test]
    fn the_thesiss_courses_have_three_and_table_7_3_without_peg_3_has_two() {
        let small = TABLE_7_3.map(Peg::from);
        assert_eq!(push_points(&small, 0.56, 0.113), 3);
        let mut moved = small;
        moved[2].y += 0.105;
        assert_eq!(push_points(&moved, 0.56, 0.113), 3);
        let without: Vec<Peg> = small.iter().copied().enumerate().filter(|(k, _)| *k != 2).map(|(_, p)| p).collect();
        assert_eq!(push_points(&without, 0.56, 0.113), 2);
        let large: Vec<Peg> = TABLE_7_5.map(Peg::from).into_iter().chain(continued(3.5)).collect();
        assert_eq!(push_points(&large, 0.52, 0.085), 3);
    }

    #[test]
    fn pegs_out_of_reach_blocked_or_one_behind_the_other_do_not_count() {
        let row = |y: f64| -> Vec<Peg> { (-3..9).map(|k| Peg { radius: 0.03, x: 0.4 * f64::from(k), y }).collect() };
        assert_eq!(push_points(&row(0.0), 0.0, 0.0), 3);
        assert_eq!(push_points(&row(0.5), 0.0, 0.0), 0, "out of reach");
        let blocked: Vec<Peg> = [row(0.0), row(0.15), row(-0.15)].concat();
        // Nobody passes the pegs in the middle; those beside them can be passed on their outer sides.
        assert!(!aiko().serves(&StraightPath::to(&goal()), &blocked[0], &ObstacleGrid::new(&blocked)));
        let dense: Vec<Peg> = (-30..90).map(|k| Peg { radius: 0.01, x: 0.04 * f64::from(k), y: 0.0 }).collect();
        assert!(push_points(&dense, 0.0, 0.0) <= 7, "a push-point a quarter wave at most");
    }

    fn goal() -> Goal {
        Goal::new(Target::Line { distance: 2.0, centre_line: 0.0 }, Vector2::zeros(), None)
    }
}
