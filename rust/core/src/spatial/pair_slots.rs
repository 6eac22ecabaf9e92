//! Where the contacts of robots with themselves are in the stage of a register.

use serde::{Deserialize, Serialize};

use crate::contact::CAPSULE_CONTACTS;
use crate::math::Real;

/// Two links that are not neighbours, and which of the contacts that a pair can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PairPlace {
    pub links: [usize; 2],
    /// Number of the contact, see [`crate::contact::capsule_contacts`].
    pub contact: usize,
}

impl PairPlace {
    /// Whether it is of a robot of `links` links.
    pub fn fits(&self, links: usize) -> bool {
        let [i, j] = self.links;
        i + 1 < j && j < links && self.contact < CAPSULE_CONTACTS
    }
}

/// All places of all lanes, sorted: a robot's contacts come in the same order alone and among others.
#[derive(Debug, Clone)]
pub struct PairSlots<T> {
    places: Vec<PairPlace>,
    /// Force at each place in the last stage \[N\].
    force: Vec<T>,
}

impl<T: Real> PairSlots<T> {
    pub fn with_capacity(slots: usize) -> Self {
        Self { places: Vec::with_capacity(slots), force: Vec::with_capacity(slots) }
    }

    /// Takes over all places that robots have, without forces.
    pub fn fill(&mut self, found: impl Iterator<Item = PairPlace>) {
        let Self { places, force } = self;
        places.clear();
        places.extend(found);
        places.sort_unstable();
        places.dedup();
        force.clear();
        force.resize(places.len(), T::zero());
    }

    pub fn places(&self) -> &[PairPlace] {
        &self.places
    }

    /// Index of a place among the contacts of the stage.
    pub fn slot(&self, place: &PairPlace) -> usize {
        self.places.binary_search(place).expect("a listed place")
    }

    pub fn set_force(&mut self, slot: usize, lane: usize, force: f64) {
        self.force[slot].set_lane(lane, force);
    }

    /// Impulses of the forces over a stage of coefficient `c`.
    #[inline(always)]
    pub fn load_impulses(&self, c: T, impulses: &mut Vec<T>) {
        impulses.clear();
        for force in &self.force {
            impulses.push(*force * c);
        }
    }
}
