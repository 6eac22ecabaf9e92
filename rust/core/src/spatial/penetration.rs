//! How deep the end of a step takes links into obstacles and into each other; see [`crate::stepping::penetration`].
//!
//! A link that moves farther than its radius in one step near a contact could pass to the other side of it, so such a
//! step is divided, too.

use crate::math::Real;
use crate::pegs::PegGrid;
use crate::robot::Link;
use crate::stepping::lanes::active;
use crate::stepping::penetration::{ALLOWED, Sinking};
use crate::stepping::{Driven, Members};

use super::workspace::Workspace;
use super::{Frame, Laned, Spatial, obstacle_gap};

impl<T: Real> Workspace<T> {
    /// Examines the ends of the members' steps.
    pub(super) fn measure_sinking<D: Driven<Model = Spatial>>(&mut self, members: &Members<D>) {
        let links = &members.system.robot.links;
        for lane in active(members.lanes()) {
            let obstacles = &members.body(lane).pegs;
            let mut sinking = Sinking::No;
            if !obstacles.is_empty() {
                for (i, link) in links.iter().enumerate() {
                    let [start, end] = [&self.start_frames[i], &self.frames[i]].map(|frame| frame.lane(lane));
                    sinking = sinking.max(sinking_into(obstacles, link, &start, &end));
                }
            }
            if self.self_contacts.is_near(lane) {
                sinking = sinking.max(self.self_contacts.sinking(links, &self.start_frames, &self.frames, lane));
            }
            self.sinking[lane] = sinking;
        }
    }
}

fn sinking_into(obstacles: &PegGrid, link: &Link, start: &Frame, end: &Frame) -> Sinking {
    let mut sinking = Sinking::No;
    let travelled = (end.position - start.position).norm();
    let (near, may_cross) = (end.position.xy(), travelled > link.radius);
    let lowest = start.position.z.min(end.position.z) - link.reach();
    obstacles.visit_obstacles(&near, link.reach() + if may_cross { travelled } else { 0.0 }, |obstacle| {
        if obstacles.solid(obstacle).is_some_and(|solid| lowest > solid.height) {
            return;
        }
        let gap_at_end = obstacle_gap(link, end, obstacles, obstacle);
        if may_cross {
            sinking = sinking.max(Sinking::TooDeep);
        }
        if gap_at_end < -ALLOWED {
            sinking = sinking.max(Sinking::of(obstacle_gap(link, start, obstacles, obstacle), gap_at_end));
        }
    });
    sinking
}
