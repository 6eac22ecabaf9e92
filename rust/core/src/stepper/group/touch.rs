//! Where the robots of a group touch pegs: found before a stage is solved, kept after it.

use nalgebra::Vector2;

use crate::contact::{NearPair, link_peg_contact};
use crate::math::Real;
use crate::pegs::PegGrid;
use crate::stepper::contacts::{Prediction, add_contacts};
use crate::stepper::lanes::{Lanes, NO_LANES, active, read_vector};
use crate::stepper::stage_kernels::StageKernels;
use crate::stepper::stage_work::StageWork;
use crate::stepper::{Body, Driven, Plant};

use super::Group;

/// Impulse of a peg: lane, link, and impulse in the world frame \[N s\].
pub(super) type Impulse = (usize, usize, Vector2<f64>);

impl<T: StageKernels> Group<T> {
    /// Lanes whose stage ended so far from its prediction that gaps linearised there may be wrong, or
    /// contacts missed.
    pub(super) fn surprised<D: Driven>(&self, fleet: &[D], members: &[usize], lanes: Lanes) -> Lanes {
        let mut surprised = NO_LANES;
        for (lane, member) in active(members, lanes) {
            let has_pegs = !fleet[member].body().pegs.pegs().is_empty();
            surprised[lane] = has_pegs && self.work.deviation.lane(lane) > MARGIN;
        }
        surprised
    }

    pub(super) fn find_contacts<D: Driven>(
        &mut self,
        plant: &Plant,
        fleet: &mut [D],
        members: &[usize],
        lanes: Lanes,
        elapsed: f64,
    ) {
        let c = self.work.stage.coefficient;
        let outlook = T::predict(&mut self.work, &self.start_pose);
        self.work.stage.contacts.clear();
        self.slots.clear();
        self.work.contact_force.clear();
        if !self.work.in_field {
            return;
        }
        for (lane, member) in active(members, lanes) {
            let Body { pegs, warm_start, .. } = fleet[member].body_mut();
            if pegs.pegs().is_empty() {
                continue;
            }
            let lead = outlook.lead.lane(lane);
            let mut margin = MARGIN.max(2.0 * c * outlook.fastest.lane(lane));
            if lead > plant.smallest_radius() {
                // Fast enough to pass a peg within the step.
                margin = margin.max(lead);
            }
            let StageWork { stage, base, predicted, heading, guess, .. } = &mut self.work;
            if !warm_start.near.covers(lead, margin) {
                let poses = predicted.iter().map(|pose| read_vector(pose, lane));
                warm_start.near.rebuild(poses, &plant.robot.links, pegs, margin, lead);
            }
            let robot = &plant.robot;
            let (start, end, twist) = (&self.start_pose, predicted, guess);
            let prediction = Prediction { robot, pegs, lane, base, start, end, heading, twist, elapsed, lead, margin };
            add_contacts(stage, &mut self.slots, &mut warm_start.near, &prediction);
        }
        self.load_contact_forces(fleet, members, lanes);
    }

    fn load_contact_forces<D: Driven>(&mut self, fleet: &mut [D], members: &[usize], lanes: Lanes) {
        self.work.contact_force.resize(self.slots.len(), T::zero());
        for (lane, member) in active(members, lanes) {
            let pairs = fleet[member].body_mut().warm_start.near.pairs_mut();
            for (slot, force) in self.slots.iter().zip(&mut self.work.contact_force) {
                if let Some(pair) = slot.pair(lane) {
                    force.set_lane(lane, pairs[pair].force);
                }
            }
            // A pair that takes no part has no force.
            pairs.iter_mut().for_each(|pair| pair.force = 0.0);
        }
    }

    /// Keeps the forces of the `solved` lanes as the next first guess, and notes which contacts close.
    pub(super) fn save_forces<D: Driven>(&mut self, fleet: &mut [D], members: &[usize], solved: Lanes) {
        for (lane, member) in active(members, solved) {
            let warm_start = &mut fleet[member].body_mut().warm_start;
            for (force, all) in warm_start.friction.iter_mut().zip(&self.work.friction_force) {
                *force = Vector2::new(all.x.lane(lane), all.y.lane(lane));
            }
            let pairs = warm_start.near.pairs_mut();
            let contacts =
                self.work.stage.contacts.iter().zip(&self.work.solution.contact).zip(&self.work.contact_force);
            for (slot, ((contact, impulse), force)) in self.slots.iter().zip(contacts) {
                if let Some(pair) = slot.pair(lane) {
                    let pair = &mut pairs[pair];
                    pair.force = force.lane(lane);
                    self.closing[lane] |= !pair.closed && pair.force > 0.0;
                    let direction = Vector2::new(contact.direction.x.lane(lane), contact.direction.y.lane(lane));
                    self.impulses.push((lane, contact.link, direction * impulse.lane(lane)));
                }
            }
        }
    }
}

/// Gap of a pair at the end of the step \[m\].
pub(super) fn end_gap<T: Real>(
    work: &StageWork<T>,
    lane: usize,
    pair: &NearPair,
    plant: &Plant,
    pegs: &PegGrid,
) -> f64 {
    let (end, heading) = (read_vector(&work.end[pair.link], lane), &work.heading[pair.link]);
    let (cos, sin) = (heading.cos.lane(lane), heading.sin.lane(lane));
    link_peg_contact(&end, cos, sin, &plant.robot.links[pair.link], &pegs.pegs()[pair.peg]).gap
}

/// Adds contact impulses `(lane, link, impulse)`, taken `weight` times, to the robots' tallies.
pub(super) fn add_impulses<D: Driven>(
    impulses: &[Impulse],
    fleet: &mut [D],
    members: &[usize],
    lanes: Lanes,
    weight: f64,
) {
    for &(lane, link, impulse) in impulses.iter().filter(|(lane, ..)| lanes[*lane]) {
        fleet[members[lane]].body_mut().tally.contact_impulse[link] += impulse * weight;
    }
}

/// Gap below which a pair becomes a contact of the stage \[m\]; faster robots look farther.
const MARGIN: f64 = 0.002;
