//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::recovery::{DEEP, RECOVERY_SPEED, SAME_SIDE, remaining_gap};
use crate::contact::{LinkPegContact, NearPair, NearPegs, PAIRS_PER_LINK, link_obstacle_contact, touching_distance};
use crate::math::Real;
use crate::pegs::PegGrid;
use crate::planar::{Heading, StageContact, StageContactFriction};
use crate::robot::Robot;

use crate::stepping::lanes::{read_vector, set_vector};

/// The contacts of the current stage, of all lanes.
#[derive(Debug, Clone, Default)]
pub struct Contacts {
    found: Vec<Found>,
    /// Those of them that have friction, in their order.
    frictional: Vec<FrictionalContact>,
    /// Pairs of one robot within the margin, and how they are at the predicted end.
    close: Vec<(usize, LinkPegContact)>,
    /// For each link, contacts in the lane that has the most of them; once laid out, its first slot.
    most: Vec<usize>,
}

/// One contact of one robot.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    pub lane: usize,
    /// Index of the near pair.
    pub pair: usize,
    pub link: usize,
    /// Its place in [`crate::planar::Stage::contacts`]; until they are laid out, among those of lane and link.
    pub slot: usize,
    pub direction: Vector3<f64>,
    offset: f64,
    /// In the last stage \[N\].
    force: f64,
}

/// Friction of one contact of one robot.
#[derive(Debug, Clone, Copy)]
pub struct FrictionalContact {
    /// Index of the contact among those found.
    found: usize,
    /// Its place in [`crate::planar::Stage::contact_friction`], once laid out.
    pub row: usize,
    pub lane: usize,
    /// Index of the near pair.
    pub pair: usize,
    pub link: usize,
    pub direction: Vector3<f64>,
    coefficient: f64,
    /// In the last stage \[N\].
    force: f64,
}

/// One robot of a stage: where it starts, where it is predicted to end, and with what mean velocity it gets there.
pub struct Prediction<'a, T> {
    pub robot: &'a Robot,
    pub pegs: &'a PegGrid,
    /// Lane of the robot in all that follows.
    pub lane: usize,
    pub base: &'a [Vector3<T>],
    /// Configuration at the start of the step.
    pub start: &'a [Vector3<T>],
    pub end: &'a [Vector3<T>],
    /// Headings at the predicted end.
    pub heading: &'a [Heading<T>],
    pub travel: &'a [Vector3<T>],
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
    /// Largest displacement of any point of the robot from the start of the step to the predicted end \[m\].
    pub displacement: f64,
    /// Predicted gap up to which a pair takes part \[m\].
    pub margin: f64,
}

impl Found {
    /// Gap at the end of the stage without motion, over its coefficient \[m/s\].
    pub fn offset(&self) -> f64 {
        self.offset
    }
}

impl Contacts {
    pub fn with_capacity(links: usize, lanes: usize) -> Self {
        let pairs = PAIRS_PER_LINK * links;
        Self {
            found: Vec::with_capacity(pairs * lanes),
            frictional: Vec::with_capacity(pairs * lanes),
            close: Vec::with_capacity(pairs),
            most: vec![0; links],
        }
    }

    /// The contacts of all lanes, lane by lane.
    pub fn all(&self) -> &[Found] {
        &self.found
    }

    pub fn clear(&mut self) {
        self.found.clear();
        self.frictional.clear();
        self.most.fill(0);
    }

    /// Finds the contacts of a robot: its near pairs whose predicted gap is below the margin.
    pub fn find<T: Real>(&mut self, near: &mut NearPegs, prediction: &Prediction<T>) {
        self.collect_close(near, prediction);
        for (index, at_end) in &self.close {
            let pair = &mut near.pairs_mut()[*index];
            let (lane, link) = (prediction.lane, pair.link);
            let before = self.found.last().filter(|last| last.lane == lane && last.link == link);
            let slot = before.map_or(0, |last| last.slot + 1);
            self.most[link] = self.most[link].max(slot + 1);
            let (plane, heading, offset) = prediction.plane(pair, at_end);
            let direction = plane.direction;
            let coefficient = prediction.pegs.friction(pair.peg);
            if coefficient > 0.0 && !plane.is_redundant {
                let radius = prediction.robot.links[link].radius;
                let direction = plane.tangent(heading.cos, heading.sin, radius);
                let (found, pair, force) = (self.found.len(), *index, pair.friction);
                self.frictional.push(FrictionalContact {
                    found,
                    row: 0,
                    lane,
                    pair,
                    link,
                    direction,
                    coefficient,
                    force,
                });
            }
            self.found.push(Found { lane, pair: *index, link, slot, direction, offset, force: pair.force });
        }
        // A pair that takes no part has no force.
        near.pairs_mut().iter_mut().for_each(|pair| (pair.force, pair.friction) = (0.0, 0.0));
    }

    /// Collects the pairs within the margin, without a branch that would be mispredicted.
    fn collect_close<T: Real>(&mut self, near: &mut NearPegs, prediction: &Prediction<T>) {
        let (close, mut count) = (&mut self.close, 0);
        near.visit_within(prediction.displacement, prediction.margin, |index, pair| {
            let at_end = prediction.contact(pair);
            close.truncate(count);
            close.push((index, at_end));
            // A wall that the link has crossed is looked at from the start of the step.
            let is_covered = at_end.is_redundant && at_end.gap > -prediction.robot.links[pair.link].radius;
            count += usize::from(at_end.gap < prediction.margin && !is_covered);
            at_end.gap
        });
        close.truncate(count);
    }

    /// Gives every contact its slot in `contacts`, sorted by link and in each lane in the order found, so that a
    /// robot's contacts come in the same order whatever its neighbours; `forces` receives their last forces.
    pub fn lay_out<T: Real>(&mut self, contacts: &mut Vec<StageContact<T>>, forces: &mut Vec<T>) {
        let zero = T::zero();
        let direction = Vector3::new(zero, zero, zero);
        contacts.clear();
        for (link, most) in self.most.iter_mut().enumerate() {
            let first = contacts.len();
            contacts.resize(first + *most, StageContact { link, direction, offset: T::splat(1.0) });
            *most = first;
        }
        forces.clear();
        forces.resize(contacts.len(), zero);
        for found in &mut self.found {
            found.slot += self.most[found.link];
            let contact = &mut contacts[found.slot];
            set_vector(&mut contact.direction, found.lane, &found.direction);
            contact.offset.set_lane(found.lane, found.offset);
            forces[found.slot].set_lane(found.lane, found.force);
        }
    }
}

impl Contacts {
    /// Contacts with friction, of all lanes.
    pub fn frictional(&self) -> &[FrictionalContact] {
        &self.frictional
    }

    /// Gives the friction of every contact its row, in the order of the contacts that have been laid out; `forces`
    /// receives the last forces.
    pub fn lay_out_friction<T: Real>(&mut self, rows: &mut Vec<StageContactFriction<T>>, forces: &mut Vec<T>) {
        rows.clear();
        forces.clear();
        let (found, zero) = (&self.found, T::zero());
        self.frictional.sort_unstable_by_key(|frictional| (found[frictional.found].slot, frictional.lane));
        for frictional in &mut self.frictional {
            let (contact, link) = (found[frictional.found].slot, frictional.link);
            if rows.last().is_none_or(|last| last.contact != contact) {
                let direction = Vector3::new(zero, zero, zero);
                rows.push(StageContactFriction { contact, link, direction, coefficient: zero, bound: zero });
                forces.push(zero);
            }
            frictional.row = rows.len() - 1;
            let row = &mut rows[frictional.row];
            set_vector(&mut row.direction, frictional.lane, &frictional.direction);
            row.coefficient.set_lane(frictional.lane, frictional.coefficient);
            forces[frictional.row].set_lane(frictional.lane, frictional.force);
        }
    }
}

impl<T: Real> Prediction<'_, T> {
    /// A pair at the predicted end.
    fn contact(&self, pair: &NearPair) -> LinkPegContact {
        let (i, lane) = (pair.link, self.lane);
        let (cos, sin) = (self.heading[i].cos.lane(lane), self.heading[i].sin.lane(lane));
        let end = read_vector(&self.end[i], lane);
        link_obstacle_contact(&end, cos, sin, &self.robot.links[i], self.pegs, (pair.peg, pair.place))
    }

    /// Direction and offset of a pair, given how it is at the predicted end.
    ///
    /// The end-of-stage gap (T 3.47 != D5) is linearised at the predicted end configuration,
    /// `g(q_E) = g(q_pred) + c w . (u - u_travel)`, where u_travel is the mean velocity on the way there, so that a
    /// sustained contact is exact to second order. The velocity at its start would not do: while the links of a long chain
    /// turn, what it misses adds up from joint to joint.
    /// Where the prediction runs deep into a peg, or past it, the side is uncertain, and the gap is linearised
    /// at the start of the step (T 3.47 != D9). Either plane touches the distance function of a convex body
    /// from below (for a link that translates), so `g + c w . u >= 0` keeps the true gap non-negative however
    /// long the step.
    fn plane(&self, pair: &NearPair, at_end: &LinkPegContact) -> (LinkPegContact, Heading, f64) {
        let (i, lane, c) = (pair.link, self.lane, self.coefficient);
        let link = &self.robot.links[i];
        let touching = touching_distance(link, self.pegs, pair.peg);
        let mut plane = *at_end;
        let mut at = Heading { cos: self.heading[i].cos.lane(lane), sin: self.heading[i].sin.lane(lane) };
        let mut travelled = c * at_end.direction.dot(&read_vector(&self.travel[i], lane));
        if at_end.gap < -DEEP * touching || self.displacement > touching {
            let start = read_vector(&self.start[i], lane);
            let heading = Heading::of(start.z);
            let at_start =
                link_obstacle_contact(&start, heading.cos, heading.sin, link, self.pegs, (pair.peg, pair.place));
            let same_side = at_start.direction.xy().dot(&at_end.direction.xy()) > SAME_SIDE;
            if at_end.is_redundant && at_start.is_redundant {
                return (NO_CONTACT, Heading { cos: 1.0, sin: 0.0 }, 1.0);
            }
            if (at_end.gap < -DEEP * touching || !same_side) && !at_start.is_redundant {
                (plane, at) = (at_start, heading);
                travelled = -at_start.direction.dot(&(read_vector(&self.base[i], lane) - start));
            }
        }
        let kept = remaining_gap(pair.depth, self.elapsed);
        (plane, at, ((plane.gap - kept - travelled) / c).max(-RECOVERY_SPEED))
    }
}

/// A contact that never closes: an impulse there has no direction.
const NO_CONTACT: LinkPegContact =
    LinkPegContact { gap: f64::INFINITY, direction: Vector3::new(0.0, 0.0, 0.0), along: 0.0, is_redundant: true };
