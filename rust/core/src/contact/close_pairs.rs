//! Pairs of links that may touch each other, of robots in lanes.

use nalgebra::SVector;

use crate::math::{Mask, Real};
use crate::robot::Link;

/// The pairs `i < j` of links that are not neighbours and are close to each other in a lane; `D` dimensions.
#[derive(Debug, Clone)]
pub struct ClosePairs<T: Real, const D: usize> {
    /// Positions of the links' CGs.
    centres: Vec<SVector<T, D>>,
    /// Upper bounds on the length of a link, and on twice its reach \[m\].
    longest: f64,
    reaches: f64,
    found: Vec<ClosePair<T::Mask>>,
}

#[derive(Debug, Clone, Copy)]
struct ClosePair<M> {
    links: [usize; 2],
    lanes: M,
}

impl<T: Real, const D: usize> ClosePairs<T, D> {
    pub fn new(links: &[Link]) -> Self {
        Self {
            centres: Vec::with_capacity(links.len()),
            longest: links.iter().map(|link| link.length).fold(0.0, f64::max),
            reaches: 2.0 * links.iter().map(Link::reach).fold(0.0, f64::max),
            found: Vec::with_capacity(PAIRS_PER_LINK * links.len()),
        }
    }

    /// Lists all pairs whose surfaces are within `margin` of each other in one of `lanes`, and some that are farther
    /// apart, in the order of their links.
    ///
    /// Along the chain the distance from link `i` changes by at most the length of a link, so that a link that is far away
    /// in all lanes rules out those after it.
    #[inline(always)]
    pub fn find(&mut self, centres: impl Iterator<Item = SVector<T, D>>, margin: T, lanes: T::Mask) {
        self.centres.clear();
        self.centres.extend(centres);
        self.found.clear();
        let close = T::splat(self.reaches) + margin;
        let far = close + T::splat((LEAP - 1) as f64 * self.longest);
        let (close, far) = (close * close, far * far);
        for (i, first) in self.centres.iter().enumerate() {
            let mut j = i + 2;
            while let Some(second) = self.centres.get(j) {
                let mut squared = T::zero();
                for axis in 0..D {
                    let difference = second[axis] - first[axis];
                    squared = difference.mul_add(difference, squared);
                }
                let near = squared.lt(close) & lanes;
                if near.any() {
                    self.found.push(ClosePair { links: [i, j], lanes: near });
                }
                j += if (squared.lt(far) & lanes).any() { 1 } else { LEAP };
            }
        }
    }

    /// The pairs of a lane.
    pub fn of_lane(&self, lane: usize) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.found.iter().filter(move |pair| pair.lanes.lane(lane)).map(|pair| pair.links)
    }
}

/// Links that are passed over after one that is far away.
const LEAP: usize = 8;

/// Pairs reserved for each link; a robot that is more tightly folded grows the list once.
const PAIRS_PER_LINK: usize = 8;
