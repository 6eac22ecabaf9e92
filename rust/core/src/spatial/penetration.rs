//! How deep the end of a step takes links into obstacles.
//!
//! A link of which some point moves farther than its radius in one step near a contact could pass to the other side of it,
//! so such a step is divided, too.

use crate::math::{Laned, Real};
use crate::obstacles::ObstacleGrid;
use crate::robot::Link;
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::near_pairs::NearPairs;
use super::workspace::Workspace;
use super::{LinkAxis, obstacle_gap};

impl<T: Real> Workspace<T> {
    /// What the step does to the penetrations of a lane's robot into obstacles.
    pub(super) fn sinking_into_obstacles(
        &self,
        lane: usize,
        links: &[Link],
        near: &NearPairs,
        obstacles: &ObstacleGrid,
    ) -> Sinking {
        let mut sinking = Sinking::No;
        for (i, near) in near.by_link() {
            let (frames, mut ends) = ([&self.motion.start_frames[i], &self.motion.frames[i]], None);
            let [start, end] = frames.map(|frame| frame.position.lane(lane));
            let distance = links[i].reach() + (end - start).norm();
            for obstacle in near.filter(|&obstacle| obstacles.is_within(obstacle, &end.xy(), distance)) {
                let ends = ends.get_or_insert_with(|| frames.map(|frame| frame.axis_of(lane)));
                sinking = sinking.max(sinking_into(obstacles, obstacle, &links[i], ends));
            }
        }
        sinking
    }
}

/// What a step does to the penetration into an obstacle of a link that is there at the start and at the end of it.
pub(super) fn sinking_into(
    obstacles: &ObstacleGrid,
    obstacle: usize,
    link: &Link,
    [start, end]: &[LinkAxis; 2],
) -> Sinking {
    let lowest = start.position.z.min(end.position.z) - link.reach();
    if obstacles.solid(obstacle).is_some_and(|solid| lowest > solid.height) {
        return Sinking::No;
    }
    let passed = if farthest_travel(link, start, end) > link.radius { Sinking::TooDeep } else { Sinking::No };
    let gap_at_end = obstacle_gap(link, end, obstacles, obstacle);
    if gap_at_end >= -ALLOWED {
        return passed;
    }
    passed.max(Sinking::of(obstacle_gap(link, start, obstacles, obstacle), gap_at_end))
}

/// How far the point of a link's centre line moves that moves farthest, one of its ends \[m\].
pub(super) fn farthest_travel(link: &Link, start: &LinkAxis, end: &LinkAxis) -> f64 {
    let (moved, turned) = (end.position - start.position, end.axis - start.axis);
    link.sides().map(|along| (moved + turned * along).norm()).into_iter().fold(0.0, f64::max)
}
