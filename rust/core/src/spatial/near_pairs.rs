//! The obstacles near the links of a robot: a list that is made anew only after the robot has moved a certain distance.

use nalgebra::Vector2;

use crate::obstacles::ObstacleGrid;

/// Pairs of a link and an obstacle, in order. What is found among them does not depend on when the list was made.
#[derive(Debug, Clone, PartialEq)]
pub struct NearPairs {
    pairs: Vec<(usize, usize)>,
    /// How far links may still be from where they are now before pairs could be missing \[m\].
    left: f64,
}

impl NearPairs {
    pub fn new(links: usize) -> Self {
        Self { pairs: Vec::with_capacity(PAIRS_PER_LINK * links), left: NOTHING_LISTED }
    }

    /// Forgets all pairs.
    pub fn clear(&mut self) {
        self.left = NOTHING_LISTED;
    }

    /// No link has moved by more than `way` \[m\].
    pub fn advance(&mut self, way: f64) {
        self.left -= way;
    }

    /// Makes the list anew unless it is complete for what lies within `distance` of links that are up to `distance` from where
    /// they are now. `links` are these places, and the reach of each link \[m\].
    pub fn cover(&mut self, distance: f64, links: impl Iterator<Item = (Vector2<f64>, f64)>, obstacles: &ObstacleGrid) {
        // A list for a prediction that ran far away is too long for those after it.
        if (2.0 * distance..=SKIN.max(8.0 * distance)).contains(&self.left) {
            return;
        }
        self.pairs.clear();
        self.left = SKIN.max(2.0 * distance);
        for (link, (place, reach)) in links.enumerate() {
            let first = self.pairs.len();
            obstacles.visit_obstacles(&place, reach + self.left, |obstacle| self.pairs.push((link, obstacle)));
            self.pairs[first..].sort_unstable();
        }
    }

    /// The listed obstacles of each link that has any.
    pub fn by_link(&self) -> impl Iterator<Item = (usize, impl Iterator<Item = usize>)> {
        self.pairs.chunk_by(|a, b| a.0 == b.0).map(|of_link| (of_link[0].0, of_link.iter().map(|pair| pair.1)))
    }
}

/// A distance that covers no place.
const NOTHING_LISTED: f64 = -1.0;

/// How far obstacles are listed, beyond what is asked for only where that is farther \[m\].
const SKIN: f64 = 0.1;

/// Pairs reserved for each link.
const PAIRS_PER_LINK: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::rng::Rng;
    use crate::obstacles::{Obstacle, Peg, Shape};

    /// A robot that wanders among obstacles of all kinds, in ways of any length, finds among the listed pairs what a search
    /// of the whole scene finds.
    #[test]
    fn what_is_near_does_not_depend_on_the_list() {
        let mut rng = Rng::new(3, 0);
        let mut anywhere = |extent: f64| rng.uniform(-extent, extent);
        let mut obstacles = Vec::<Obstacle>::new();
        for _ in 0..60 {
            obstacles.push(Peg { radius: 0.05, x: anywhere(2.0), y: anywhere(2.0) }.into());
            let [start, end] = [[anywhere(2.0), anywhere(2.0)], [anywhere(2.0), anywhere(2.0)]];
            obstacles.push(Obstacle::endless(Shape::Segment { start, end }));
            let [start, end] = [[anywhere(2.0), anywhere(2.0), 0.1], [anywhere(2.0), anywhere(2.0), 0.3]];
            obstacles.push(Obstacle::endless(Shape::Cylinder { start, end, radius: 0.1, inside: false }));
        }
        let grid = ObstacleGrid::of(&obstacles);
        let (mut links, mut near, mut ahead) = ([(Vector2::zeros(), 0.1); 5], NearPairs::new(5), Vector2::zeros());
        let mut found = 0;
        for k in 0..4000 {
            if k % 100 == 0 {
                near.clear();
                links.iter_mut().for_each(|(place, _)| *place = Vector2::new(anywhere(1.5), anywhere(1.5)));
                ahead = Vector2::new(anywhere(1.0), anywhere(1.0)).normalize();
            }
            let way = if k % 100 == 60 { 0.5 } else { 0.01 };
            let moves = links.map(|_| ahead * way);
            near.cover(way, links.iter().copied(), &grid);
            let mut listed = vec![Vec::new(); 5];
            for (link, obstacles) in near.by_link() {
                let (place, reach) = links[link];
                listed[link].extend(obstacles.filter(|&o| grid.is_within(o, &(place + moves[link]), reach + way)));
            }
            for (link, listed) in listed.iter().enumerate() {
                let mut all = Vec::new();
                grid.visit_obstacles(&(links[link].0 + moves[link]), links[link].1 + way, |obstacle| {
                    all.push(obstacle)
                });
                all.sort_unstable();
                assert_eq!(*listed, all, "link {link} after {k} ways");
                found += all.len();
            }
            for ((place, _), step) in links.iter_mut().zip(moves) {
                *place += step;
            }
            near.advance(way);
        }
        assert!(found > 1000, "{found}");
    }
}
