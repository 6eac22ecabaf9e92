//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{
    LinkContact, NearObstacles, NearPair, PAIRS_PER_LINK, PlacedLink, link_obstacle_contact, link_peg_contact,
    touching_distance,
};
use crate::math::Real;
use crate::obstacles::{ObstacleGrid, Peg};
use crate::planar::{Heading, StageContact};
use crate::stepping::{FoundFriction, FoundRows};

use super::link_pairs::place_numbered;
use super::workspace::{Motion, StageKinematics};

/// The contacts of the current stage, of all lanes.
pub struct Contacts<T> {
    pub rows: FoundRows<StageContact, T>,
    pub friction: FoundFriction<StageContact>,
    /// Pairs of one robot within the margin, and how they are at the predicted end.
    close: Vec<(usize, LinkContact)>,
    /// Near pairs of a robot before its list was made anew.
    pub previous: Vec<NearPair>,
}

impl<T: Real> Contacts<T> {
    pub fn with_capacity(links: usize) -> Self {
        let pairs = PAIRS_PER_LINK * links;
        Self {
            rows: FoundRows::with_capacity(links, pairs * T::LANES),
            friction: FoundFriction::with_capacity(pairs * T::LANES),
            close: Vec::with_capacity(pairs),
            previous: Vec::with_capacity(pairs),
        }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.friction.clear();
    }

    /// Finds the contacts of a robot: its near pairs whose predicted gap is below the margin.
    pub fn find(&mut self, near: &mut NearObstacles, robot: &StageKinematics<T>, obstacles: &ObstacleGrid) {
        self.collect_close(near, robot, obstacles);
        for (index, at_end) in &self.close {
            let pair = &near.pairs()[*index];
            let Some(link) = robot.nodes.place_of(pair.link) else { continue };
            let (plane, offset) = robot.plane(link, pair, at_end, obstacles);
            let coefficient = obstacles.friction(pair.obstacle);
            if coefficient > 0.0 && !plane.is_redundant {
                let along = StageContact { link, direction: plane.tangent(), offset: 0.0 };
                self.friction.add(self.rows.all().len(), along, coefficient);
            }
            let row = StageContact { link, direction: plane.direction, offset };
            self.rows.add(robot.lane, pair.id(), *index, pair.known, row);
        }
        // A pair that takes no part has no force, unless what sleeps leans there.
        let chain = robot.nodes.links.len();
        let takes_part = |link: usize| link < chain || robot.nodes.place_of(link).is_some();
        for pair in near.pairs_mut().iter_mut().filter(|pair| takes_part(pair.link)) {
            (pair.known.force, pair.known.friction) = (0.0, Vector3::zeros());
        }
    }

    /// Collects the pairs within the margin, without a branch that would be mispredicted.
    fn collect_close(&mut self, near: &mut NearObstacles, robot: &StageKinematics<T>, obstacles: &ObstacleGrid) {
        let margin = robot.margin(1.0);
        let (close, mut count) = (&mut self.close, 0);
        near.visit_within(robot.bound.displacement, margin, |index, pair| {
            close.truncate(count);
            // Each kept by itself, so that the contact with a peg, as most are, does not go by way of memory.
            let Some((link, peg)) = robot.peg(pair, obstacles) else {
                let at_end = robot.other_contact(pair, obstacles);
                close.push((index, at_end));
                // A wall that the link has crossed is looked at from the start of the step.
                let is_covered = at_end.is_redundant && at_end.gap > -robot.nodes.all().get(pair.link).radius;
                count += usize::from(at_end.gap < margin && !is_covered);
                return at_end.gap;
            };
            let at_end = link_peg_contact(&link, peg);
            close.push((index, at_end));
            count += usize::from(at_end.gap < margin);
            at_end.gap
        });
        close.truncate(count);
    }
}

impl<T: Real> StageKinematics<'_, T> {
    /// A pair at the predicted end that is of a link of the robot and a peg.
    #[inline(always)]
    fn peg<'a>(&'a self, pair: &NearPair, obstacles: &'a ObstacleGrid) -> Option<(PlacedLink<'a>, &'a Peg)> {
        let peg = obstacles.pegs().get(pair.obstacle).filter(|_| pair.link < self.nodes.links.len())?;
        Some((self.placed(pair.link), peg))
    }

    /// Any pair at the predicted end.
    #[inline(never)]
    fn other_contact(&self, pair: &NearPair, obstacles: &ObstacleGrid) -> LinkContact {
        let Motion { predicted, heading, .. } = self.motion;
        let lies = place_numbered((self.nodes, self.lying), pair.link, self.lane, predicted, heading);
        link_obstacle_contact(&lies, obstacles, (pair.obstacle, pair.feature))
    }

    /// Direction and offset of a pair, given how it is at the predicted end.
    ///
    /// The end-of-stage gap (T 3.47 != D5) is linearised at the predicted end configuration,
    /// `g(q_E) = g(q_pred) + c w . (u - u_travel)`, where u_travel is the mean velocity on the way there, so that a
    /// sustained contact is exact to second order. The velocity at its start would not do: while the links of a long chain
    /// turn, what it misses adds up from joint to joint.
    /// Where the prediction runs deep into a peg, or past it, the side is uncertain, and the gap is linearised
    /// at the start of the step (T 3.47 != D9). Either plane touches the distance function of a convex body
    /// from below (for a link that translates), so `g + c w . u >= 0` keeps the true gap non-negative however
    /// long the step.
    fn plane(&self, i: usize, pair: &NearPair, at_end: &LinkContact, obstacles: &ObstacleGrid) -> (LinkContact, f64) {
        let c = self.coefficient;
        let link = self.nodes.get(i);
        let touching = touching_distance(&link, obstacles, pair.obstacle);
        let mut plane = *at_end;
        let mut travelled = c * at_end.direction.dot(&self.travel(i));
        if at_end.gap < -DEEP * touching || self.bound.displacement > touching {
            let start = self.start(i);
            let placed = PlacedLink { link, pose: start, axis: Heading::of(start.z).axial() };
            let at_start = link_obstacle_contact(&placed, obstacles, (pair.obstacle, pair.feature));
            let same_side = at_start.direction.xy().dot(&at_end.direction.xy()) > SAME_SIDE;
            if at_end.is_redundant && at_start.is_redundant {
                return (NO_CONTACT, 1.0);
            }
            if (at_end.gap < -DEEP * touching || !same_side) && !at_start.is_redundant {
                plane = at_start;
                travelled = -at_start.direction.dot(&(self.base(i) - start));
            }
        }
        (plane, offset(plane.gap, travelled, pair.known.depth, c, self.elapsed))
    }
}

/// A contact that never closes: an impulse there has no direction.
const NO_CONTACT: LinkContact =
    LinkContact { gap: f64::INFINITY, direction: Vector3::new(0.0, 0.0, 0.0), lever: 0.0, is_redundant: true };
