//! Contacts of robots with themselves and with what they can push: detected before a stage is solved, stored after it.

use nalgebra::Vector3;

use crate::contact::{
    ClosePairs, ContactId, Folding, FoldingBound, KnownContact, LINK_CONTACTS_PER_LINK, LinkPairContact, PlacedLink,
    link_pair_contact, link_pair_gap, visit_close_pairs, visit_movable_pairs,
};
use crate::math::{Laned, Mask, Real};
use crate::obstacles::{Moved, Nodes};
use crate::robot::Robot;
use crate::stepping::lanes::{Lanes, NO_LANES, active};
use crate::stepping::{ContactImpulse, FoundFriction, FoundRows, Members};

use super::link_pairs::{place_in_lane, place_numbered};
use super::workspace::Workspace;
use super::{Planar, StagePair};

/// Contacts of the current stage between links of one robot, of all lanes.
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
    pub rows: FoundRows<StagePair, T>,
    friction: FoundFriction<StagePair>,
}

impl<T: Real> SelfContactDetection<T> {
    /// Of robots among obstacles of which so many can be pushed.
    pub fn new(robot: &Robot, movables: usize) -> Self {
        let links = &robot.links;
        let most = LINK_CONTACTS_PER_LINK * (links.len() + movables) * T::LANES;
        Self {
            bound: robot.self_contact.then(|| FoldingBound::new(links, CLEARANCE)),
            folded: T::Mask::of(|_| false),
            sharp: T::Mask::of(|_| false),
            close_pairs: ClosePairs::new(links),
            near: NO_LANES,
            rows: FoundRows::with_capacity(0, most),
            friction: FoundFriction::with_capacity(if robot.link_friction > 0.0 { most } else { 0 }),
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
}

impl<T: Real> Workspace<T> {
    /// Finds the contacts of the `pending` lanes with themselves at their predicted ends.
    pub(super) fn detect_self_contacts(&mut self, members: &mut Members<Planar>, pending: Lanes) {
        if !self.self_contacts.is_enabled() && self.room == 0 {
            return;
        }
        let Self { self_contacts, stage, solution, motion, awake, .. } = self;
        let SelfContactDetection { rows, friction, close_pairs, folded, sharp, near, .. } = self_contacts;
        rows.clear();
        friction.clear();
        let (chain, coefficient) = (members.system.robot.links.len(), members.system.robot.link_friction);
        for lane in active(pending) {
            if !folded.lane(lane) && awake.of(lane).is_empty() {
                continue;
            }
            let body = members.body(lane);
            let nodes = members.system.nodes(&body.obstacles).among(awake.of(lane));
            let robot = motion.of_lane((nodes, &body.state.movables), lane, Real::lane(&stage.coefficient, lane));
            let mut add = |pair: [usize; 2], feature: usize, at_end: &[PlacedLink; 2], contact: &LinkPairContact| {
                let id = ContactId::of_pair(pair.map(|node| nodes.number(node)), feature);
                let known = body.warm_start.self_contacts.of(id);
                let (row, along) = robot.row(pair, feature, at_end, contact, known.depth);
                if coefficient > 0.0 && pair[1] < chain {
                    friction.add(rows.all().len(), along(), coefficient);
                }
                rows.add(lane, id, known, row);
                near[lane] = true;
            };
            if folded.lane(lane) {
                robot.visit_contacts(close_pairs.of_lane(lane), sharp.lane(lane), &mut add);
            }
            robot.visit_movable_contacts(add);
        }
        rows.lay_out(stage.coefficient, &mut stage.pairs, &mut solution.pair);
        let (c, impulses) = (stage.coefficient, &mut solution.pair_friction);
        friction.lay_out(c, rows, &stage.pairs, &mut stage.pair_friction, impulses);
    }

    /// Keeps the forces as the next initial guess.
    pub(super) fn keep_self_contacts(
        &mut self,
        members: &mut Members<Planar>,
        solved: Lanes,
        contact_impulses: &mut Vec<ContactImpulse>,
    ) {
        let Self { self_contacts, solution, stage, motion, awake, .. } = self;
        let (coefficient, chain) = (stage.coefficient, motion.arms.len());
        for lane in active(solved) {
            members.body_mut(lane).warm_start.self_contacts.retain(|id| awake.sleeps(lane, chain, id));
        }
        self_contacts.rows.read(coefficient, (&solution.pair, solved), contact_impulses, |found, force| {
            if !solved[found.lane] {
                return;
            }
            let known = KnownContact { force, ..found.known };
            members.body_mut(found.lane).warm_start.self_contacts.add(found.id, known);
        });
        let SelfContactDetection { rows, friction, .. } = self_contacts;
        let solved_friction = (&solution.pair_friction[..], solved);
        friction.read(coefficient, rows, solved_friction, contact_impulses, |of, force| {
            let found = &rows.all()[of];
            if solved[found.lane] {
                members.body_mut(found.lane).warm_start.self_contacts.set_friction(found.id, force);
            }
        });
    }

    /// Visits the gaps at the start and at the end of the step of all pairs of a lane's links that overlap at its end by
    /// more than `depth` \[m\].
    pub(super) fn visit_self_overlaps(&self, nodes: Nodes, lane: usize, depth: f64, mut visit: impl FnMut(f64, f64)) {
        let is_surprised = self.self_contacts.is_enabled() && 2.0 * self.result.deviation.lane(lane) > CLEARANCE;
        let centre = |node: usize| self.result.end[node].lane(lane).xy();
        let mut measure = |i: usize, j: usize| {
            let at_end = [i, j].map(|node| place_in_lane(nodes, node, lane, &self.result.end, &self.motion.heading));
            let end = link_pair_gap([&at_end[0], &at_end[1]]);
            if end < -depth {
                let at_start =
                    [i, j].map(|node| PlacedLink::new(nodes.get(node), self.motion.start_pose[node].lane(lane)));
                visit(link_pair_gap([&at_start[0], &at_start[1]]), end);
            }
        };
        if self.self_contacts.is_enabled() && (self.self_contacts.near[lane] || is_surprised) {
            visit_close_pairs(nodes.links, centre, -depth, &mut measure);
        }
        visit_movable_pairs(nodes, centre, -depth, measure);
    }

    /// Gap of a contact of a lane's robot with itself at the end of the step \[m\].
    pub(super) fn end_gap_of_pair(&self, nodes: Nodes, lane: usize, lying: &[Moved], id: ContactId) -> f64 {
        let Some(pair) = id.pair() else { return f64::INFINITY };
        let (end, heading) = (&self.result.end, &self.motion.heading);
        let at_end = pair.map(|number| place_numbered((nodes, lying), number, lane, end, heading));
        link_pair_contact([&at_end[0], &at_end[1]], id.feature).gap
    }
}

/// Clearance below which links are examined \[m\]: more than they move between a prediction and the end of its stage.
const CLEARANCE: f64 = 0.01;
