//! Where robots touch themselves: found before a stage is solved, kept after it.

use nalgebra::Vector3;

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{
    Capsule, CapsuleContact, ContactId, FoldingBound, LINK_CONTACTS_PER_LINK, capsule_contact, capsule_contacts,
    capsule_gap, closest_capsule_contact, visit_close_pairs,
};
use crate::math::{Laned, Mask, Real};
use crate::robot::{Link, Robot};
use crate::stepping::FoundRows;
use crate::stepping::lanes::{Lanes, NO_LANES, active};
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::obstacle_contacts::MARGIN;
use super::penetration::farthest_travel;
use super::workspace::{Motion, StageKinematics, Workspace};
use super::{Frame, LinkAxis, Pose, StagePair, Wrench};

/// Contacts of the stage at hand between links of one robot, of all lanes.
pub struct SelfContactDetection<T: Real> {
    /// None where robots do not touch themselves.
    bound: Option<FoldingBound>,
    links: Vec<Link>,
    /// The lanes whose predicted posture allows contact.
    folded: T::Mask,
    /// The lanes that had contacts in the step at hand.
    near: Lanes,
    pub rows: FoundRows<StagePair, T>,
}

/// Two links of a robot in a stage, or a ball as a link without a length.
pub(super) struct PairInStage<'a> {
    pub at: [StageKinematics<'a>; 2],
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
}

impl<T: Real> SelfContactDetection<T> {
    /// Of robots among obstacles of which so many can be pushed.
    pub fn new(robot: &Robot, movables: usize) -> Self {
        let links = robot.links.clone();
        Self {
            bound: robot.self_contact.then(|| FoldingBound::new(&links, CLEARANCE)),
            folded: T::Mask::of(|_| false),
            near: NO_LANES,
            rows: FoundRows::with_capacity(0, LINK_CONTACTS_PER_LINK * (links.len() + movables) * T::LANES),
            links,
        }
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

    /// Whether links of a lane may overlap at the end of the step, which lies `deviation` from where contacts were looked for.
    pub fn may_overlap(&self, lane: usize, deviation: f64) -> bool {
        self.near[lane] || (self.bound.is_some() && 2.0 * deviation > CLEARANCE)
    }

    /// What a step from `start` to `end` does to the penetrations of a lane's robot into itself.
    pub fn sinking(&self, links: &[Link], start: &[Frame<T>], end: &[Frame<T>], lane: usize) -> Sinking {
        let mut sinking = Sinking::No;
        let gap = |frames: &[Frame<T>], pair: [usize; 2]| {
            let [first, second] = pair.map(|link| capsule(&links[link], &frames[link].axis_of(lane)));
            capsule_gap([&first, &second])
        };
        let position = |frames: &[Frame<T>], link: usize| frames[link].position.lane(lane);
        let travelled =
            |link: usize| farthest_travel(&links[link], &start[link].axis_of(lane), &end[link].axis_of(lane));
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
    /// Finds the contacts of the `pending` lanes with themselves at their predicted ends.
    pub(super) fn find_self_contacts(&mut self, pending: Lanes) {
        let Self { self_contacts, known, motion, stage, .. } = self;
        let SelfContactDetection { bound, rows, near, folded, links, .. } = self_contacts;
        let motion = &*motion;
        let Motion { start_frames, frames, elapsed, .. } = motion;
        rows.clear();
        for lane in active(pending).filter(|&lane| bound.is_some() && folded.lane(lane)) {
            let centre = |link: usize| frames[link].position.lane(lane);
            let travel =
                |i: usize| farthest_travel(&links[i], &start_frames[i].axis_of(lane), &frames[i].axis_of(lane));
            let travelled = (0..links.len()).map(travel).fold(0.0, f64::max);
            if travelled > links.iter().map(|link| link.radius).fold(f64::INFINITY, f64::min) {
                // Fast enough for two links to pass each other within the step.
                visit_close_pairs(links, centre, 2.0 * travelled, |_, _| near[lane] = true);
            }
            let [coefficient, elapsed] = [stage.coefficient, *elapsed].map(|time| time.lane(lane));
            visit_close_pairs(links, centre, MARGIN, |i, j| {
                let at = [i, j].map(|link| motion.of_link(links, link, lane));
                PairInStage { at, coefficient, elapsed }.visit(|feature, direction, offset| {
                    let id = ContactId::of_pair([i, j], feature);
                    rows.add(lane, id, known[lane].of(id), StagePair { links: [i, j], direction, offset });
                    near[lane] = true;
                });
            });
        }
    }
}

impl PairInStage<'_> {
    /// Calls `add` with number, direction and offset of every contact that may matter.
    fn visit(&self, mut add: impl FnMut(usize, [Wrench; 2], f64)) {
        let end = self.capsules(|link| &link.end);
        for (number, at_end) in capsule_contacts([&end[0], &end[1]]).filter(|(_, contact)| contact.gap < MARGIN) {
            let (direction, offset) = self.contact(number, &at_end);
            add(number, direction, offset);
        }
    }

    /// The contact that has this number, if it may matter.
    pub fn row(&self, number: usize) -> Option<([Wrench; 2], f64)> {
        let end = self.capsules(|link| &link.end);
        let at_end = capsule_contact([&end[0], &end[1]], number).filter(|contact| contact.gap < MARGIN);
        at_end.map(|at_end| self.contact(number, &at_end))
    }

    /// Direction and offset of a contact; see [`super::obstacle_contacts`] for where gaps are linearised.
    fn contact(&self, number: usize, at_end: &CapsuleContact) -> ([Wrench; 2], f64) {
        let c = self.coefficient;
        let [first, second] = self.capsules(|link| &link.start);
        let start = [&first, &second];
        let at_start = capsule_contact(start, number).unwrap_or_else(|| closest_capsule_contact(start));
        let touching = self.at[0].link.radius + self.at[1].link.radius;
        let is_deep = at_end.gap < -DEEP * touching;
        let (direction, gap, travelled) = if is_deep || at_start.normal.dot(&at_end.normal) < SAME_SIDE {
            let moved = |k: usize| {
                let point = |at: &LinkAxis| at.position + at.axis * at_start.along[k];
                point(&self.at[k].base) - point(&self.at[k].start)
            };
            (self.direction(|link| &link.start, &at_start), at_start.gap, -at_start.normal.dot(&(moved(0) - moved(1))))
        } else {
            let direction = self.direction(|link| &link.end, at_end);
            let closing = direction[0].dot(&self.at[0].expected) + direction[1].dot(&self.at[1].expected);
            (direction, at_end.gap, c * closing)
        };
        (direction, offset(gap, travelled, (-at_start.gap).max(0.0), c, self.elapsed))
    }

    fn direction(
        &self,
        at: impl for<'b> Fn(&'b StageKinematics) -> &'b LinkAxis,
        contact: &CapsuleContact,
    ) -> [Wrench; 2] {
        let CapsuleContact { normal, along, .. } = contact;
        [0, 1].map(|k| {
            let linear: Vector3<f64> = if k == 0 { *normal } else { -normal };
            Wrench { linear, angular: (at(&self.at[k]).axis * along[k]).cross(&linear) }
        })
    }

    fn capsules(&self, at: impl for<'b> Fn(&'b StageKinematics) -> &'b LinkAxis) -> [Capsule<'_>; 2] {
        [0, 1].map(|k| capsule(self.at[k].link, at(&self.at[k])))
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

pub(super) fn capsule<'a>(link: &'a Link, at: &LinkAxis) -> Capsule<'a> {
    Capsule { link, centre: at.position, axis: at.axis }
}

/// Clearance of the postures in which links are not looked at \[m\]: more than they move between a prediction and the end
/// of its stage, and little enough for straight robots to have it.
const CLEARANCE: f64 = 0.01;
