//! Pairs of links that may touch each other, of robots in lanes.

use nalgebra::Vector2;

use crate::math::{Mask, Real};
use crate::robot::Link;

/// The pairs `i < j` of links that are not neighbours and are close to each other in a lane.
pub struct ClosePairs<T: Real> {
    /// Positions of the links' CGs.
    centres: Vec<Vector2<T>>,
    /// Upper bounds on the distance of neighbouring CGs, and on twice the reach of a link \[m\].
    longest: f64,
    reaches: f64,
    found: Vec<ClosePair<T::Mask>>,
}

#[derive(Debug, Clone, Copy)]
struct ClosePair<M> {
    links: [usize; 2],
    lanes: M,
}

impl<T: Real> ClosePairs<T> {
    pub fn new(links: &[Link]) -> Self {
        Self {
            centres: Vec::with_capacity(links.len()),
            longest: Link::farthest_neighbours(links),
            reaches: 2.0 * links.iter().map(Link::reach).fold(0.0, f64::max),
            found: Vec::with_capacity(ROOM_PER_LINK * links.len()),
        }
    }

    /// Lists all pairs whose surfaces are within `margin` of each other in one of `lanes`, and some that are farther
    /// apart, in the order of their links.
    ///
    /// Along the chain the distance from link `i` changes by at most the distance of neighbouring CGs, so that a link that
    /// is far away in all lanes rules out those after it.
    #[inline(always)]
    pub fn find(&mut self, centres: impl Iterator<Item = Vector2<T>>, margin: T, lanes: T::Mask) {
        self.centres.clear();
        self.centres.extend(centres);
        self.found.clear();
        let close = T::splat(self.reaches) + margin;
        let far = close + T::splat((LEAP - 1) as f64 * self.longest);
        let (close, far) = (close * close, far * far);
        for (i, first) in self.centres.iter().enumerate() {
            let mut j = i + 2;
            while let Some(second) = self.centres.get(j) {
                let (x, y) = (second.x - first.x, second.y - first.y);
                let squared = x.mul_add(x, y * y);
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
const ROOM_PER_LINK: usize = 8;

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use nalgebra::Vector2;

    use super::ClosePairs;
    use crate::math::{Mask, Real, Wide4};
    use crate::robot::{Robot, RobotConfig};

    const LINKS: usize = 40;

    /// CGs of links of this length whose joints are all bent by the same angle.
    fn arc(length: f64, bend: f64) -> [Vector2<f64>; LINKS] {
        let mut joint = Vector2::zeros();
        std::array::from_fn(|link| {
            let (sin, cos) = (bend * link as f64).sin_cos();
            let arm = Vector2::new(cos, sin) * (0.5 * length);
            joint += 2.0 * arm;
            joint - arm
        })
    }

    /// Links on a line that comes straight back: distances fall as fast as they can, so that a longer leap would miss pairs.
    #[test]
    fn no_leap_passes_over_a_close_pair() {
        let robot = Robot::new(&RobotConfig { links: LINKS, ..RobotConfig::default() }).expect("a robot");
        let (length, reach) = (robot.links[0].length, robot.links[0].reach());
        for turn in 12..30 {
            for part in [0.05, 0.35, 0.65, 0.95] {
                let place = |link: usize| {
                    let ahead = if link <= turn { link as f64 } else { 2.0 * turn as f64 + part - link as f64 };
                    Vector2::new(ahead * length, 0.0)
                };
                let mut pairs = ClosePairs::<f64>::new(&robot.links);
                pairs.find((0..LINKS).map(place), 0.01, true);
                let is_close = |i: usize, j: usize| (place(i) - place(j)).norm() < 2.0 * reach + 0.01;
                let all = (0..LINKS).flat_map(|i| (i + 2..LINKS).map(move |j| [i, j]));
                let expected: Vec<[usize; 2]> = all.filter(|&[i, j]| is_close(i, j)).collect();
                assert_eq!(pairs.of_lane(0).collect::<Vec<_>>(), expected, "back after {turn} links and {part}");
            }
        }
    }

    /// A straight robot and coiled ones side by side: neither hides or adds a pair of another, and lanes that are not asked
    /// for have none.
    #[test]
    fn close_pairs_of_a_lane_are_its_own() {
        if !Wide4::is_available() {
            return;
        }
        let robot = Robot::new(&RobotConfig { links: LINKS, ..RobotConfig::default() }).expect("a robot");
        let mut lanes = [Vector2::new(Wide4::zero(), Wide4::zero()); LINKS];
        let mut alone = Vec::new();
        for (lane, bend) in [0.0, 0.5, 0.3, 0.16].into_iter().enumerate() {
            let centres = arc(robot.links[0].length, bend);
            for (many, centre) in lanes.iter_mut().zip(&centres) {
                many.x.set_lane(lane, centre.x);
                many.y.set_lane(lane, centre.y);
            }
            let mut one = ClosePairs::new(&robot.links);
            one.find(centres.into_iter(), 0.01, true);
            alone.push(one.of_lane(0).collect::<Vec<_>>());
        }
        assert!(alone[0].is_empty() && alone[1].len() > LINKS, "a straight robot and a coil");
        alone[2].clear();
        let mut together = ClosePairs::<Wide4>::new(&robot.links);
        together.find(lanes.iter().copied(), Wide4::splat(0.01), Mask::of(|lane| lane != 2));
        for (lane, expected) in alone.iter().enumerate() {
            assert_eq!(&together.of_lane(lane).collect::<Vec<_>>(), expected, "lane {lane}");
        }
    }
}
