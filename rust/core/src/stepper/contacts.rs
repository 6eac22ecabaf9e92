//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::{LinkPegContact, NearPair, NearPegs, link_peg_contact};
use crate::math::{MAX_LANES, Real};
use crate::pegs::PegGrid;
use crate::planar::{Heading, Stage, StageContact};
use crate::robot::Robot;

use super::lanes::{read_vector, set_vector};

/// What a slot of [`Stage::contacts`] stands for in each lane: the index of a near pair.
#[derive(Debug, Clone, Copy)]
pub struct Slot {
    pair: [u32; MAX_LANES],
}

impl Slot {
    const EMPTY: Slot = Slot { pair: [u32::MAX; MAX_LANES] };

    /// The near pair of a lane, if the lane has this contact.
    pub fn pair(&self, lane: usize) -> Option<usize> {
        let pair = self.pair[lane];
        (pair != u32::MAX).then_some(pair as usize)
    }
}

/// One robot of a stage: where it starts, where it is predicted to end, and with what velocity.
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
    pub twist: &'a [Vector3<T>],
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
    /// Largest way of any point of the robot from the start of the step to the predicted end \[m\].
    pub lead: f64,
    /// Predicted gap up to which a pair takes part \[m\].
    pub margin: f64,
}

/// Adds to its lane of `stage` the near pairs whose predicted gap is below the margin.
pub fn add_contacts<T: Real>(
    stage: &mut Stage<T>,
    slots: &mut Vec<Slot>,
    near: &mut NearPegs,
    prediction: &Prediction<T>,
) {
    let lane = prediction.lane;
    let mut unused = 0;
    near.visit_within(prediction.lead, prediction.margin, |index, pair| {
        let at_end = prediction.contact(pair);
        if at_end.gap < prediction.margin {
            let (direction, offset) = prediction.plane(pair, &at_end, stage.coefficient);
            let slot = free_slot(stage, slots, unused, lane, pair.link);
            unused = slot + 1;
            slots[slot].pair[lane] = index as u32;
            let contact = &mut stage.contacts[slot];
            set_vector(&mut contact.direction, lane, &direction);
            contact.offset.set_lane(lane, offset);
        }
        at_end.gap
    });
}

impl<T: Real> Prediction<'_, T> {
    /// A pair at the predicted end.
    fn contact(&self, pair: &NearPair) -> LinkPegContact {
        let (i, lane) = (pair.link, self.lane);
        let (cos, sin) = (self.heading[i].cos.lane(lane), self.heading[i].sin.lane(lane));
        let end = read_vector(&self.end[i], lane);
        link_peg_contact(&end, cos, sin, &self.robot.links[i], &self.pegs.pegs()[pair.peg])
    }

    /// Direction and offset of a pair, given how it is at the predicted end.
    ///
    /// The end-of-stage gap (T 3.47 != D5) is linearised at the predicted end configuration,
    /// `g(q_E) = g(q_pred) + c w . (u - u_pred)`, so that a sustained contact is exact to second order.
    /// Where the prediction runs deep into a peg, or past it, the side is uncertain, and the gap is linearised
    /// at the start of the step (T 3.47 != D9). Either plane touches the distance function of a convex body
    /// from below (for a link that translates), so `g + c w . u >= 0` keeps the true gap non-negative however
    /// long the step.
    fn plane(&self, pair: &NearPair, at_end: &LinkPegContact, c: f64) -> (Vector3<f64>, f64) {
        let (i, lane) = (pair.link, self.lane);
        let (link, peg) = (&self.robot.links[i], &self.pegs.pegs()[pair.peg]);
        let touching = peg.radius + link.radius;
        let mut plane = *at_end;
        let mut travelled = c * at_end.direction.dot(&read_vector(&self.twist[i], lane));
        if at_end.gap < -DEEP * touching || self.lead > touching {
            let start = read_vector(&self.start[i], lane);
            let heading = Heading::of(start.z);
            let at_start = link_peg_contact(&start, heading.cos, heading.sin, link, peg);
            let same_side = at_start.direction.xy().dot(&at_end.direction.xy()) > SAME_SIDE;
            if at_end.gap < -DEEP * touching || !same_side {
                plane = at_start;
                travelled = -at_start.direction.dot(&(read_vector(&self.base[i], lane) - start));
            }
        }
        let haste = 1.0 + pair.depth / SLIGHT_DEPTH;
        let floor = -pair.depth * (1.0 - haste * self.elapsed / RECOVERY_TIME).max(0.0);
        (plane.direction, ((plane.gap - floor - travelled) / c).max(-RECOVERY_SPEED))
    }
}

/// The first slot of link `link` that `lane` has not used yet, none of which lies before `first`; slots are sorted by
/// link as pairs are, so that every robot's contacts come in the same order alone and among others.
fn free_slot<T: Real>(stage: &mut Stage<T>, slots: &mut Vec<Slot>, first: usize, lane: usize, link: usize) -> usize {
    let mut position = first;
    while position < slots.len() && stage.contacts[position].link <= link {
        if stage.contacts[position].link == link && slots[position].pair(lane).is_none() {
            return position;
        }
        position += 1;
    }
    let zero = T::zero();
    let open = StageContact { link, direction: Vector3::new(zero, zero, zero), offset: T::splat(1.0) };
    stage.contacts.insert(position, open);
    slots.insert(position, Slot::EMPTY);
    position
}

/// Predicted penetration, relative to the sum of the radii, beyond which the side is uncertain.
const DEEP: f64 = 0.1;

/// Cosine between the normals at the start and at the predicted end of a step down to which the link is
/// certainly still on the same side of the peg.
const SAME_SIDE: f64 = 0.5;

/// Fastest separation asked of a penetrating contact \[m/s\] (T 3.55 != D10): an initial penetration is undone over
/// several steps instead of being thrown out within one.
const RECOVERY_SPEED: f64 = 0.2;

/// Time within which a slight penetration, as the linearisation of the gap leaves it, fades \[s\]: undone within a
/// short stage it would kick the robot. Deeper ones fade faster, so that fast motions do not add them up.
const RECOVERY_TIME: f64 = 0.05;

/// Penetration above which haste prevails \[m\].
const SLIGHT_DEPTH: f64 = 5e-4;
