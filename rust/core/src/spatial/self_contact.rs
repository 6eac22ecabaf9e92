//! Where robots touch themselves: found before a stage is solved, kept after it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::contact::recovery::{DEEP, RECOVERY_SPEED, SAME_SIDE, remaining_gap};
use crate::contact::{
    Capsule, CapsuleContact, FoldingBound, capsule_contact, capsule_contacts, capsule_gap, closest_capsule_contact,
    visit_close_pairs,
};
use crate::math::{MAX_LANES, Mask, Real};
use crate::robot::{Link, Robot};
use crate::stepping::lanes::{Lanes, NO_LANES, active};
use crate::stepping::penetration::{ALLOWED, Sinking};
use crate::stepping::{ContactImpulse, Source};

use super::pair_slots::PairSlots;
use super::penetration::farthest_travel;
use super::workspace::Workspace;
use super::{Frame, Laned, PairPlace, Pose, Stage, StagePair, StageSolution, Twist, Wrench};

/// A contact that took part in the last stage, and its force \[N\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SelfContact {
    pub place: PairPlace,
    pub force: f64,
    /// Whether it carried force at the end of the last accepted step.
    pub touches: bool,
}

/// Contacts of the stage at hand between links of one robot, of all lanes.
#[derive(Debug, Clone)]
pub struct SelfContactDetection<T: Real> {
    /// None where robots do not touch themselves.
    bound: Option<FoldingBound>,
    links: Vec<Link>,
    /// The lanes whose predicted posture allows contact.
    folded: T::Mask,
    /// The lanes that had contacts in the step at hand.
    near: Lanes,
    found: Vec<Found>,
    slots: PairSlots<T>,
    /// Contacts of the last stage, lane by lane.
    known: [Vec<SelfContact>; MAX_LANES],
}

#[derive(Debug, Clone, Copy)]
struct Found {
    lane: usize,
    place: PairPlace,
    pair: StagePair,
    /// Whether the contact carried force at the end of the last accepted step.
    touched: bool,
}

/// Where two links of a robot are during a stage.
struct Situation<'a> {
    links: [&'a Link; 2],
    /// At the start of the step, at the base of the stage, and at its predicted end.
    start: [Frame; 2],
    base: [Frame; 2],
    end: [Frame; 2],
    /// Twists with which the end is predicted.
    expected: [Twist; 2],
    /// c \[s\].
    coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    elapsed: f64,
}

impl<T: Real> SelfContactDetection<T> {
    pub fn new(robot: &Robot) -> Self {
        let bound = robot.self_contact.then(|| FoldingBound::new(&robot.links, CLEARANCE));
        Self::of(robot.links.clone(), bound)
    }

    fn of(links: Vec<Link>, bound: Option<FoldingBound>) -> Self {
        let contacts = CONTACTS_PER_LINK * links.len();
        Self {
            bound,
            links,
            folded: T::Mask::of(|_| false),
            near: NO_LANES,
            found: Vec::with_capacity(contacts * T::LANES),
            slots: PairSlots::with_capacity(contacts * T::LANES),
            known: std::array::from_fn(|_| Vec::with_capacity(contacts)),
        }
    }

    /// Stands in for the detection while that is at work.
    fn placeholder() -> Self {
        Self::of(Vec::new(), None)
    }

    /// Takes over what the last step of a lane's robot left.
    pub fn recall(&mut self, lane: usize, known: &[SelfContact]) {
        self.known[lane].clear();
        self.known[lane].extend_from_slice(known);
    }

    pub fn known(&self, lane: usize) -> &[SelfContact] {
        &self.known[lane]
    }

    pub fn begin_step(&mut self) {
        self.near = NO_LANES;
    }

    /// Notes the lanes in which a robot with links at `frames` may touch itself.
    #[inline(always)]
    pub fn predict(&mut self, frames: &[Frame<T>]) {
        if let Some(bound) = &self.bound {
            self.folded = bound.exceeded_by_axes(frames.iter().map(|frame| frame.axes[2]));
        }
    }

    #[inline(always)]
    pub fn load_impulses(&self, c: T, impulses: &mut Vec<T>) {
        self.slots.load_impulses(c, impulses);
    }

    /// Lays all contacts found out in the stage.
    fn lay_out(&mut self, pairs: &mut Vec<StagePair<T>>) {
        let Self { found, slots, known, .. } = self;
        slots.fill(found.iter().map(|found| found.place));
        pairs.clear();
        pairs.extend(slots.places().iter().map(|place| StagePair::nowhere(place.links)));
        for Found { lane, place, pair, touched } in found {
            let slot = slots.slot(place);
            pairs[slot].set_lane(*lane, pair);
            let known = known[*lane].iter().find(|known| known.place == *place);
            slots.set_force(slot, *lane, known.map_or(0.0, |known| known.force));
            *touched = known.is_some_and(|known| known.touches);
        }
    }

    /// The forces of a lane's solved stage become those that the next one starts from.
    pub fn remember(&mut self, stage: &Stage<T>, solution: &StageSolution<T>, lane: usize) {
        let Self { found, slots, known, .. } = self;
        let force = |place: &PairPlace| solution.pair[slots.slot(place)].lane(lane) / stage.coefficient.lane(lane);
        known[lane].clear();
        for Found { place, touched, .. } in found.iter().filter(|found| found.lane == lane) {
            known[lane].push(SelfContact { place: *place, force: force(place), touches: *touched });
        }
    }

    /// The contacts of a lane's solved stage, their impulses, and whether they touched before.
    pub fn solved_rows<'a>(
        &'a self,
        solution: &'a StageSolution<T>,
        lane: usize,
    ) -> impl Iterator<Item = (StagePair, f64, bool)> + 'a {
        let impulse = move |place| solution.pair[self.slots.slot(place)].lane(lane);
        let found = self.found.iter().filter(move |found| found.lane == lane);
        found.map(move |Found { place, pair, touched, .. }| (*pair, impulse(place), *touched))
    }

    /// Impulses between the links in a lane's solved stage.
    pub fn contact_impulses<'a>(
        &'a self,
        solution: &'a StageSolution<T>,
        lane: usize,
    ) -> impl Iterator<Item = ContactImpulse> + 'a {
        self.found.iter().filter(move |found| found.lane == lane).flat_map(move |Found { place, pair, .. }| {
            let impulse = solution.pair[self.slots.slot(place)].lane(lane);
            [0, 1].map(|k| ContactImpulse {
                lane,
                link: pair.links[k],
                impulse: pair.direction[k].linear * impulse,
                source: Source::Link(pair.links[1 - k]),
            })
        })
    }

    /// Whether links of a lane may overlap at the end of the step, which lies `deviation` from where contacts were looked for.
    pub fn may_overlap(&self, lane: usize, deviation: f64) -> bool {
        self.near[lane] || (self.bound.is_some() && 2.0 * deviation > CLEARANCE)
    }

    /// What a step from `start` to `end` does to the penetrations of a lane's robot into itself.
    pub fn sinking(&self, links: &[Link], start: &[Frame<T>], end: &[Frame<T>], lane: usize) -> Sinking {
        let mut sinking = Sinking::No;
        let gap = |frames: &[Frame<T>], pair: [usize; 2]| {
            let [first, second] = pair.map(|link| capsule(&links[link], &frames[link].lane(lane)));
            capsule_gap([&first, &second])
        };
        let position = |frames: &[Frame<T>], link: usize| frames[link].position.lane(lane);
        let travelled = |link: usize| farthest_travel(&links[link], &start[link].lane(lane), &end[link].lane(lane));
        visit_close_pairs(
            links,
            |link| position(end, link),
            -ALLOWED,
            |i, j| {
                let gap_at_end = gap(end, [i, j]);
                if gap_at_end < -ALLOWED {
                    sinking = sinking.max(Sinking::of(gap(start, [i, j]), gap_at_end));
                }
            },
        );
        if self.near[lane] && (0..links.len()).any(|link| travelled(link) > links[link].radius) {
            sinking = sinking.max(Sinking::TooDeep);
        }
        sinking
    }
}

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes with themselves at their predicted ends, `elapsed` after the start of
    /// the step.
    pub(super) fn find_self_contacts(&mut self, pending: Lanes, elapsed: T) {
        if self.self_contacts.bound.is_none() {
            return;
        }
        let mut detection = std::mem::replace(&mut self.self_contacts, SelfContactDetection::placeholder());
        let SelfContactDetection { found, near, folded, links, .. } = &mut detection;
        found.clear();
        for lane in active(pending).filter(|&lane| folded.lane(lane)) {
            let centre = |link: usize| self.frames[link].position.lane(lane);
            let [start, end] = [&self.start_frames, &self.frames];
            let travel = |i: usize| farthest_travel(&links[i], &start[i].lane(lane), &end[i].lane(lane));
            let travelled = (0..links.len()).map(travel).fold(0.0, f64::max);
            if travelled > links.iter().map(|link| link.radius).fold(f64::INFINITY, f64::min) {
                // Fast enough for two links to pass each other within the step.
                visit_close_pairs(links, centre, 2.0 * travelled, |_, _| near[lane] = true);
            }
            visit_close_pairs(links, centre, MARGIN, |i, j| {
                let situation = Situation::of(self, lane, [i, j], links, elapsed.lane(lane));
                situation.visit(|contact, direction, offset| {
                    let pair = StagePair { links: [i, j], direction, offset };
                    let place = PairPlace { links: [i, j], contact };
                    found.push(Found { lane, place, pair, touched: false });
                    near[lane] = true;
                });
            });
        }
        detection.lay_out(&mut self.stage.pairs);
        self.self_contacts = detection;
    }
}

impl<'a> Situation<'a> {
    fn of<T: Real>(work: &Workspace<T>, lane: usize, pair: [usize; 2], links: &'a [Link], elapsed: f64) -> Self {
        Self {
            links: pair.map(|link| &links[link]),
            start: pair.map(|link| work.start_frames[link].lane(lane)),
            base: pair.map(|link| work.base_frames[link].lane(lane)),
            end: pair.map(|link| work.frames[link].lane(lane)),
            expected: pair.map(|link| work.expected[link].lane(lane)),
            coefficient: work.stage.coefficient.lane(lane),
            elapsed,
        }
    }

    /// Calls `add` with number, direction and offset of every contact that may matter.
    fn visit(&self, mut add: impl FnMut(usize, [Wrench; 2], f64)) {
        let end = self.capsules(&self.end);
        for (number, at_end) in capsule_contacts([&end[0], &end[1]]).filter(|(_, contact)| contact.gap < MARGIN) {
            let (direction, offset) = self.contact(number, &at_end);
            add(number, direction, offset);
        }
    }

    /// Direction and offset of a contact; see [`super::peg_contacts`] for where gaps are linearised.
    fn contact(&self, number: usize, at_end: &CapsuleContact) -> ([Wrench; 2], f64) {
        let [first, second] = self.capsules(&self.start);
        let start = [&first, &second];
        let at_start = capsule_contact(start, number).unwrap_or_else(|| closest_capsule_contact(start));
        let touching = self.links[0].radius + self.links[1].radius;
        let is_deep = at_end.gap < -DEEP * touching;
        let (direction, still) = if is_deep || at_start.normal.dot(&at_end.normal) < SAME_SIDE {
            let moved = |k: usize| {
                let point = |frame: &Frame| frame.position + frame.axes[2] * at_start.along[k];
                point(&self.base[k]) - point(&self.start[k])
            };
            (self.direction(&self.start, &at_start), at_start.gap + at_start.normal.dot(&(moved(0) - moved(1))))
        } else {
            let direction = self.direction(&self.end, at_end);
            let closing = direction[0].dot(&self.expected[0]) + direction[1].dot(&self.expected[1]);
            (direction, at_end.gap - self.coefficient * closing)
        };
        let kept = remaining_gap((-at_start.gap).max(0.0), self.elapsed);
        (direction, ((still - kept) / self.coefficient).max(-RECOVERY_SPEED))
    }

    fn direction(&self, frames: &[Frame; 2], contact: &CapsuleContact) -> [Wrench; 2] {
        let CapsuleContact { normal, along, .. } = contact;
        [0, 1].map(|k| {
            let linear: Vector3<f64> = if k == 0 { *normal } else { -normal };
            Wrench { linear, angular: (frames[k].axes[2] * along[k]).cross(&linear) }
        })
    }

    fn capsules(&self, frames: &[Frame; 2]) -> [Capsule<'a>; 2] {
        [0, 1].map(|k| capsule(self.links[k], &frames[k]))
    }
}

/// Smallest distance of a robot's links that are not neighbours \[m\], negative where they overlap; infinite where none
/// are close.
pub fn self_gap(links: &[Link], poses: &[Pose]) -> f64 {
    let mut smallest = f64::INFINITY;
    let centre = |link: usize| poses[link].position;
    visit_close_pairs(links, centre, 0.0, |i, j| {
        let capsule = |k: usize| Capsule { link: &links[k], centre: poses[k].position, axis: poses[k].axis() };
        smallest = smallest.min(capsule_gap([&capsule(i), &capsule(j)]));
    });
    smallest
}

fn capsule<'a>(link: &'a Link, frame: &Frame) -> Capsule<'a> {
    Capsule { link, centre: frame.position, axis: frame.axes[2] }
}

/// Predicted gap up to which a pair takes part \[m\].
const MARGIN: f64 = 0.02;

/// Clearance of the postures in which links are not looked at \[m\]: more than they move between a prediction and the end
/// of its stage, and little enough for straight robots to have it.
const CLEARANCE: f64 = 0.01;

/// Room for contacts of a robot with itself; more are possible.
const CONTACTS_PER_LINK: usize = 4;
