//! Top faces of obstacles as the ground below the end spheres of links, and robots that rest on what is under them.

use nalgebra::Vector3;

use crate::math::{Laned, Real};
use crate::obstacles::{ObstacleGrid, SolidLine};
use crate::robot::{Link, Robot};

use super::workspace::{Workspace, opening};
use super::{LinkAxis, Pose, rest_on_ground, solid_line};

/// An end sphere above a top face, which carries it in place of the ground.
#[derive(Debug, Clone, Copy)]
pub struct Support {
    pub lane: usize,
    pub link: usize,
    /// Front (0) or rear (1).
    pub side: usize,
    pub obstacle: usize,
}

impl<T: Real> Workspace<T> {
    /// Sets the ground below the spheres of a lane's robot that are above a top face at their predicted ends.
    pub(super) fn find_supports(&mut self, lane: usize, links: &[Link], obstacles: &ObstacleGrid) {
        let [c, elapsed] = [self.stage.coefficient, self.motion.elapsed].map(|time| time.lane(lane));
        for (i, link) in links.iter().enumerate() {
            let mut is_near_top = false;
            let from_above = self.motion.frames[i].position.lane(lane).xy();
            obstacles.visit_solids(&from_above, link.reach(), |_, _| is_near_top = true);
            if !is_near_top {
                continue;
            }
            let frames = [&self.motion.start_frames[i], &self.motion.frames[i]];
            let [start, end] = frames.map(|frame| frame.lane(lane));
            let [axis_before, axis_after] = frames.map(|frame| frame.axis_of(lane));
            let (of_stage, expected) = (self.stage.links[i].lane(lane), self.motion.expected[i].lane(lane));
            for side in 0..2 {
                if let Some((obstacle, height)) = obstacles.support(&sphere(link, &axis_after, side)) {
                    self.supports.push(Support { lane, link: i, side, obstacle });
                    let closing = expected.velocity_at(&of_stage.ground_arm(side)).z;
                    let still = end.ground_gap(&of_stage, side) - height - c * closing;
                    let below = obstacles.support(&sphere(link, &axis_before, side));
                    let stood = below.is_some_and(|(_, before)| before == height);
                    let at_start = if stood { start.ground_gap(&of_stage, side) - height } else { 0.0 };
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
/// obstacles under it that have a top face. One that merely touches such an obstacle from the side stays where it is.
pub fn rest_on(robot: &Robot, obstacles: &ObstacleGrid, pose: &mut [Pose]) {
    rest_on_ground(robot, pose);
    let is_clear = |lift: f64, depth: f64| {
        let mut is_clear = true;
        for (link, pose) in robot.links.iter().zip(&*pose) {
            let line =
                SolidLine { middle: pose.position + Vector3::z() * lift, half: pose.axis() * link.contact_half_length };
            obstacles.visit_solids(&pose.position.xy(), link.reach(), |_, solid| {
                is_clear &= solid.distance(&line) - link.radius >= -depth;
            });
        }
        is_clear
    };
    if is_clear(0.0, SLIGHT) {
        return;
    }
    // Above the obstacle a robot is clear of it at any height.
    let (mut inside, mut clear) = (0.0, LOWEST_LIFT);
    while !is_clear(clear, 0.0) {
        (inside, clear) = (clear, 2.0 * clear);
    }
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
