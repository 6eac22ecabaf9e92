//! Between one robot's plain numbers and its lane of a group.

use nalgebra::Vector3;

use crate::math::{MAX_LANES, Mask, Real};

/// Lanes still on their way through a step.
pub type Lanes = [bool; MAX_LANES];

pub const NO_LANES: Lanes = [false; MAX_LANES];

/// The lanes that have a robot.
pub fn lanes_of(members: &[usize]) -> Lanes {
    std::array::from_fn(|lane| lane < members.len())
}

/// The robot of a lane, the first one where there is none: lanes without a robot repeat it.
pub fn member_of(members: &[usize], lane: usize) -> usize {
    *members.get(lane).unwrap_or(&members[0])
}

pub fn mask<T: Real>(lanes: Lanes) -> T::Mask {
    T::Mask::of(|lane| lanes[lane])
}

/// Lane and robot of the lanes still in the step.
pub fn active(members: &[usize], lanes: Lanes) -> impl Iterator<Item = (usize, usize)> + '_ {
    members.iter().copied().enumerate().filter(move |(lane, _)| lanes[*lane])
}

#[inline]
pub fn read_vector<T: Real>(from: &Vector3<T>, lane: usize) -> Vector3<f64> {
    Vector3::new(from.x.lane(lane), from.y.lane(lane), from.z.lane(lane))
}

#[inline]
pub fn set_vector<T: Real>(to: &mut Vector3<T>, lane: usize, from: &Vector3<f64>) {
    to.x.set_lane(lane, from.x);
    to.y.set_lane(lane, from.y);
    to.z.set_lane(lane, from.z);
}

pub fn read_lane<T: Real>(from: &[Vector3<T>], lane: usize, to: &mut [Vector3<f64>]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = read_vector(from, lane);
    }
}
