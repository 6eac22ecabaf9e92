//! Contacts of a register's robots with pegs: detected before a stage is solved, stored after it.

use crate::contact::{NearPair, link_obstacle_gap};
use crate::math::Real;
use crate::pegs::PegGrid;
use crate::stepping::lanes::{Lanes, active, mask, read_vector};
use crate::stepping::{ClosingRow, ContactImpulse, Driven, Members, Source};

use super::contacts::Prediction;
use super::workspace::Workspace;
use super::{Planar, PlanarSystem};

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes at their predicted ends, `elapsed` after the start of the step.
    pub(super) fn detect_contacts<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        pending: Lanes,
        elapsed: T,
    ) {
        self.contacts.clear();
        let system = members.system;
        for lane in active(pending).filter(|_| self.has_pegs) {
            let body = members.body_mut(lane);
            if body.pegs.is_empty() {
                continue;
            }
            let mut contacts = std::mem::take(&mut self.contacts);
            let prediction = self.prediction(system, &body.pegs, lane, elapsed.lane(lane));
            let (near, &Prediction { displacement, margin, .. }) = (&mut body.warm_start.near, &prediction);
            if !near.covers(displacement, margin) {
                let poses = prediction.end.iter().map(|pose| read_vector(pose, lane));
                near.rebuild(poses, &system.robot.links, &body.pegs, margin, displacement);
            }
            let is_among_pegs = !near.pairs().is_empty();
            if is_among_pegs {
                contacts.find(near, &prediction);
            }
            self.contacts = contacts;
            self.near_pegs[lane] = is_among_pegs;
        }
        self.among_pegs = self.among_pegs | mask::<T>(self.near_pegs);
        self.contacts.lay_out(&mut self.stage.contacts, &mut self.contact_force);
        self.contacts.lay_out_friction(&mut self.stage.contact_friction, &mut self.contact_friction_force);
        self.detect_self_contacts(members, pending, elapsed);
    }

    /// The robot of a lane in the current stage.
    fn prediction<'a>(
        &'a self,
        system: &'a PlanarSystem,
        pegs: &'a PegGrid,
        lane: usize,
        elapsed: f64,
    ) -> Prediction<'a, T> {
        let Self { stage, base, predicted: end, heading, travel, motion_bound, start_pose: start, .. } = self;
        let (coefficient, motion_bound) = (stage.coefficient.lane(lane), motion_bound.lane(lane));
        let displacement = motion_bound.displacement;
        let margin = motion_bound.contact_margin(coefficient, 1.0, system.smallest_radius());
        let robot = &system.robot;
        Prediction { robot, pegs, lane, base, start, end, heading, travel, coefficient, elapsed, displacement, margin }
    }

    /// Keeps the contact forces as the next initial guess, and records which contacts close in the `solved` lanes.
    pub(super) fn keep_forces<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        for found in self.contacts.all() {
            let pair = &mut members.body_mut(found.lane).warm_start.near.pairs_mut()[found.pair];
            pair.force = self.contact_force[found.slot].lane(found.lane);
            if !solved[found.lane] {
                continue;
            }
            let row = ClosingRow {
                offset: found.offset(),
                expected_rate: found.direction.dot(&read_vector(&self.guess[found.link], found.lane)),
                rate: found.direction.dot(&read_vector(&self.solution.twist[found.link], found.lane)),
                presses: pair.force > 0.0,
                touched: pair.touches,
            };
            self.closings.add(found.lane, &row, self.stage.coefficient.lane(found.lane), self.elapsed.lane(found.lane));
            let impulse = self.solution.contact[found.slot].lane(found.lane);
            contact_impulses.push(ContactImpulse {
                lane: found.lane,
                link: found.link,
                impulse: found.direction.xy().push(0.0) * impulse,
                source: Source::Obstacle(pair.peg),
            });
        }
    }

    /// Keeps friction at obstacles likewise.
    pub(super) fn keep_contact_friction<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        for frictional in self.contacts.frictional() {
            let pair = &mut members.body_mut(frictional.lane).warm_start.near.pairs_mut()[frictional.pair];
            pair.friction = self.contact_friction_force[frictional.row].lane(frictional.lane);
            if !solved[frictional.lane] {
                continue;
            }
            let impulse = self.solution.contact_friction[frictional.row].lane(frictional.lane);
            contact_impulses.push(ContactImpulse {
                lane: frictional.lane,
                link: frictional.link,
                impulse: frictional.direction.xy().push(0.0) * impulse,
                source: Source::Obstacle(pair.peg),
            });
        }
    }

    /// Gap of a pair at the end of the step \[m\].
    pub(super) fn end_gap(&self, lane: usize, pair: &NearPair, system: &PlanarSystem, pegs: &PegGrid) -> f64 {
        let (end, heading) = (read_vector(&self.end[pair.link], lane), &self.heading[pair.link]);
        let (cos, sin) = (heading.cos.lane(lane), heading.sin.lane(lane));
        let link = &system.robot.links[pair.link];
        link_obstacle_gap(&end, cos, sin, link, pegs, (pair.peg, pair.place))
    }
}

/// Gap below which a pair becomes a contact of the stage \[m\]; faster robots have a larger margin.
pub(super) const MARGIN: f64 = 0.002;
