//! How deep the end of a step takes links into obstacles.
//!
//! A link of which some point moves farther than its radius in one step near a contact could pass to the other side of it,
//! so such a step is divided, too.

use crate::math::Real;
use crate::obstacles::ObstacleGrid;
use crate::robot::Link;
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::workspace::Workspace;
use super::{LinkAxis, obstacle_gap};

impl<T: Real> Workspace<T> {
    /// What the step does to the penetrations of a lane's robot into obstacles.
    pub(super) fn sinking_into_obstacles(&self, lane: usize, links: &[Link], obstacles: &ObstacleGrid) -> Sinking {
        let mut sinking = Sinking::No;
        if self.may_reach(lane, obstacles) {
            for (i, link) in links.iter().enumerate() {
                let ends = [&self.motion.start_frames[i], &self.motion.frames[i]];
                sinking = sinking.max(sinking_into(obstacles, link, &ends.map(|frame| frame.axis_of(lane))));
            }
        }
        sinking
    }
}

/// Of a link that is there at the start and at the end of the step.
pub(super) fn sinking_into(obstacles: &ObstacleGrid, link: &Link, [start, end]: &[LinkAxis; 2]) -> Sinking {
    let mut sinking = Sinking::No;
    let travelled = (end.position - start.position).norm();
    let lowest = start.position.z.min(end.position.z) - link.reach();
    obstacles.visit_obstacles(&end.position.xy(), link.reach() + travelled, |obstacle| {
        if obstacles.solid(obstacle).is_some_and(|solid| lowest > solid.height) {
            return;
        }
        if farthest_travel(link, start, end) > link.radius {
            sinking = sinking.max(Sinking::TooDeep);
        }
        let gap_at_end = obstacle_gap(link, end, obstacles, obstacle);
        if gap_at_end < -ALLOWED {
            sinking = sinking.max(Sinking::of(obstacle_gap(link, start, obstacles, obstacle), gap_at_end));
        }
    });
    sinking
}

/// How far the point of a link's centre line moves that moves farthest, one of its ends \[m\].
pub(super) fn farthest_travel(link: &Link, start: &LinkAxis, end: &LinkAxis) -> f64 {
    let (moved, turned) = (end.position - start.position, end.axis - start.axis);
    link.sides().map(|along| (moved + turned * along).norm()).into_iter().fold(0.0, f64::max)
}
