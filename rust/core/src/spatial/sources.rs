//! Sources of contact: what finds the rows of a stage, and how deep the end of a step takes links into each of them, see
//! [`crate::stepping::penetration`].

use crate::math::Real;
use crate::obstacles::ObstacleGrid;
use crate::stepping::Members;
use crate::stepping::lanes::{Lanes, active};
use crate::stepping::penetration::Sinking;

use super::obstacle_contacts::MARGIN;
use super::workspace::Workspace;
use super::{Spatial, SpatialBody};

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes at their predicted ends.
    pub(super) fn find_rows(&mut self, members: &mut Members<Spatial>, pending: Lanes) {
        self.contacts.clear();
        active(pending).for_each(|lane| self.supports[lane].clear());
        let links = &members.system.robot.links;
        for lane in active(pending) {
            self.wake(members.system, lane, members.body(lane), MARGIN, false);
        }
        for lane in active(pending) {
            let SpatialBody { obstacles, warm_start, .. } = members.body_mut(lane);
            let (obstacles, near): (&ObstacleGrid, _) = (obstacles, &mut warm_start.near);
            if !obstacles.is_empty() {
                self.list_near(lane, links, near, obstacles);
                self.find_obstacle_contacts(lane, links, near, obstacles);
                self.find_supports(lane, links, near, obstacles);
            }
            self.find_movable_contacts(lane, links, obstacles);
        }
        self.contacts.lay_out(&mut self.stage, &mut self.solution);
        self.find_self_contacts(pending);
        for lane in active(pending) {
            self.find_movable_pairs(lane, links, &members.body(lane).obstacles);
        }
        self.self_contacts.rows.lay_out(self.stage.coefficient, &mut self.stage.pairs, &mut self.solution.pair);
        let Self { known, awake, .. } = self;
        active(pending).for_each(|lane| known[lane].retain(|id| awake.sleeps(lane, links.len(), id)));
    }

    /// Examines the ends of the members' steps.
    pub(super) fn measure_sinking(&mut self, members: &mut Members<Spatial>, lanes: Lanes) {
        let links = &members.system.robot.links;
        for lane in active(lanes) {
            let mut sinking = Sinking::No;
            let SpatialBody { obstacles, warm_start, .. } = members.body_mut(lane);
            if !obstacles.is_empty() {
                self.list_near(lane, links, &mut warm_start.near, obstacles);
                sinking = self.sinking_into_obstacles(lane, links, &warm_start.near, obstacles);
            }
            if self.self_contacts.may_overlap(lane, self.result.deviation.lane(lane)) {
                let (start, end) = (&self.motion.start_frames, &self.motion.frames);
                sinking = sinking.max(self.self_contacts.sinking(links, start, end, lane));
            }
            sinking = sinking.max(self.sinking_of_movables(members.system, lane, members.body(lane)));
            self.result.sinking[lane] = sinking;
            if !self.supports[lane].is_empty() {
                self.measure_sinking_into_supports(lane);
            }
        }
    }
}
