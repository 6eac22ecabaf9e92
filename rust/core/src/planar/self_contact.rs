//! Where robots touch themselves: found before a stage is solved, kept after it.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::recovery::{DEEP, RECOVERY_SPEED, SAME_SIDE, remaining_gap};
use crate::contact::{
    FoldingBound, LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contact, link_pair_ends, link_pair_gap,
    visit_close_pairs,
};
use crate::math::{MAX_LANES, Mask, Real};
use crate::robot::Link;
use crate::stepping::lanes::{Lanes, NO_LANES, active, read_vector, set_vector};
use crate::stepping::{ContactImpulse, Driven, Members};

use super::contact_detection::MARGIN;
use super::stage_work::StageWork;
use super::{Heading, Planar, Stage, StagePair};

/// Two links and which of their four ends touches the other link.
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
    /// Whether the contact carried force at the end of the last accepted step, and of the one before too.
    pub touches: bool,
    pub closed: bool,
}

/// Contacts of the stage at hand between links of one robot, of all lanes.
#[derive(Debug, Clone)]
pub struct SelfContactDetection<T: Real> {
    /// None where robots do not touch themselves.
    bound: Option<FoldingBound>,
    /// The lanes whose predicted posture allows contact.
    folded: T::Mask,
    /// The lanes that had contacts in the step at hand.
    near: Lanes,
    found: Vec<Found>,
    /// Deepest penetration of each lane's robot into itself at the start of the step \[m\].
    deepest: [f64; MAX_LANES],
    links: Vec<Link>,
    /// All places of all lanes, sorted: a robot's contacts come in the same order alone and among others.
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
    pub fn new(links: &[Link], is_enabled: bool) -> Self {
        Self {
            bound: is_enabled.then(|| FoldingBound::new(links, CLEARANCE)),
            folded: T::Mask::of(|_| false),
            near: NO_LANES,
            found: Vec::with_capacity(links.len() * T::LANES),
            deepest: [0.0; MAX_LANES],
            links: links.to_vec(),
            places: Vec::with_capacity(links.len() * T::LANES),
            force: Vec::with_capacity(links.len() * T::LANES),
        }
    }

    /// Notes the lanes in which a robot with links of these absolute angles may touch itself.
    #[inline(always)]
    pub fn predict(&mut self, poses: &[Vector3<T>]) {
        if let Some(bound) = &self.bound {
            self.folded = bound.exceeded_by(poses.iter().map(|pose| pose.z));
        }
    }

    /// Takes note of how deep the robots of a register are in themselves.
    pub fn load<D: Driven<Model = Planar>>(&mut self, members: &Members<D>) {
        for lane in 0..T::LANES {
            let contacts = &members.body(lane).warm_start.self_contacts;
            self.deepest[lane] = contacts.iter().fold(0.0, |deepest, contact| contact.depth.max(deepest));
        }
    }

    #[inline(always)]
    pub fn is_any_folded(&self) -> bool {
        self.folded.any()
    }

    /// Whether a lane had contacts in the step at hand.
    pub fn is_near(&self, lane: usize) -> bool {
        self.near[lane]
    }

    pub fn is_any_near(&self) -> bool {
        self.near != NO_LANES
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

    /// Lays all contacts found out in the stage.
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

impl<T: Real> StageWork<T> {
    /// Finds the contacts of the `pending` lanes with themselves at their predicted ends, `elapsed` after the start of
    /// the step.
    pub(super) fn detect_self_contacts<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        pending: Lanes,
        elapsed: T,
    ) {
        if self.self_contacts.bound.is_none() {
            return;
        }
        let mut detection = std::mem::replace(&mut self.self_contacts, SelfContactDetection::new(&[], false));
        detection.found.clear();
        let folded = detection.folded;
        for lane in active(pending).filter(|&lane| folded.lane(lane)) {
            let known = &members.body(lane).warm_start.self_contacts;
            self.find_self_contacts(&members.system.robot.links, lane, elapsed.lane(lane), known, &mut detection);
        }
        detection.found.iter().for_each(|found| detection.near[found.lane] = true);
        detection.lay_out(&mut self.stage.pairs);
        self.self_contacts = detection;
    }

    fn find_self_contacts(
        &self,
        links: &[Link],
        lane: usize,
        elapsed: f64,
        known: &[SelfContact],
        detection: &mut SelfContactDetection<T>,
    ) {
        let c = self.stage.coefficient.lane(lane);
        let margin = MARGIN.max(2.0 * c * self.motion_bound.fastest.lane(lane));
        let found = &mut detection.found;
        let centre = |link: usize| read_vector(&self.predicted[link], lane).xy();
        visit_close_pairs(links, centre, margin, |i, j| {
            let pair = [i, j];
            let at_end = pair.map(|link| place_in_lane(links, link, lane, &self.predicted, &self.heading));
            for end in link_pair_ends([&at_end[0], &at_end[1]]) {
                let contact = link_pair_contact([&at_end[0], &at_end[1]], end);
                if contact.gap >= margin {
                    continue;
                }
                let place = PairPlace { links: pair, end };
                let known = known.iter().find(|known| known.place == place).copied();
                let known =
                    known.unwrap_or(SelfContact { place, force: 0.0, depth: 0.0, touches: false, closed: false });
                let (direction, gap_rate) = self.pair_plane(links, pair, end, lane, &at_end, &contact);
                let offset = gap_rate - remaining_gap(known.depth, elapsed) / c;
                found.push(Found { lane, known, direction, offset: offset.max(-RECOVERY_SPEED) });
            }
        });
    }

    /// Direction of a contact, and its linearised gap without motion over c; see
    /// [`super::contacts::Prediction`] for where gaps are linearised.
    fn pair_plane(
        &self,
        links: &[Link],
        pair: [usize; 2],
        end: usize,
        lane: usize,
        at_end: &[PlacedLink; 2],
        contact: &LinkPairContact,
    ) -> ([Vector3<f64>; 2], f64) {
        let c = self.stage.coefficient.lane(lane);
        let touching = links[pair[0]].radius + links[pair[1]].radius;
        let along = |direction: &[Vector3<f64>; 2], of: &dyn Fn(usize) -> Vector3<f64>| {
            direction[0].dot(&of(pair[0])) + direction[1].dot(&of(pair[1]))
        };
        let is_deep = contact.gap < -DEEP * touching || centre_lines_cross([&at_end[0], &at_end[1]]);
        if is_deep || self.motion_bound.displacement.lane(lane) > touching {
            let at_start = pair.map(|link| PlacedLink::new(&links[link], read_vector(&self.start_pose[link], lane)));
            let start = link_pair_contact([&at_start[0], &at_start[1]], end);
            let is_same_side = start.normal.dot(&contact.normal) > SAME_SIDE;
            if is_deep || !is_same_side {
                let moved =
                    |link: usize| read_vector(&self.base[link], lane) - read_vector(&self.start_pose[link], lane);
                return (start.direction, (start.gap + along(&start.direction, &moved)) / c);
            }
        }
        let twist = |link: usize| read_vector(&self.guess[link], lane);
        (contact.direction, contact.gap / c - along(&contact.direction, &twist))
    }

    /// Keeps the forces of the `solved` lanes as the next first guess, and notes which contacts close.
    pub(super) fn keep_self_contacts<D: Driven<Model = Planar>>(
        &mut self,
        members: &mut Members<D>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        if self.self_contacts.bound.is_none() {
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
            self.closing[lane] |= !known.closed && known.force > 0.0;
            members.body_mut(lane).warm_start.self_contacts.push(known);
            let impulse = self.solution.pair[slot].lane(lane);
            for (link, direction) in place.links.into_iter().zip(&found.direction) {
                contact_impulses.push(ContactImpulse {
                    lane,
                    link,
                    impulse: direction.xy() * impulse,
                    is_internal: true,
                });
            }
        }
    }

    /// Whether the end of the step takes links of a lane's robot too much deeper into each other than they were: they
    /// turn so fast that their linearised gaps say little.
    pub(super) fn sinks_into_itself(&self, lane: usize) -> bool {
        let SelfContactDetection { links, deepest, near, .. } = &self.self_contacts;
        if !near[lane] {
            return false;
        }
        let mut sinks = false;
        visit_close_pairs(
            links,
            |link| read_vector(&self.end[link], lane).xy(),
            0.0,
            |i, j| {
                let at_end = [i, j].map(|link| place_in_lane(links, link, lane, &self.end, &self.heading));
                sinks |= link_pair_gap([&at_end[0], &at_end[1]]) < -deepest[lane] - SINKING;
            },
        );
        sinks
    }

    /// Gap at a place at the end of the step \[m\].
    fn end_gap_of_pair(&self, links: &[Link], lane: usize, place: &PairPlace) -> f64 {
        let at_end = place.links.map(|link| place_in_lane(links, link, lane, &self.end, &self.heading));
        link_pair_contact([&at_end[0], &at_end[1]], place.end).gap
    }

    /// Ends a step of a lane's robot: remembers which contacts carry force, and what penetration is left.
    pub(super) fn end_self_contacts(&self, links: &[Link], lane: usize, known: &mut [SelfContact]) {
        for contact in known {
            contact.depth = (-self.end_gap_of_pair(links, lane, &contact.place)).max(0.0);
            let touches = contact.force > 0.0;
            contact.closed = touches && contact.touches;
            contact.touches = touches;
        }
    }
}

/// A link of a lane's robot at a pose whose direction is known.
fn place_in_lane<'a, T: Real>(
    links: &'a [Link],
    link: usize,
    lane: usize,
    pose: &[Vector3<T>],
    heading: &[Heading<T>],
) -> PlacedLink<'a> {
    let Heading { cos, sin } = heading[link];
    let axis = Vector2::new(cos.lane(lane), sin.lane(lane));
    PlacedLink { link: &links[link], pose: read_vector(&pose[link], lane), axis }
}

/// A step that takes links deeper into each other by more is divided \[m\].
const SINKING: f64 = 1e-4;

/// Clearance at which links are looked at \[m\]: more than they move between a prediction and the end of its stage.
const CLEARANCE: f64 = 0.01;
