//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{LinkPegContact, NearPair, NearPegs, PAIRS_PER_LINK, link_obstacle_contact, touching_distance};
use crate::math::{Laned, Real};
use crate::pegs::PegGrid;
use crate::planar::{Heading, StageContact, StageContactFriction};
use crate::robot::Robot;
use crate::rows::Screw;
use crate::stepping::FoundRows;

/// The contacts of the current stage, of all lanes.
#[derive(Debug, Clone)]
pub struct Contacts {
    pub rows: FoundRows<StageContact>,
    /// Those of them that have friction, in their order.
    frictional: Vec<FrictionalContact>,
    /// Pairs of one robot within the margin, and how they are at the predicted end.
    close: Vec<(usize, LinkPegContact)>,
}

/// Friction of one contact of one robot.
#[derive(Debug, Clone, Copy)]
pub struct FrictionalContact {
    /// Index of the contact among those found.
    pub found: usize,
    /// Its index in [`crate::planar::Stage::contact_friction`], once laid out.
    pub row: usize,
    pub direction: Vector3<f64>,
    coefficient: f64,
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

impl Contacts {
    pub fn with_capacity(links: usize, lanes: usize) -> Self {
        let pairs = PAIRS_PER_LINK * links;
        Self {
            rows: FoundRows::with_capacity(links, pairs * lanes),
            frictional: Vec::with_capacity(pairs * lanes),
            close: Vec::with_capacity(pairs),
        }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.frictional.clear();
    }

    /// Finds the contacts of a robot: its near pairs whose predicted gap is below the margin.
    pub fn find<T: Real>(&mut self, near: &mut NearPegs, prediction: &Prediction<T>) {
        self.collect_close(near, prediction);
        for (index, at_end) in &self.close {
            let pair = &near.pairs()[*index];
            let link = pair.link;
            let (plane, heading, offset) = prediction.plane(pair, at_end);
            let coefficient = prediction.pegs.friction(pair.peg);
            if coefficient > 0.0 && !plane.is_redundant {
                let radius = prediction.robot.links[link].radius;
                let direction = plane.tangent(heading.cos, heading.sin, radius);
                self.frictional.push(FrictionalContact {
                    found: self.rows.all().len(),
                    row: 0,
                    direction,
                    coefficient,
                });
            }
            let row = StageContact { link, direction: plane.direction, offset };
            self.rows.add(prediction.lane, pair.id(), *index, pair.known, row);
        }
        // A pair that takes no part has no force.
        for pair in near.pairs_mut() {
            (pair.known.force, pair.known.friction) = (0.0, Vector3::zeros());
        }
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

    /// Contacts with friction, of all lanes.
    pub fn frictional(&self) -> &[FrictionalContact] {
        &self.frictional
    }

    /// Gives the friction of every contact its row, in the order of the contacts that have been laid out; `impulses` are
    /// those of the last forces over a stage of coefficient `c`.
    pub fn lay_out_friction<T: Real>(&mut self, c: T, rows: &mut Vec<StageContactFriction<T>>, impulses: &mut Vec<T>) {
        rows.clear();
        impulses.clear();
        let (found, zero) = (self.rows.all(), T::zero());
        self.frictional.sort_unstable_by_key(|frictional| (found[frictional.found].slot, found[frictional.found].lane));
        for frictional in &mut self.frictional {
            let of = &found[frictional.found];
            if rows.last().is_none_or(|last| last.contact != of.slot) {
                let (contact, link, direction) = (of.slot, of.row.link, Screw::zero());
                rows.push(StageContactFriction { contact, link, direction, coefficient: zero, bound: zero });
                impulses.push(zero);
            }
            frictional.row = rows.len() - 1;
            let row = &mut rows[frictional.row];
            row.direction.set_lane(of.lane, &frictional.direction);
            Real::set_lane(&mut row.coefficient, of.lane, frictional.coefficient);
            let force = frictional.direction.xy().dot(&of.known.friction.xy());
            Real::set_lane(&mut impulses[frictional.row], of.lane, force * Real::lane(c, of.lane));
        }
    }
}

impl<T: Real> Prediction<'_, T> {
    /// A pair at the predicted end.
    fn contact(&self, pair: &NearPair) -> LinkPegContact {
        let (i, lane) = (pair.link, self.lane);
        let (cos, sin) = (Real::lane(self.heading[i].cos, lane), Real::lane(self.heading[i].sin, lane));
        let end = self.end[i].lane(lane);
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
        let mut at = self.heading[i].lane(lane);
        let mut travelled = c * at_end.direction.dot(&self.travel[i].lane(lane));
        if at_end.gap < -DEEP * touching || self.displacement > touching {
            let start = self.start[i].lane(lane);
            let heading = Heading::of(start.z);
            let at_start =
                link_obstacle_contact(&start, heading.cos, heading.sin, link, self.pegs, (pair.peg, pair.place));
            let same_side = at_start.direction.xy().dot(&at_end.direction.xy()) > SAME_SIDE;
            if at_end.is_redundant && at_start.is_redundant {
                return (NO_CONTACT, Heading { cos: 1.0, sin: 0.0 }, 1.0);
            }
            if (at_end.gap < -DEEP * touching || !same_side) && !at_start.is_redundant {
                (plane, at) = (at_start, heading);
                travelled = -at_start.direction.dot(&(self.base[i].lane(lane) - start));
            }
        }
        (plane, at, offset(plane.gap, travelled, pair.known.depth, c, self.elapsed))
    }
}

/// A contact that never closes: an impulse there has no direction.
const NO_CONTACT: LinkPegContact =
    LinkPegContact { gap: f64::INFINITY, direction: Vector3::new(0.0, 0.0, 0.0), along: 0.0, is_redundant: true };
