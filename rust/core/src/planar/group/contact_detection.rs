//! Where the robots of a group touch pegs: found before a stage is solved, kept after it.

use nalgebra::{Vector2, Vector3};

use crate::contact::{NearPair, link_peg_contact};
use crate::math::Real;
use crate::pegs::PegGrid;
use crate::planar::contacts::Prediction;
use crate::planar::stage_kernels::StageKernels;
use crate::planar::stage_work::StageWork;
use crate::planar::{Body, Driven, Plant};
use crate::stepping::lanes::{Lanes, active, mask, read_vector};

use super::Group;

/// Impulse of a peg: lane, link, and impulse in the world frame \[N s\].
pub(super) type Impulse = (usize, usize, Vector2<f64>);

impl<T: StageKernels> Group<T> {
    /// Lanes whose stage ended so far from its prediction that gaps linearised there may be wrong, or
    /// contacts missed.
    pub(super) fn surprised(&self, lanes: Lanes) -> Lanes {
        std::array::from_fn(|lane| lanes[lane] && self.among_pegs[lane] && self.work.deviation.lane(lane) > MARGIN)
    }

    pub(super) fn find_contacts<D: Driven>(
        &mut self,
        plant: &Plant,
        fleet: &mut [D],
        members: &[usize],
        lanes: Lanes,
        elapsed: f64,
    ) {
        T::predict(&mut self.work, &self.start_pose, mask::<T>(lanes));
        self.contacts.clear();
        for (lane, member) in active(members, lanes).filter(|_| self.work.has_pegs) {
            let Body { pegs, warm_start, .. } = fleet[member].body_mut();
            if pegs.pegs().is_empty() {
                continue;
            }
            let prediction = prediction(&self.work, &self.start_pose, plant, pegs, lane, elapsed);
            let (near, &Prediction { lead, margin, .. }) = (&mut warm_start.near, &prediction);
            if !near.covers(lead, margin) {
                let poses = prediction.end.iter().map(|pose| read_vector(pose, lane));
                near.rebuild(poses, &plant.robot.links, pegs, margin, lead);
            }
            self.among_pegs[lane] = !near.pairs().is_empty();
            if self.among_pegs[lane] {
                self.contacts.find(near, &prediction);
            }
        }
        let StageWork { stage, contact_force, among_pegs, .. } = &mut self.work;
        *among_pegs = *among_pegs | mask::<T>(self.among_pegs);
        self.contacts.lay_out(&mut stage.contacts, contact_force);
    }

    /// Keeps the forces of the `solved` lanes as the next first guess, and notes which contacts close.
    pub(super) fn save_forces<D: Driven>(&mut self, fleet: &mut [D], members: &[usize], solved: Lanes) {
        for (lane, member) in active(members, solved) {
            let warm_start = &mut fleet[member].body_mut().warm_start;
            for (force, all) in warm_start.friction.iter_mut().zip(&self.work.friction_force) {
                *force = Vector2::new(all.x.lane(lane), all.y.lane(lane));
            }
        }
        for found in self.contacts.in_lanes(solved) {
            let pair = &mut fleet[members[found.lane]].body_mut().warm_start.near.pairs_mut()[found.pair];
            pair.force = self.work.contact_force[found.slot].lane(found.lane);
            self.closing[found.lane] |= !pair.closed && pair.force > 0.0;
            let impulse = self.work.solution.contact[found.slot].lane(found.lane);
            self.impulses.push((found.lane, found.link, found.direction.xy() * impulse));
        }
    }
}

/// The robot of a lane in the stage at hand.
fn prediction<'a, T: Real>(
    work: &'a StageWork<T>,
    start: &'a [Vector3<T>],
    plant: &'a Plant,
    pegs: &'a PegGrid,
    lane: usize,
    elapsed: f64,
) -> Prediction<'a, T> {
    let StageWork { stage, base, predicted: end, heading, guess: twist, outlook, .. } = work;
    let (lead, coefficient) = (outlook.lead.lane(lane), stage.coefficient);
    let mut margin = MARGIN.max(2.0 * coefficient * outlook.fastest.lane(lane));
    if lead > plant.smallest_radius() {
        // Fast enough to pass a peg within the step.
        margin = margin.max(lead);
    }
    let robot = &plant.robot;
    Prediction { robot, pegs, lane, base, start, end, heading, twist, coefficient, elapsed, lead, margin }
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
