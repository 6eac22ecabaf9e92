//! The link-obstacle pairs near contact: a list that is rebuilt only after the robot has moved a certain distance.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::Real;
use crate::obstacles::{Node, ObstacleGrid};

use super::{
    ContactId, KnownContact, PlacedLink, Source, features, link_obstacle_contact, outline::features_of_outline,
};

/// A link and an obstacle near contact, and what the last stage found there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NearPair {
    pub link: usize,
    /// The obstacle, by its number in the grid.
    pub obstacle: usize,
    /// Which of the features of the wall; zero at a peg.
    pub feature: usize,
    /// The gap stays above this less what the robot has travelled since the list was made \[m\].
    clearance: f64,
    pub known: KnownContact,
}

impl NearPair {
    fn open(link: usize, (obstacle, feature): (usize, usize), clearance: f64) -> Self {
        Self { link, obstacle, feature, clearance, known: KnownContact::NEW }
    }

    pub fn id(&self) -> ContactId {
        ContactId { link: self.link, with: Source::Obstacle(self.obstacle), feature: self.feature }
    }
}

/// All pairs whose gap may be below a margin, sorted by link; rebuilt only after the robot has moved far enough.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NearObstacles {
    pairs: Vec<NearPair>,
    /// Indices of the pairs that the last visit evaluated, and up to which gap \[m\].
    #[serde(skip)]
    candidates: Vec<u32>,
    #[serde(skip)]
    visited_margin: f64,
    /// Pairs that may touch at the end of the step, with their gap there \[m\].
    #[serde(skip)]
    ends: Vec<(u32, f64)>,
    /// How far any point of the robot has moved since the list was made, and may move, with the margin added, before
    /// pairs could be missing \[m\].
    travelled: f64,
    horizon: f64,
}

impl NearObstacles {
    pub fn with_capacity(links: usize) -> Self {
        Self {
            pairs: Vec::with_capacity(PAIRS_PER_LINK * links),
            candidates: Vec::with_capacity(PAIRS_PER_LINK * links),
            visited_margin: 0.0,
            ends: Vec::with_capacity(PAIRS_PER_LINK * links),
            travelled: 0.0,
            horizon: NOTHING_LISTED,
        }
    }

    pub fn pairs(&self) -> &[NearPair] {
        &self.pairs
    }

    /// Visits the pairs whose gap may be below `margin` at poses up to `displacement` \[m\] from the present ones, with
    /// their index; the visitor returns the gap there \[m\].
    pub fn visit_within(&mut self, displacement: f64, margin: f64, mut visit: impl FnMut(usize, &NearPair) -> f64) {
        self.select_candidates(self.travelled + displacement + margin);
        self.visited_margin = margin;
        self.ends.clear();
        let Self { pairs, candidates, travelled, .. } = self;
        for &index in candidates.iter() {
            let pair = &mut pairs[index as usize];
            pair.clearance = visit(index as usize, pair) - displacement + *travelled;
        }
    }

    /// The pairs whose gap was below `bound` at the poses of the last visit, which were up to `displacement` away \[m\];
    /// `bound` is at most the margin of that visit.
    pub fn visited_below(&self, displacement: f64, bound: f64) -> impl Iterator<Item = &NearPair> {
        let visited = self.candidates.iter().map(|&index| &self.pairs[index as usize]);
        visited.filter(move |pair| pair.clearance + displacement < self.travelled + bound)
    }

    /// Selects the pairs of a clearance below `bound`, without a branch that would be mispredicted.
    fn select_candidates(&mut self, bound: f64) {
        self.candidates.resize(self.pairs.len(), 0);
        let mut count = 0;
        for (index, pair) in self.pairs.iter().enumerate() {
            self.candidates[count] = index as u32;
            count += usize::from(pair.clearance < bound);
        }
        self.candidates.truncate(count);
    }

    pub fn pairs_mut(&mut self) -> &mut [NearPair] {
        &mut self.pairs
    }

    /// Copies without freeing memory.
    pub fn copy_from(&mut self, other: &Self) {
        let Self { pairs, candidates, visited_margin, ends, travelled, horizon } = other;
        self.pairs.clone_from(pairs);
        self.candidates.clone_from(candidates);
        self.ends.clone_from(ends);
        (self.visited_margin, self.travelled, self.horizon) = (*visited_margin, *travelled, *horizon);
    }

    /// Whether all pairs are of `links` links and what they can push, these obstacles, in order.
    pub fn fits(&self, links: usize, obstacles: &ObstacleGrid) -> bool {
        let fits = |pair: &NearPair| {
            let movable = pair.link.checked_sub(links - obstacles.movables().len());
            let outline = movable.and_then(|k| obstacles.movables().get(k)?.outline.as_deref());
            let is_pair =
                pair.obstacle < obstacles.len() || stop_of(pair.link, links, obstacles) == Some(pair.obstacle);
            let features = || match outline {
                Some(outline) => features_of_outline(outline, obstacles, pair.obstacle),
                None => obstacles.features(pair.obstacle),
            };
            pair.link < links && is_pair && pair.feature < features()
        };
        self.pairs.iter().all(fits) && self.pairs.is_sorted_by_key(|pair| pair.link)
    }

    /// Clears pairs and warm starts.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.candidates.clear();
        self.ends.clear();
        (self.travelled, self.horizon) = (0.0, NOTHING_LISTED);
    }

    /// Whether the list is complete up to `margin` for poses whose points are at most `displacement` from those of the
    /// last call of [`Self::advance`].
    pub fn covers(&self, displacement: f64, margin: f64) -> bool {
        self.travelled + displacement + margin <= self.horizon
    }

    /// The largest displacement plus margin that a list without pairs covers; negative if it has pairs \[m\].
    pub fn clear_way(&self) -> f64 {
        if self.pairs.is_empty() { self.horizon - self.travelled } else { NOTHING_LISTED }
    }

    /// The robot has moved, no point of it by more than `distance` \[m\].
    pub fn advance(&mut self, distance: f64) {
        self.travelled += distance;
        self.candidates.clear();
    }

    /// The robot has moved to within `prediction_error` of the poses of the last visit, which were up to `displacement`
    /// away \[m\]. The gaps found there bound those at the new poses, so that pairs which the robot passes at some
    /// distance are rarely evaluated.
    pub fn arrive(&mut self, displacement: f64, prediction_error: f64) {
        for &index in &self.candidates {
            // From gap - displacement at the old poses to gap - prediction_error at the new ones, which are
            // displacement + prediction_error away.
            self.pairs[index as usize].clearance += 2.0 * displacement;
        }
        self.advance(displacement + prediction_error);
    }

    /// Measures the gaps of the pairs that may touch at the end of the step, which is within `prediction_error` of the
    /// poses of the last visit; these were up to `displacement` away \[m\].
    pub fn measure_ends(&mut self, displacement: f64, prediction_error: f64, gap: impl Fn(&NearPair) -> f64) {
        let Self { pairs, candidates, ends, travelled, visited_margin, .. } = self;
        ends.clear();
        let mut add = |index: u32| ends.push((index, gap(&pairs[index as usize])));
        for &index in candidates.iter() {
            if pairs[index as usize].clearance + displacement < *travelled + prediction_error {
                add(index);
            }
        }
        if prediction_error > *visited_margin {
            let [visited, reached] = [*visited_margin, prediction_error].map(|bound| *travelled + displacement + bound);
            let passed_over = (0..).zip(pairs.iter()).filter(|(_, p)| p.clearance >= visited && p.clearance < reached);
            passed_over.for_each(|(index, _)| add(index));
        }
    }

    /// The pairs that [`Self::measure_ends`] found, with their gaps at the end of the step \[m\].
    pub fn ends(&self) -> impl Iterator<Item = (&NearPair, f64)> {
        self.ends.iter().map(|&(index, gap)| (&self.pairs[index as usize], gap))
    }

    /// Ends a step: records which contacts carry force, and what penetration is left.
    pub fn end_step(&mut self) {
        for pair in &mut self.pairs {
            pair.known.depth = 0.0;
            pair.known.touches = pair.known.force > 0.0;
        }
        for (index, gap) in self.ends.drain(..) {
            self.pairs[index as usize].known.depth = (-gap).max(0.0);
        }
        self.visited_margin = 0.0;
    }

    /// Lists all pairs with a gap below `margin` at poses no point of which is more than [`SKIN`] from `poses`; these
    /// are up to `displacement` \[m\] from the present ones. What the previous list holds of a pair is kept; `previous` is
    /// a workspace. A list without pairs is valid up to the nearest peg.
    pub fn rebuild<'a>(
        &mut self,
        poses: impl Iterator<Item = Vector3<f64>> + Clone,
        links: impl IntoIterator<Item = impl Into<Node<'a>>> + Clone,
        obstacles: &ObstacleGrid,
        margin: f64,
        displacement: f64,
        previous: &mut Vec<NearPair>,
    ) {
        std::mem::swap(&mut self.pairs, previous);
        self.clear();
        let nodes = links.clone().into_iter().count();
        for (i, (pose, link)) in poses.clone().zip(links.clone()).enumerate() {
            let link: Node = link.into();
            let (sin, cos) = Real::sin_cos(pose.z);
            let placed = PlacedLink { link, pose, axis: Vector2::new(cos, sin) };
            obstacles.near(pose.x, pose.y, link.reach() + margin + SKIN).for_each(|peg| {
                let gap = link_obstacle_contact(&placed, obstacles, (peg, 0)).gap;
                if gap < margin + SKIN {
                    self.pairs.push(NearPair::open(i, (peg, 0), gap - displacement));
                }
            });
            for wall in obstacles.walls().near(pose.xy(), link.reach() + margin + SKIN) {
                let obstacle = obstacles.pegs().len() + wall;
                for feature in 0..features(&link, obstacles, obstacle) {
                    let at = (obstacle, feature);
                    let gap = link_obstacle_contact(&placed, obstacles, at).gap;
                    if gap < margin + SKIN {
                        self.pairs.push(NearPair::open(i, at, gap - displacement));
                    }
                }
            }
            if let Some(stop) = stop_of(i, nodes, obstacles) {
                let gap = link_obstacle_contact(&placed, obstacles, (stop, 0)).gap;
                // Where the list has pairs, it is not valid up to the nearest peg.
                self.pairs.push(NearPair::open(i, (stop, 0), gap - displacement));
            }
        }
        let listed = if self.pairs.is_empty() { clear_way(poses, links, obstacles) } else { 0.0 };
        self.horizon = listed.max(margin + SKIN) - displacement;
        self.keep_known(previous);
    }

    /// Keeps what the previous list holds of the pairs.
    fn keep_known(&mut self, mut known: &[NearPair]) {
        for pair in &mut self.pairs {
            known = &known[known.iter().take_while(|old| old.link < pair.link).count()..];
            let mut of_link = known.iter().take_while(|old| old.link == pair.link);
            if let Some(old) = of_link.find(|old| (old.obstacle, old.feature) == (pair.obstacle, pair.feature)) {
                *pair = NearPair { clearance: pair.clearance, ..*old };
            }
        }
    }
}

/// The number of the stop of a disc, which is among `nodes` links and discs; none of a link or without a stop.
fn stop_of(node: usize, nodes: usize, obstacles: &ObstacleGrid) -> Option<usize> {
    let disc = node.checked_sub(nodes - obstacles.movables().len())?;
    obstacles.movables().get(disc)?.travel().is_finite().then_some(obstacles.len() + disc)
}

/// A distance that every point of a robot may move without touching an obstacle, not necessarily the largest; zero unless all
/// obstacles lie outside a circle around the robot \[m\].
pub fn clear_way<'a>(
    poses: impl Iterator<Item = Vector3<f64>> + Clone,
    links: impl IntoIterator<Item = impl Into<Node<'a>>> + Clone,
    obstacles: &ObstacleGrid,
) -> f64 {
    let Some(middle) = poses.clone().nth(links.clone().into_iter().count() / 2) else { return 0.0 };
    let farthest = |(pose, link): (Vector3<f64>, Node)| (pose.xy() - middle.xy()).norm() + link.reach();
    let nodes = links.into_iter().map(Into::into);
    obstacles.clear_way(&middle.xy(), poses.zip(nodes).map(farthest).fold(0.0, f64::max))
}

/// A horizon that covers no pose.
const NOTHING_LISTED: f64 = -1.0;

/// How far a point of the robot may move before the list is rebuilt \[m\].
const SKIN: f64 = 0.15;

/// Pairs reserved for each link; a denser field grows the list once.
pub const PAIRS_PER_LINK: usize = 8;
