//! The contacts of a stage: which pairs take part, and how the gap enters.

use nalgebra::Vector3;

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{LinkContact, NearObstacles, NearPair, PAIRS_PER_LINK, link_obstacle_contact, touching_distance};
use crate::math::{Laned, Real};
use crate::obstacles::ObstacleGrid;
use crate::planar::{Heading, StageContact, StageObstacleFriction};
use crate::rows::Screw;
use crate::stepping::FoundRows;

use super::workspace::StageKinematics;

/// The contacts of the current stage, of all lanes.
#[derive(Debug, Clone)]
pub struct Contacts {
    pub rows: FoundRows<StageContact>,
    /// Those of them that have friction, in their order.
    frictional: Vec<FrictionalContact>,
    /// Pairs of one robot within the margin, and how they are at the predicted end.
    close: Vec<(usize, LinkContact)>,
}

/// Friction of one contact of one robot.
#[derive(Debug, Clone, Copy)]
pub struct FrictionalContact {
    /// Index of the contact among those found.
    pub found: usize,
    /// Its index in [`crate::planar::Stage::obstacle_friction`], once laid out.
    pub row: usize,
    pub direction: Vector3<f64>,
    coefficient: f64,
}

impl Contacts {
    pub fn with_capacity(links: usize, lanes: usize) -> Self {
        let pairs = PAIRS_PER_LINK * links;
        Self {
            rows: FoundRows::with_capacity(links, pairs * lanes),
            frictional: Vec::with_capacity(pairs * lanes),
            close: Vec::with_capacity(pairs),
        }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.frictional.clear();
    }

    /// Finds the contacts of a robot: its near pairs whose predicted gap is below the margin.
    pub fn find<T: Real>(&mut self, near: &mut NearObstacles, robot: &StageKinematics<T>, obstacles: &ObstacleGrid) {
        self.collect_close(near, robot, obstacles);
        for (index, at_end) in &self.close {
            let pair = &near.pairs()[*index];
            let link = pair.link;
            let (plane, offset) = robot.plane(pair, at_end, obstacles);
            let coefficient = obstacles.friction(pair.obstacle);
            if coefficient > 0.0 && !plane.is_redundant {
                let (found, direction) = (self.rows.all().len(), plane.tangent());
                self.frictional.push(FrictionalContact { found, row: 0, direction, coefficient });
            }
            let row = StageContact { link, direction: plane.direction, offset };
            self.rows.add(robot.lane, pair.id(), *index, pair.known, row);
        }
        // A pair that takes no part has no force.
        for pair in near.pairs_mut() {
            (pair.known.force, pair.known.friction) = (0.0, Vector3::zeros());
        }
    }

    /// Collects the pairs within the margin, without a branch that would be mispredicted.
    fn collect_close<T: Real>(
        &mut self,
        near: &mut NearObstacles,
        robot: &StageKinematics<T>,
        obstacles: &ObstacleGrid,
    ) {
        let margin = robot.margin(1.0);
        let (close, mut count) = (&mut self.close, 0);
        near.visit_within(robot.bound.displacement, margin, |index, pair| {
            let at_end = robot.contact(pair, obstacles);
            close.truncate(count);
            close.push((index, at_end));
            // A wall that the link has crossed is looked at from the start of the step.
            let is_covered = at_end.is_redundant && at_end.gap > -robot.nodes.get(pair.link).radius;
            count += usize::from(at_end.gap < margin && !is_covered);
            at_end.gap
        });
        close.truncate(count);
    }

    /// Contacts with friction, of all lanes.
    pub fn frictional(&self) -> &[FrictionalContact] {
        &self.frictional
    }

    /// Gives the friction of every contact its row, in the order of the contacts that have been laid out; `impulses` are
    /// those of the last forces over a stage of coefficient `c`.
    pub fn lay_out_friction<T: Real>(&mut self, c: T, rows: &mut Vec<StageObstacleFriction<T>>, impulses: &mut Vec<T>) {
        rows.clear();
        impulses.clear();
        let (found, zero) = (self.rows.all(), T::zero());
        self.frictional.sort_unstable_by_key(|frictional| (found[frictional.found].slot, found[frictional.found].lane));
        for frictional in &mut self.frictional {
            let of = &found[frictional.found];
            if rows.last().is_none_or(|last| last.contact != of.slot) {
                let (contact, link, direction) = (of.slot, of.row.link, Screw::zero());
                rows.push(StageObstacleFriction { contact, link, direction, coefficient: zero, bound: zero });
                impulses.push(zero);
            }
            frictional.row = rows.len() - 1;
            let row = &mut rows[frictional.row];
            row.direction.set_lane(of.lane, &frictional.direction);
            Real::set_lane(&mut row.coefficient, of.lane, frictional.coefficient);
            let force = frictional.direction.xy().dot(&of.known.friction.xy());
            Real::set_lane(&mut impulses[frictional.row], of.lane, force * Real::lane(&c, of.lane));
        }
    }
}

impl<T: Real> StageKinematics<'_, T> {
    /// A pair at the predicted end.
    fn contact(&self, pair: &NearPair, obstacles: &ObstacleGrid) -> LinkContact {
        let Heading { cos, sin } = self.heading(pair.link);
        let end = self.end(pair.link);
        link_obstacle_contact(&end, cos, sin, self.nodes.get(pair.link), obstacles, (pair.obstacle, pair.feature))
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
    fn plane(&self, pair: &NearPair, at_end: &LinkContact, obstacles: &ObstacleGrid) -> (LinkContact, f64) {
        let (i, c) = (pair.link, self.coefficient);
        let link = self.nodes.get(i);
        let touching = touching_distance(&link, obstacles, pair.obstacle);
        let mut plane = *at_end;
        let mut travelled = c * at_end.direction.dot(&self.travel(i));
        if at_end.gap < -DEEP * touching || self.bound.displacement > touching {
            let start = self.start(i);
            let heading = Heading::of(start.z);
            let at_start =
                link_obstacle_contact(&start, heading.cos, heading.sin, link, obstacles, (pair.obstacle, pair.feature));
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
