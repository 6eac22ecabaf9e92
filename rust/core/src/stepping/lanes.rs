//! Robots in the lanes of a register.

use crate::math::{MAX_LANES, Mask, Real};

use super::body::{Body, Driven};
use super::model::Model;

/// A truth value for each lane.
pub type Lanes = [bool; MAX_LANES];

pub const NO_LANES: Lanes = [false; MAX_LANES];

/// The robots that share a register for one step, with the system that they are copies of.
pub struct Members<'a, 'r, M: Model> {
    pub system: &'a M::System,
    robots: &'a mut [Driven<'r, M>],
    indices: &'a [usize],
}

impl<'a, 'r, M: Model> Members<'a, 'r, M> {
    pub fn new(system: &'a M::System, robots: &'a mut [Driven<'r, M>], indices: &'a [usize]) -> Self {
        Self { system, robots, indices }
    }

    /// The robot of a lane, the first one where there is none: lanes without a robot repeat it.
    pub fn robot(&self, lane: usize) -> &Driven<'r, M> {
        &self.robots[*self.indices.get(lane).unwrap_or(&self.indices[0])]
    }

    pub fn body(&self, lane: usize) -> &Body<M> {
        self.robot(lane).body
    }

    /// The body of a lane that has a robot.
    pub fn body_mut(&mut self, lane: usize) -> &mut Body<M> {
        self.robots[self.indices[lane]].body
    }

    /// The lanes that have a robot.
    pub fn lanes(&self) -> Lanes {
        std::array::from_fn(|lane| lane < self.indices.len())
    }

    /// Whether any of the robots satisfies `is_so`.
    pub fn any(&self, is_so: impl Fn(&Body<M>) -> bool) -> bool {
        self.indices.iter().any(|&index| is_so(self.robots[index].body))
    }
}

pub fn mask<T: Real>(lanes: Lanes) -> T::Mask {
    T::Mask::of(|lane| lanes[lane])
}

/// The lanes for which `lanes` is true.
pub fn active(lanes: Lanes) -> impl Iterator<Item = usize> {
    (0..MAX_LANES).filter(move |&lane| lanes[lane])
}
