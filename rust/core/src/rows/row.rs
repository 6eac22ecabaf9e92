use serde::{Deserialize, Serialize};

use crate::math::{Laned, Real};

use super::Screw;

/// Contact of one link with something that no robot moves. A lane without it has direction 0 and offset 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactRow<S, T = f64> {
    pub link: usize,
    /// w.
    pub direction: S,
    /// Gap over coefficient: the contact closes when `w . u + offset` reaches zero \[m/s\].
    pub offset: T,
}

/// Contact between two links of a robot. A lane without it has directions 0 and offset 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairRow<S, T = f64> {
    /// In order along the chain.
    pub links: [usize; 2],
    /// w of either link.
    pub direction: [S; 2],
    /// Gap over coefficient: the contact closes when `w_0 . u_0 + w_1 . u_1 + offset` reaches zero \[m/s\].
    pub offset: T,
}

/// Largest speed at which a contact of one robot is to open \[m/s\].
pub fn demanded_speed<S>(contacts: &[ContactRow<S>], pairs: &[PairRow<S>]) -> f64 {
    let offsets = contacts.iter().map(|contact| contact.offset).chain(pairs.iter().map(|pair| pair.offset));
    offsets.fold(0.0, |fastest, offset| f64::max(fastest, -offset))
}

/// Lets penetrations remain: none is to open.
pub fn relax<S>(contacts: &mut [ContactRow<S>], pairs: &mut [PairRow<S>]) {
    contacts.iter_mut().for_each(|contact| contact.offset = contact.offset.max(0.0));
    pairs.iter_mut().for_each(|pair| pair.offset = pair.offset.max(0.0));
}

/// Coulomb friction of one of the rows of a stage, along a row between the same links whose offset is not used. A lane
/// without it has directions 0.
///
/// `-w^T u in N_[-b, b](P)` with `b = mu P_H`. Since P_H is an unknown, a stage with it is no optimisation problem.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionRow<R, T = f64> {
    /// Index of the row whose impulse P_H presses.
    pub normal: usize,
    /// Along the surfaces, to the left of the normal.
    pub along: R,
    /// mu.
    pub coefficient: T,
    /// The bound b to start with, or that is held \[N s\].
    pub bound: T,
}

/// A row with an impulse that is nonnegative, and zero while the row is open, or one along which there is friction.
pub trait Row<S: Screw<T>, T: Real> {
    fn offset(&self) -> T;

    fn first_link(&self) -> usize;

    /// The same row in no lane.
    fn vacated(&self) -> Self;

    /// The links on which it acts, and its directions.
    fn parts(&self) -> impl Iterator<Item = (usize, &S)>;

    /// The direction on the first of these links.
    fn first_direction(&self) -> &S;

    /// Rate at which the gap opens under the twists of the links \[m/s\].
    #[inline(always)]
    fn rate(&self, twist: &[S]) -> T {
        let mut rate = T::zero();
        for (link, direction) in self.parts() {
            rate += direction.power(&twist[link]);
        }
        rate
    }

    /// The rate and the offset: nonnegative where the contact is admissible \[m/s\].
    #[inline(always)]
    fn opening(&self, twist: &[S]) -> T {
        self.rate(twist) + self.offset()
    }
}

impl<S: Screw<T>, T: Real> Row<S, T> for ContactRow<S, T> {
    #[inline(always)]
    fn offset(&self) -> T {
        self.offset
    }

    #[inline(always)]
    fn first_link(&self) -> usize {
        self.link
    }

    fn vacated(&self) -> Self {
        Self::empty(self.link)
    }

    #[inline(always)]
    fn parts(&self) -> impl Iterator<Item = (usize, &S)> {
        std::iter::once((self.link, &self.direction))
    }

    fn first_direction(&self) -> &S {
        &self.direction
    }
}

impl<S: Screw<T>, T: Real> Row<S, T> for PairRow<S, T> {
    #[inline(always)]
    fn offset(&self) -> T {
        self.offset
    }

    #[inline(always)]
    fn first_link(&self) -> usize {
        self.links[0]
    }

    fn vacated(&self) -> Self {
        Self::empty(self.links)
    }

    #[inline(always)]
    fn parts(&self) -> impl Iterator<Item = (usize, &S)> {
        self.links.into_iter().zip(&self.direction)
    }

    fn first_direction(&self) -> &S {
        &self.direction[0]
    }
}

impl<S: Screw<T>, T: Real> ContactRow<S, T> {
    /// A row that no lane has.
    pub fn empty(link: usize) -> Self {
        Self { link, direction: Screw::zero(), offset: T::splat(1.0) }
    }
}

impl<S: Screw<T>, T: Real> PairRow<S, T> {
    /// A row that no lane has.
    pub fn empty(links: [usize; 2]) -> Self {
        Self { links, direction: [Screw::zero(); 2], offset: T::splat(1.0) }
    }
}

/// The link stays what it is.
impl<S: Laned<T>, T: Real> Laned<T> for ContactRow<S, T> {
    type One = ContactRow<S::One>;

    fn lane(&self, lane: usize) -> Self::One {
        ContactRow { link: self.link, direction: self.direction.lane(lane), offset: Real::lane(&self.offset, lane) }
    }

    fn set_lane(&mut self, lane: usize, one: &Self::One) {
        self.direction.set_lane(lane, &one.direction);
        Real::set_lane(&mut self.offset, lane, one.offset);
    }
}

/// The links stay what they are.
impl<S: Laned<T>, T: Real> Laned<T> for PairRow<S, T> {
    type One = PairRow<S::One>;

    fn lane(&self, lane: usize) -> Self::One {
        let direction = [0, 1].map(|k| self.direction[k].lane(lane));
        PairRow { links: self.links, direction, offset: Real::lane(&self.offset, lane) }
    }

    fn set_lane(&mut self, lane: usize, one: &Self::One) {
        for (lanes, direction) in self.direction.iter_mut().zip(&one.direction) {
            lanes.set_lane(lane, direction);
        }
        Real::set_lane(&mut self.offset, lane, one.offset);
    }
}

/// The normal row stays the one it is.
impl<R: Laned<T>, T: Real> Laned<T> for FrictionRow<R, T> {
    type One = FrictionRow<R::One>;

    fn lane(&self, lane: usize) -> Self::One {
        FrictionRow {
            normal: self.normal,
            along: self.along.lane(lane),
            coefficient: Real::lane(&self.coefficient, lane),
            bound: Real::lane(&self.bound, lane),
        }
    }

    fn set_lane(&mut self, lane: usize, one: &Self::One) {
        self.along.set_lane(lane, &one.along);
        Real::set_lane(&mut self.coefficient, lane, one.coefficient);
        Real::set_lane(&mut self.bound, lane, one.bound);
    }
}
