//! Contacts of a register's robots with obstacles: detected before a stage is solved, stored after it.

use crate::contact::{NearPair, link_obstacle_gap};
use crate::math::{Laned, Real};
use crate::obstacles::ObstacleGrid;
use crate::stepping::lanes::{Lanes, active, mask};
use crate::stepping::{ContactImpulse, Driven, Members, SolvedRows};

use super::workspace::{Motion, Workspace};
use super::{Heading, Planar, PlanarSystem, Stage};

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes at their predicted ends.
    pub(super) fn detect_contacts<D: Driven<Model = Planar>>(&mut self, members: &mut Members<D>, pending: Lanes) {
        self.contacts.clear();
        let system = members.system;
        let has_obstacles = self.has_obstacles;
        for lane in active(pending).filter(|_| has_obstacles) {
            let body = members.body_mut(lane);
            if body.obstacles.is_unbounded() {
                continue;
            }
            let Self { contacts, motion, stage, .. } = self;
            let nodes = system.nodes(&body.obstacles);
            let robot = motion.of_lane(nodes, lane, Real::lane(&stage.coefficient, lane));
            let (near, displacement, margin) = (&mut body.warm_start.near, robot.bound.displacement, robot.margin(1.0));
            if !near.covers(displacement, margin) {
                let poses = motion.predicted.iter().map(|pose| pose.lane(lane));
                near.rebuild(poses, robot.nodes.iter(), &body.obstacles, margin, displacement);
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

    /// Keeps the contact forces as the next initial guess, and records which contacts close in the `solved` lanes.
    pub(super) fn keep_forces<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        let Self { contacts, closings, solution, stage, motion: Motion { guess: expected, elapsed, .. }, .. } = self;
        let (c, twist) = (stage.coefficient, &solution.twist);
        let rows = SolvedRows {
            coefficient: c,
            elapsed: *elapsed,
            expected,
            twist,
            impulse: &solution.contact,
            lanes: solved,
        };
        contacts.rows.read(&rows, closings, contact_impulses, |found, force| {
            members.body_mut(found.lane).warm_start.near.pairs_mut()[found.handle].known.force = force;
        });
        let solved_friction = (&solution.obstacle_friction[..], solved);
        contacts.friction.read(c, &contacts.rows, solved_friction, contact_impulses, |of, force| {
            let found = &contacts.rows.all()[of];
            members.body_mut(found.lane).warm_start.near.pairs_mut()[found.handle].known.friction = force;
        });
    }

    /// Gap of a pair at the end of the step \[m\].
    pub(super) fn end_gap(&self, lane: usize, pair: &NearPair, system: &PlanarSystem, obstacles: &ObstacleGrid) -> f64 {
        let (end, Heading { cos, sin }) =
            (self.result.end[pair.link].lane(lane), self.motion.heading[pair.link].lane(lane));
        let link = system.nodes(obstacles).get(pair.link);
        link_obstacle_gap(&end, cos, sin, link, obstacles, (pair.obstacle, pair.feature))
    }
}

/// Gap below which a pair becomes a contact of the stage \[m\]; faster robots have a larger margin.
pub(super) const MARGIN: f64 = 0.002;
