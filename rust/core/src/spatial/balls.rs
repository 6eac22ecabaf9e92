//! Contacts of balls: they roll on what is below them, and touch all else as links without a length do.

use nalgebra::{Vector2, Vector3};

use crate::contact::{ContactId, ContactMemory, Source, capsule_contact};
use crate::math::Real;
use crate::obstacles::{Ball, Movable, Nodes, ObstacleGrid};
use crate::robot::Link;
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::nodes::{NodesInStage, Places};
use super::obstacle_contacts::{LinkInStage, MARGIN, ObstacleContacts, Plane};
use super::penetration::sinking_into;
use super::self_contact::{PairInStage, capsule};
use super::{LinkAxis, StageContact, StageObstacleFriction, StagePair, obstacle_gap};

/// Whether two nodes meet in space: a ball, and a link or another ball. All else is upright, and meets them as seen from above.
pub(super) fn is_round(nodes: Nodes, pair: [usize; 2]) -> bool {
    let is_ball = pair.map(|node| node >= nodes.links.len() && nodes.movable(node).ball.is_some());
    (is_ball[0] || is_ball[1]) && [0, 1].into_iter().all(|k| is_ball[k] || pair[k] < nodes.links.len())
}

/// The gap of such a pair \[m\].
pub(super) fn round_gap(nodes: Nodes, pair: [usize; 2], places: &impl Places) -> f64 {
    let links = nodes.links.len();
    let [first, second] = pair.map(|node| (nodes.get(node).link, places.line(links, node)));
    let ends = [&capsule(first.0, &first.1), &capsule(second.0, &second.1)];
    capsule_contact(ends, CENTRE).map_or(f64::INFINITY, |contact| contact.gap)
}

/// Smallest gap of a ball with its centre there to what is fixed \[m\].
pub(crate) fn ball_gap(movable: &Movable, centre: &Vector3<f64>, obstacles: &ObstacleGrid) -> f64 {
    let (link, at) = (&movable.link, LinkAxis::at(centre));
    let mut smallest = centre.z - link.radius - floor(centre, obstacles);
    obstacles.visit_obstacles(&centre.xy(), link.radius, |obstacle| {
        smallest = smallest.min(obstacle_gap(link, &at, obstacles, obstacle));
    });
    smallest
}

/// What a step does to the penetration of a ball of a lane's robot into what is fixed.
pub(super) fn sinking_of_ball(link: &Link, obstacles: &ObstacleGrid, centres: [Vector3<f64>; 2]) -> Sinking {
    let [start, end] = centres.map(|centre| centre.z - link.radius - floor(&centre, obstacles));
    let into_floor = if end < -ALLOWED { Sinking::of(start, end) } else { Sinking::No };
    let (at, mut sinking) = (centres.map(|centre| LinkAxis::at(&centre)), into_floor);
    obstacles.visit_obstacles(&centres[1].xy(), link.reach() + (centres[1] - centres[0]).norm(), |obstacle| {
        sinking = sinking.max(sinking_into(obstacles, obstacle, link, &at));
    });
    sinking
}

impl<T: Real> NodesInStage<'_, T> {
    /// The row of a pair that meets in space.
    pub fn round_row(&self, pair: [usize; 2]) -> Option<StagePair> {
        let (at, coefficient) = (pair.map(|node| self.kinematics(node)), self.coefficient);
        let (direction, offset) = PairInStage { at, coefficient, elapsed: self.elapsed }.row(CENTRE)?;
        Some(StagePair { links: pair, direction, offset })
    }

    /// Finds the contacts of a ball with what is fixed, and tells whether something carries it.
    pub fn find_ball_contacts(
        &self,
        (lane, node, &Ball { sliding_friction, .. }): (usize, usize, &Ball),
        obstacles: &ObstacleGrid,
        (contacts, known): (&mut ObstacleContacts<T>, &ContactMemory),
    ) -> bool {
        let ball = LinkInStage { at: self.kinematics(node), coefficient: self.coefficient, elapsed: self.elapsed };
        let (number, radius) = (self.nodes.number(node), ball.at.link.radius);
        let before = contacts.rows.all().len();
        let way = (ball.at.end.position - ball.at.start.position).norm();
        obstacles.visit_obstacles(&ball.at.end.position.xy(), radius + way + MARGIN, |obstacle| {
            let of_ground = Vector2::repeat(sliding_friction);
            contacts.find((lane, [node, number], &ball), (obstacles, obstacle), (known, &of_ground));
        });
        if let Some((row, surface)) = self.floor_row(node, &ball, obstacles) {
            let id = ContactId { link: number, with: Source::Fixture(0), feature: 0 };
            let friction = StageObstacleFriction::new(&row.direction.linear, &surface, sliding_friction);
            contacts.add(lane, id, known.of(id), row, (sliding_friction > 0.0).then_some(friction));
        }
        let mut rows = contacts.rows.all()[before..].iter().map(|found| &found.row);
        rows.any(|row| row.direction.linear.z > BELOW && row.offset * self.coefficient < CARRIED)
    }

    /// The ground, or a top face, below a ball.
    fn floor_row(
        &self,
        node: usize,
        ball: &LinkInStage,
        obstacles: &ObstacleGrid,
    ) -> Option<(StageContact, Vector3<f64>)> {
        let (radius, [start, end]) = (ball.at.link.radius, [&ball.at.start, &ball.at.end].map(|at| at.position));
        let heights = [start, end].map(|centre| floor(&centre, obstacles));
        let plane = |centre: Vector3<f64>, is_redundant: bool| Plane {
            normal: Vector3::z(),
            arm: Vector3::zeros(),
            gap: centre.z - radius - heights[1],
            is_redundant,
        };
        ball.row(node, [plane(start, heights[0] != heights[1]), plane(end, false)], radius, MARGIN)
    }
}

/// Height of the ground, or of the top face, below a ball; infinitely low over faces that carry it otherwise \[m\].
pub(super) fn floor(centre: &Vector3<f64>, obstacles: &ObstacleGrid) -> f64 {
    obstacles.support(centre).map_or(0.0, |(_, height)| height)
}

/// The contact of a pair in which the second is a ball: its centre, as an end of a line without a length.
const CENTRE: usize = 2;

/// Vertical part of the normal of what may carry a ball.
const BELOW: f64 = 0.5;

/// Gap up to which it does \[m\].
const CARRIED: f64 = 1e-4;
