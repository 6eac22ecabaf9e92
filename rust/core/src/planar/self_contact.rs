//! Contacts of robots with themselves: detected before a stage is solved, stored after it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::contact::recovery::{RECOVERY_SPEED, remaining_gap};
use crate::contact::{
    ClosePairs, Folding, FoldingBound, LINK_CONTACTS_PER_LINK, PlacedLink, link_pair_contact, link_pair_gap,
    visit_close_pairs,
};
use crate::math::{Mask, Real};
use crate::robot::{Link, Robot};
use crate::stepping::lanes::{Lanes, NO_LANES, active, read_vector, set_vector};
use crate::stepping::{ClosingRow, ContactImpulse, Driven, Members, Source};

use super::link_pairs::{PosedRobot, place_in_lane};
use super::workspace::Workspace;
use super::{Planar, Stage, StagePair};

/// Two links that are not neighbours, and which of their four ends touches the other link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PairPlace {
    pub links: [usize; 2],
    pub end: usize,
}

impl PairPlace {
    /// Whether it is of a robot of `links` links.
    pub fn fits(&self, links: usize) -> bool {
        let [i, j] = self.links;
        i + 1 < j && j < links && self.end < 4
    }
}

/// What the last stage found at one place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SelfContact {
    pub place: PairPlace,
    /// Contact force \[N\]: the warm start of the next stage.
    pub force: f64,
    /// Penetration left at the end of the last accepted step, at least zero \[m\].
    pub depth: f64,
    /// Whether the contact carried force at the end of the last accepted step.
    pub touches: bool,
}

/// Contacts of the current stage between links of one robot, of all lanes.
#[derive(Debug, Clone)]
pub struct SelfContactDetection<T: Real> {
    /// None where robots do not touch themselves.
    bound: Option<FoldingBound>,
    /// The lanes whose predicted posture allows contact, and those of them where links on either side of a link may touch.
    folded: T::Mask,
    sharp: T::Mask,
    /// Pairs of links that may touch at the predicted end.
    close_pairs: ClosePairs<T>,
    /// The lanes that had contacts in the current step.
    near: Lanes,
    found: Vec<Found>,
    /// All places of all lanes, sorted: a robot's contacts have the same order whatever its neighbours.
    places: Vec<PairPlace>,
    /// Force of each entry of the stage's pairs in the last stage.
    force: Vec<T>,
}

#[derive(Debug, Clone, Copy)]
struct Found {
    lane: usize,
    known: SelfContact,
    direction: [Vector3<f64>; 2],
    offset: f64,
}

impl<T: Real> SelfContactDetection<T> {
    pub fn new(robot: &Robot) -> Self {
        let links = &robot.links;
        Self {
            bound: robot.self_contact.then(|| FoldingBound::new(links, CLEARANCE)),
            folded: T::Mask::of(|_| false),
            sharp: T::Mask::of(|_| false),
            close_pairs: ClosePairs::new(links),
            near: NO_LANES,
            found: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links.len() * T::LANES),
            places: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links.len() * T::LANES),
            force: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links.len() * T::LANES),
        }
    }

    /// Records the lanes in which a robot that is so folded may touch itself.
    #[inline(always)]
    pub fn predict(&mut self, folding: &Folding<T>) {
        if let Some(bound) = &self.bound {
            self.folded = bound.exceeded_by(folding);
            self.sharp = bound.is_sharp(folding);
        }
    }

    /// Lists the pairs of links that may touch at poses which [`Self::predict`] has seen, in those of the `pending` lanes that
    /// are folded; `margin` is the gap up to which a pair takes part \[m\].
    #[inline(always)]
    pub fn list_close_pairs(&mut self, poses: &[Vector3<T>], margin: T, pending: T::Mask) {
        let lanes = self.folded & pending;
        if lanes.any() {
            self.close_pairs.find(poses.iter().map(|pose| pose.xy()), margin, lanes);
        }
    }

    /// Whether robots touch themselves.
    fn is_enabled(&self) -> bool {
        self.bound.is_some()
    }

    /// Whether a predicted posture allows contacts.
    #[inline(always)]
    pub fn is_any_possible(&self) -> bool {
        self.folded.any()
    }

    /// Whether a lane had contacts in the current step.
    pub fn is_near(&self, lane: usize) -> bool {
        self.near[lane]
    }

    pub fn begin_step(&mut self) {
        self.near = NO_LANES;
    }

    #[inline(always)]
    pub fn load_forces(&self, stage: &Stage<T>, impulses: &mut Vec<T>) {
        impulses.clear();
        for force in &self.force {
            impulses.push(*force * stage.coefficient);
        }
    }

    #[inline(always)]
    pub fn store_forces(&mut self, impulses: &[T], per_second: T) {
        for (force, impulse) in self.force.iter_mut().zip(impulses) {
            *force = *impulse * per_second;
        }
    }

    /// Writes all contacts found to the stage.
    fn lay_out(&mut self, pairs: &mut Vec<StagePair<T>>) {
        let Self { found, places, force, .. } = self;
        places.clear();
        places.extend(found.iter().map(|found| found.known.place));
        places.sort_unstable();
        places.dedup();
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        pairs.clear();
        pairs.extend(places.iter().map(|place| StagePair {
            links: place.links,
            direction: [zero; 2],
            offset: T::splat(1.0),
        }));
        force.clear();
        force.resize(places.len(), T::zero());
        for found in found {
            let slot = places.binary_search(&found.known.place).expect("a listed place");
            let pair = &mut pairs[slot];
            for (lanes, direction) in pair.direction.iter_mut().zip(&found.direction) {
                set_vector(lanes, found.lane, direction);
            }
            pair.offset.set_lane(found.lane, found.offset);
            force[slot].set_lane(found.lane, found.known.force);
        }
    }
}

impl<T: Real> SelfContactDetection<T> {
    /// Lists the contacts of one robot; `known` are those of its last stage.
    fn find_contacts(&mut self, robot: &PosedRobot<T>, known: &[SelfContact]) {
        let Self { close_pairs, found, .. } = self;
        robot.visit_contacts(close_pairs.of_lane(robot.lane), |place, at_end, contact| {
            let (direction, gap_rate) = robot.plane(&place, at_end, contact);
            found.push(Found::new(robot, place, direction, gap_rate, known));
        });
    }
}

impl Found {
    /// A contact of this direction and of this gap over c without motion.
    fn new<T: Real>(
        robot: &PosedRobot<T>,
        place: PairPlace,
        direction: [Vector3<f64>; 2],
        gap_rate: f64,
        known: &[SelfContact],
    ) -> Self {
        let known = known.iter().find(|known| known.place == place).copied();
        let known = known.unwrap_or(SelfContact { place, force: 0.0, depth: 0.0, touches: false });
        let offset = gap_rate - remaining_gap(known.depth, robot.elapsed) / robot.coefficient;
        Self { lane: robot.lane, known, direction, offset: offset.max(-RECOVERY_SPEED) }
    }
}

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes with themselves at their predicted ends, `elapsed` after the start of
    /// the step.
    pub(super) fn detect_self_contacts<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        pending: Lanes,
        elapsed: T,
    ) {
        if !self.self_contacts.is_enabled() {
            return;
        }
        let Self { self_contacts, stage, motion_bound, start_pose, base, predicted, heading, travel, .. } = self;
        self_contacts.found.clear();
        let folded = self_contacts.folded;
        for lane in active(pending).filter(|&lane| folded.lane(lane)) {
            let (coefficient, motion_bound) = (stage.coefficient.lane(lane), motion_bound.lane(lane));
            let displacement = motion_bound.displacement;
            let margin = motion_bound.contact_margin(coefficient, 2.0, members.system.smallest_radius());
            let robot = PosedRobot {
                links: &members.system.robot.links,
                lane,
                start: start_pose,
                base,
                end: predicted,
                heading,
                travel,
                coefficient,
                elapsed: elapsed.lane(lane),
                displacement,
                margin,
                is_sharp: self_contacts.sharp.lane(lane),
            };
            let known = &members.body(lane).warm_start.self_contacts;
            let before = self_contacts.found.len();
            self_contacts.find_contacts(&robot, known);
            self_contacts.near[lane] |= self_contacts.found.len() > before;
        }
        self_contacts.lay_out(&mut stage.pairs);
    }

    /// Keeps the forces of the `solved` lanes as the next initial guess, and records which contacts close.
    pub(super) fn keep_self_contacts<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        if !self.self_contacts.is_enabled() {
            return;
        }
        for lane in active(solved) {
            members.body_mut(lane).warm_start.self_contacts.clear();
        }
        let SelfContactDetection { found, places, force, .. } = &self.self_contacts;
        for found in found.iter().filter(|found| solved[found.lane]) {
            let (lane, place) = (found.lane, found.known.place);
            let slot = places.binary_search(&place).expect("a listed place");
            let known = SelfContact { force: force[slot].lane(lane), ..found.known };
            let rate = |u: &[Vector3<T>]| -> f64 {
                let ends = place.links.iter().zip(&found.direction);
                ends.map(|(&link, direction)| direction.dot(&read_vector(&u[link], lane))).sum()
            };
            let row = ClosingRow {
                offset: found.offset,
                expected_rate: rate(&self.guess),
                rate: rate(&self.solution.twist),
                presses: known.force > 0.0,
                touched: known.touches,
            };
            self.closings.add(lane, &row, self.stage.coefficient.lane(lane), self.elapsed.lane(lane));
            members.body_mut(lane).warm_start.self_contacts.push(known);
            let impulse = self.solution.pair[slot].lane(lane);
            let [first, second] = place.links;
            for (link, other, direction) in [(first, second, &found.direction[0]), (second, first, &found.direction[1])]
            {
                contact_impulses.push(ContactImpulse {
                    lane,
                    link,
                    impulse: direction.xy().push(0.0) * impulse,
                    source: Source::Link(other),
                });
            }
        }
    }

    /// Visits the gaps at the start and at the end of the step of all pairs of a lane's links that overlap at its end by
    /// more than `depth` \[m\].
    pub(super) fn visit_self_overlaps(&self, links: &[Link], lane: usize, depth: f64, mut visit: impl FnMut(f64, f64)) {
        let is_surprised = self.self_contacts.is_enabled() && 2.0 * self.deviation.lane(lane) > CLEARANCE;
        if !self.self_contacts.near[lane] && !is_surprised {
            return;
        }
        let centre = |link: usize| read_vector(&self.end[link], lane).xy();
        visit_close_pairs(links, centre, -depth, |i, j| {
            let at_end = [i, j].map(|link| place_in_lane(links, link, lane, &self.end, &self.heading));
            let end = link_pair_gap([&at_end[0], &at_end[1]]);
            if end < -depth {
                let at_start =
                    [i, j].map(|link| PlacedLink::new(&links[link], read_vector(&self.start_pose[link], lane)));
                visit(link_pair_gap([&at_start[0], &at_start[1]]), end);
            }
        });
    }

    /// Gap at a place at the end of the step \[m\].
    fn end_gap_of_pair(&self, links: &[Link], lane: usize, place: &PairPlace) -> f64 {
        let at_end = place.links.map(|link| place_in_lane(links, link, lane, &self.end, &self.heading));
        link_pair_contact([&at_end[0], &at_end[1]], place.end).gap
    }

    /// Ends a step of a lane's robot: records which contacts carry force, and what penetration is left.
    pub(super) fn end_self_contacts(&self, links: &[Link], lane: usize, known: &mut [SelfContact]) {
        for contact in known {
            contact.depth = (-self.end_gap_of_pair(links, lane, &contact.place)).max(0.0);
            contact.touches = contact.force > 0.0;
        }
    }
}

/// Clearance below which links are examined \[m\]: more than they move between a prediction and the end of its stage.
const CLEARANCE: f64 = 0.01;
