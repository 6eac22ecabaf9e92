//! How deep the end of a step takes links into obstacles and into each other.
//!
//! Gaps enter a stage by their linearisation, so that links which turn fast end it inside what they touch. Their true
//! gaps decide whether a step is taken: one that leaves more than [`ALLOWED`] is divided. A link that moves farther
//! than a radius in one step near a contact could pass to the other side of it, so such a step is divided too.

use crate::contact::{NearPair, PlacedLink, link_obstacle_contact};
use crate::math::{Laned, Real};
use crate::obstacles::{Moved, Nodes, ObstacleGrid};
use crate::stepping::Members;
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::workspace::Workspace;
use super::{Body, Heading, Planar, PlanarSystem};

impl<T: Real> Workspace<T> {
    /// Examines the ends of the steps in the given lanes.
    pub(super) fn measure_sinking(&mut self, members: &mut Members<Planar>, lanes: Lanes) {
        let system = members.system;
        for lane in active(lanes) {
            self.result.sinking[lane] = self.sinking_of(lane, system, members.body_mut(lane));
        }
    }

    fn sinking_of(&mut self, lane: usize, system: &PlanarSystem, body: &mut Body) -> Sinking {
        if self.room > 0 {
            self.wake(system, lane, body, 0.0, true);
        }
        let mut sinking = if self.may_have_crossed(lane, body) { Sinking::TooDeep } else { Sinking::No };
        if self.near_obstacles[lane] {
            let Body { state, warm_start, obstacles, .. } = &mut *body;
            let (near, lying) = (&mut warm_start.near, &state.movables);
            let nodes = (self.nodes(system, lane, obstacles), &lying[..]);
            let (error, displacement) =
                (self.result.misprediction.lane(lane), self.motion.bound.displacement.lane(lane));
            near.measure_ends(displacement, error, |pair| self.end_gap(lane, pair, nodes, obstacles));
            for (pair, end) in near.ends().filter(|(_, end)| *end < -ALLOWED) {
                sinking = sinking.max(Sinking::of(self.start_gap(lane, pair, nodes, obstacles), end));
            }
        }
        let nodes = self.nodes(system, lane, &body.obstacles);
        self.visit_self_overlaps(nodes, lane, ALLOWED, |start, end| {
            sinking = sinking.max(Sinking::of(start, end));
        });
        sinking
    }

    /// Gap of a pair at the start of the step \[m\].
    fn start_gap(
        &self,
        lane: usize,
        pair: &NearPair,
        (nodes, lying): (Nodes, &[Moved]),
        obstacles: &ObstacleGrid,
    ) -> f64 {
        let lies = || lying[pair.link - nodes.links.len()].pose;
        let pose = nodes.place_of(pair.link).map_or_else(lies, |node| self.motion.start_pose[node].lane(lane));
        let start = PlacedLink { link: nodes.all().get(pair.link), pose, axis: Heading::of(pose.z).axial() };
        link_obstacle_contact(&start, obstacles, (pair.obstacle, pair.feature)).gap
    }

    /// Whether a link moved so far that it could be on the other side of what it was near.
    fn may_have_crossed(&self, lane: usize, body: &Body) -> bool {
        let displacement = self.motion.bound.displacement.lane(lane);
        if displacement <= self.motion.smallest_radius.lane(lane) {
            return false;
        }
        let near_peg = self.near_obstacles[lane]
            && body.warm_start.near.visited_below(displacement, displacement).next().is_some();
        near_peg || self.self_contacts.is_near(lane)
    }
}
