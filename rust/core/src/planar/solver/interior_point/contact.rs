use nalgebra::Vector3;

use crate::planar::solver::sweep::Quadratic;
use crate::planar::{StageContact, StageLink};

use super::pair::Pair;

/// Opening and impulse of one contact, and the impulse around which the contact is soft.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    pub pair: Pair,
    centre: f64,
    /// Yield of the contact per impulse beyond the centre \[1/kg\].
    softness: f64,
}

impl Contact {
    /// Of a link of mass `mass` \[kg\].
    pub fn new(mass: f64) -> Self {
        Self { pair: Pair::default(), centre: 0.0, softness: 1.0 / (STIFFEST * mass) }
    }

    /// A pair at the velocity `u` whose product is `mu`.
    pub fn begin(&mut self, contact: &StageContact, link: &StageLink, u: &Vector3<f64>, mu: f64) {
        let opening = contact.direction.dot(u) + contact.offset;
        let s = opening.max((2.0 * mu / link.mass).sqrt());
        self.pair = Pair::new(s, mu / s);
    }

    /// Velocity by which the contact yields \[m/s\].
    pub fn yielding(&self) -> f64 {
        self.softness * (self.pair.z - self.centre)
    }

    /// The present impulse becomes the centre.
    pub fn recentre(&mut self) {
        self.centre = self.pair.z;
    }

    /// Adds the linearised contact to the model of its link.
    pub fn condense(&self, contact: &StageContact, link: &StageLink, u: &Vector3<f64>, model: &mut Quadratic<f64>) {
        let pair = &self.pair;
        let resistance = pair.s + pair.z * self.softness;
        let impulse = pair.z + (pair.right - pair.z * self.mismatch(contact, u)) / resistance;
        let in_plane = link.heading.to_link(contact.direction.xy());
        let direction = Vector3::new(in_plane.x, in_plane.y, contact.direction.z);
        model.add_rank_one(&direction, pair.z / resistance, -impulse);
    }

    /// Lets the pair follow the velocity and its change.
    pub fn follow(&mut self, contact: &StageContact, u: &Vector3<f64>, du: &Vector3<f64>) {
        let closing = self.mismatch(contact, u) + contact.direction.dot(du);
        let Self { pair, softness, .. } = self;
        pair.dz = (pair.right - pair.z * closing) / (pair.s + pair.z * *softness);
        pair.ds = closing + *softness * pair.dz;
    }

    /// The impulse on a link of mass `mass` \[N s\]; an open contact's is only nearly zero on the central path.
    pub fn impulse(&self, mass: f64) -> f64 {
        let Pair { s, z, .. } = self.pair;
        if z < mass * s { 0.0 } else { z }
    }

    /// What the opening at the velocity `u` exceeds the pair's by.
    fn mismatch(&self, contact: &StageContact, u: &Vector3<f64>) -> f64 {
        contact.direction.dot(u) + contact.offset + self.yielding() - self.pair.s
    }
}

/// Largest stiffness, in link masses: it makes the impulses of jammed stages finite.
const STIFFEST: f64 = 1e12;
