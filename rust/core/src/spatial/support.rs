//! Top faces of obstacles as the ground below the end spheres of links, and robots that rest on what is under them.

use nalgebra::Vector3;

use crate::math::{Laned, Real};
use crate::obstacles::ObstacleGrid;
use crate::robot::{Link, Robot};

use super::near_pairs::NearPairs;
use super::workspace::{Workspace, opening};
use super::{End, LinkAxis, Pose, Twist, obstacle_gap, rest_on_ground, solid_line};

/// An end sphere above a top face, which carries it in place of the ground.
#[derive(Debug, Clone, Copy)]
pub struct Support {
    pub link: usize,
    /// Front (0) or rear (1).
    pub side: usize,
    pub obstacle: usize,
    /// \[m\]
    pub height: f64,
}

impl<T: Real> Workspace<T> {
    /// Sets the ground below the spheres of a lane's robot that are above a top face at their predicted ends.
    pub(super) fn find_supports(&mut self, lane: usize, links: &[Link], near: &NearPairs, obstacles: &ObstacleGrid) {
        let [c, elapsed] = [self.stage.coefficient, self.motion.elapsed].map(|time| time.lane(lane));
        for (i, mut near) in near.by_link() {
            let (link, from_above) = (&links[i], self.motion.frames[i].position.lane(lane).xy());
            let carries = |o: usize| obstacles.has_top(o) && obstacles.is_within(o, &from_above, link.reach());
            if !near.any(carries) {
                continue;
            }
            let [start, end] = [&self.motion.start_frames[i], &self.motion.frames[i]].map(|frame| frame.axis_of(lane));
            for side in 0..2 {
                let centre = sphere(link, &end, side);
                // At the height of the plane the plane itself carries a sphere.
                if let Some((obstacle, height)) = obstacles.support(&centre).filter(|&(_, height)| height != 0.0) {
                    let height = height.max(NOWHERE);
                    self.supports[lane].push(Support { link: i, side, obstacle, height });
                    let gap = |centre: &Vector3<f64>| centre.z - link.radius - height;
                    let (Twist { linear, angular }, arm) = (&self.motion.expected[i], centre - end.position);
                    let [turning_x, turning_y] = [angular.x, angular.y].map(|rate| rate.lane(lane));
                    let closing = linear.z.lane(lane) + turning_x * arm.y - turning_y * arm.x;
                    let still = gap(&centre) - c * closing;
                    let before = sphere(link, &start, side);
                    let stood = obstacles.support(&before).is_some_and(|(_, below)| below == height);
                    let at_start = if stood { gap(&before) } else { 0.0 };
                    self.stage.links[i].ground[side].set_lane(lane, opening(still, at_start, c, elapsed));
                }
            }
        }
    }
}

/// Centre of the front (0) or rear (1) sphere.
fn sphere(link: &Link, at: &LinkAxis, side: usize) -> Vector3<f64> {
    solid_line(link, at).point(if side == 0 { 1.0 } else { -1.0 })
}

/// Lifts or lowers the whole chain until its lowest end sphere touches the ground, and lifts it on until it rests on the
/// obstacles under it that have a top face or another shape than a vertical one. One that merely touches such an obstacle
/// from the side stays where it is. A robot above a field is lowered to the lowest ground under it first.
pub fn rest_on(robot: &Robot, obstacles: &ObstacleGrid, pose: &mut [Pose]) {
    rest_on_ground(robot, pose);
    let links = || robot.links.iter().zip(&*pose);
    let heights = links().flat_map(|(link, pose)| {
        [0, 1].map(|side| obstacles.ground_height(&sphere(link, &LinkAxis::of(pose), side).xy()))
    });
    let lowest = heights.fold(0.0, f64::min);
    let is_clear = |lift: f64, depth: f64| {
        links().all(|(link, pose)| {
            let at = LinkAxis { position: pose.position + Vector3::z() * lift, axis: pose.axis() };
            let is_above_ground = End::BOTH.iter().all(|&end| {
                let centre = at.position + at.axis * end.along(link);
                let ground = obstacles.support(&centre).map_or(0.0, |(_, height)| height);
                centre.z - link.radius - ground >= -depth
            });
            let mut is_clear = is_above_ground;
            obstacles.visit_obstacles(&pose.position.xy(), link.reach(), |obstacle| {
                let body = obstacles.body(obstacle);
                if body.is_some() || obstacles.solid(obstacle).is_some() {
                    // Uneven ground is below, never beside.
                    let depth = if body.is_some_and(|body| body.height_field().is_some()) { 0.0 } else { depth };
                    is_clear &= obstacle_gap(link, &at, obstacles, obstacle) >= -depth;
                }
            });
            is_clear
        })
    };
    if is_clear(lowest, SLIGHT) {
        pose.iter_mut().for_each(|pose| pose.position.z += lowest);
        return;
    }
    // Above the obstacle a robot is clear of it at any height.
    let (mut inside, mut lift) = (lowest, LOWEST_LIFT);
    while !is_clear(lowest + lift, 0.0) {
        inside = lowest + lift;
        lift *= 2.0;
    }
    let mut clear = lowest + lift;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + clear);
        if is_clear(middle, 0.0) { clear = middle } else { inside = middle }
    }
    pose.iter_mut().for_each(|pose| pose.position.z += clear);
}

/// Penetration that does not lift a robot \[m\].
const SLIGHT: f64 = 1e-4;

/// Lift that is tried first \[m\].
const LOWEST_LIFT: f64 = 1e-3;

/// Bisections of the lift: to round-off.
const HALVINGS: u32 = 52;

/// Height of a ground that no sphere reaches \[m\].
const NOWHERE: f64 = -1e3;
