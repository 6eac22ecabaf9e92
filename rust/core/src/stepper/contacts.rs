//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::{NearPair, link_peg_contact};
use crate::math::{MAX_LANES, Real};
use crate::pegs::PegGrid;
use crate::planar::{Heading, Pose, Stage, StageContact, Twist};
use crate::robot::Robot;

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
pub struct Prediction<'a> {
    pub robot: &'a Robot,
    pub pegs: &'a PegGrid,
    pub base: &'a [Pose],
    pub end: &'a [Pose],
    /// Headings at the predicted end.
    pub heading: &'a [Heading],
    pub twist: &'a [Twist],
    /// Predicted gap up to which a pair takes part \[m\].
    pub margin: f64,
}

/// Adds to lane `lane` of `stage` the near pairs whose predicted gap is below the margin.
///
/// The end-of-stage gap (T 3.47 != D5) is linearised at the predicted end configuration,
/// `g(q_E) = g(q_pred) + c w . (u - u_pred)`, so that a sustained contact is exact to second order.
/// Where the prediction runs deep into a peg the side is uncertain, and the gap is linearised at
/// the start (T 3.47 != D9). Either plane touches the distance function of a convex body from below (for a link
/// that translates), so `g + c w . u >= 0` keeps the true gap non-negative however long the step.
pub fn add_contacts<T: Real>(
    stage: &mut Stage<T>,
    slots: &mut Vec<Slot>,
    lane: usize,
    pairs: &[NearPair],
    prediction: &Prediction,
) {
    let c = stage.coefficient;
    for (index, pair) in pairs.iter().enumerate() {
        let i = pair.link;
        let (link, peg) = (&prediction.robot.links[i], &prediction.pegs.pegs()[pair.peg]);
        let heading = prediction.heading[i];
        let at_end = link_peg_contact(&prediction.end[i], heading.cos, heading.sin, link, peg);
        if at_end.gap > prediction.margin {
            continue;
        }
        let (contact, travelled) = if at_end.gap > -DEEP * (peg.radius + link.radius) {
            (at_end, at_end.direction.dot(&prediction.twist[i]))
        } else {
            let start = Heading::of(prediction.base[i].z);
            (link_peg_contact(&prediction.base[i], start.cos, start.sin, link, peg), 0.0)
        };
        let offset = (contact.gap / c - travelled).max(-RECOVERY_SPEED);
        let slot = free_slot(stage, slots, lane, i);
        slots[slot].pair[lane] = index as u32;
        set(&mut stage.contacts[slot], lane, &contact.direction, offset);
    }
}

/// The first slot of link `link` that `lane` has not used yet; slots are sorted by link, so that every
/// robot's contacts come in the same order alone and among others.
fn free_slot<T: Real>(stage: &mut Stage<T>, slots: &mut Vec<Slot>, lane: usize, link: usize) -> usize {
    let mut position = 0;
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

fn set<T: Real>(contact: &mut StageContact<T>, lane: usize, direction: &Vector3<f64>, offset: f64) {
    contact.direction.x.set_lane(lane, direction.x);
    contact.direction.y.set_lane(lane, direction.y);
    contact.direction.z.set_lane(lane, direction.z);
    contact.offset.set_lane(lane, offset);
}

/// Predicted penetration, relative to the sum of the radii, beyond which the side is uncertain.
const DEEP: f64 = 0.1;

/// Fastest separation asked of a penetrating contact \[m/s\] (T 3.55 != D10): an initial penetration is undone over
/// several steps instead of being thrown out within one.
const RECOVERY_SPEED: f64 = 0.2;
