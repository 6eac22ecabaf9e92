//! Contacts of a register's robots with obstacles: detected before a stage is solved, stored after it.

use crate::contact::{NearPair, link_obstacle_gap};
use crate::math::{Mask, Real};
use crate::obstacles::{Moved, Nodes, ObstacleGrid};
use crate::stepping::lanes::{Lanes, active, mask};
use crate::stepping::{ContactImpulse, Members};

use super::link_pairs::place_numbered;
use super::workspace::Workspace;
use super::{Planar, Stage};

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes at their predicted ends.
    pub(super) fn detect_contacts(&mut self, members: &mut Members<Planar>, pending: Lanes) {
        self.contacts.clear();
        let system = members.system;
        let may_touch: Lanes =
            std::array::from_fn(|lane| pending[lane] && self.has_obstacles && !self.is_clear.lane(lane));
        let may_wake = self.room > 0;
        for lane in active(pending).filter(|_| may_wake) {
            let margin = self.motion.margin(Real::lane(&self.stage.coefficient, lane), lane, 2.0);
            self.wake(system, lane, members.body(lane), margin, false);
        }
        for lane in active(may_touch) {
            let body = members.body_mut(lane);
            if body.obstacles.is_unbounded() {
                continue;
            }
            let Self { contacts, motion, stage, awake, .. } = self;
            let nodes = system.nodes(&body.obstacles).among(awake.of(lane));
            let lying = &body.state.movables;
            let robot = motion.of_lane((nodes, lying), lane, Real::lane(&stage.coefficient, lane));
            let (near, displacement, margin) = (&mut body.warm_start.near, robot.bound.displacement, robot.margin(1.0));
            if !near.covers(displacement, margin) {
                let pose = |node| place_numbered((nodes, lying), node, lane, &motion.predicted, &motion.heading).pose;
                let (all, numbers) = (nodes.all(), 0..nodes.all().count());
                let links = numbers.clone().map(|node| all.get(node));
                let obstacles = &body.obstacles;
                near.rebuild(numbers.map(pose), links, obstacles, margin, displacement, &mut contacts.previous);
                self.clear_way.set_lane(lane, near.clear_way());
            }
            let is_among_obstacles = !near.pairs().is_empty();
            if is_among_obstacles {
                contacts.find(near, &robot, &body.obstacles);
            }
            self.near_obstacles[lane] = is_among_obstacles;
        }
        self.among_obstacles = self.among_obstacles | mask::<T>(self.near_obstacles);
        let Self { contacts, stage: Stage { coefficient: c, contacts: rows, obstacle_friction, .. }, solution, .. } =
            self;
        contacts.rows.lay_out(*c, rows, &mut solution.contact);
        contacts.friction.lay_out(*c, &contacts.rows, rows, obstacle_friction, &mut solution.obstacle_friction);
        self.detect_self_contacts(members, pending);
    }

    /// Keeps the contact forces as the next initial guess.
    pub(super) fn keep_forces(
        &mut self,
        members: &mut Members<Planar>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        let Self { contacts, solution, stage, .. } = self;
        let c = stage.coefficient;
        contacts.rows.read(c, (&solution.contact, solved), contact_impulses, |found, force| {
            members.body_mut(found.lane).warm_start.near.pairs_mut()[found.handle].known.force = force;
        });
        let solved_friction = (&solution.obstacle_friction[..], solved);
        contacts.friction.read(c, &contacts.rows, solved_friction, contact_impulses, |of, force| {
            let found = &contacts.rows.all()[of];
            members.body_mut(found.lane).warm_start.near.pairs_mut()[found.handle].known.friction = force;
        });
    }

    /// Gap of a pair at the end of the step \[m\].
    pub(super) fn end_gap(
        &self,
        lane: usize,
        pair: &NearPair,
        (nodes, lying): (Nodes, &[Moved]),
        obstacles: &ObstacleGrid,
    ) -> f64 {
        let at_end = place_numbered((nodes, lying), pair.link, lane, &self.result.end, &self.motion.heading);
        link_obstacle_gap(&at_end, obstacles, (pair.obstacle, pair.feature))
    }
}

/// Gap below which a pair becomes a contact of the stage \[m\]; faster robots have a larger margin.
pub(super) const MARGIN: f64 = 0.002;
