//! Contacts of obstacles that can be pushed with links, with fixed obstacles and with each other.
//!
//! But for [balls](super::balls) they are upright and without end, like fixed obstacles without a height. What they touch is
//! decided from above, by the gap functions of the plane: a link is seen as its shadow, a stadium of the same radius.

use nalgebra::{Vector2, Vector3};

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{
    ContactId, LinkPairContact, PlacedLink, Source, features, link_obstacle_contact, link_obstacle_gap,
    link_pair_contact, link_pair_gap, movable_contacts, touching_distance, visit_movable_pairs,
};
use crate::math::{Laned, Real};
use crate::obstacles::{Node, Nodes, ObstacleGrid};
use crate::robot::Link;
use crate::stepping::penetration::{ALLOWED, Sinking};

use super::balls::{is_round, round_gap, sinking_of_ball};
use super::nodes::{InLane, NodesInStage, Places};
use super::obstacle_contacts::MARGIN;
use super::workspace::{Motion, Workspace};
use super::{
    LinkAxis, SpatialBody, SpatialSystem, Stage, StageContact, StageObstacleFriction, StagePair, Twist, Wrench,
};

/// A link, or something that can be pushed, as it is seen from above.
pub(super) struct Seen<'a> {
    /// Of a link, with the lengths of its shadow.
    shadow: Option<(Link, LinkAxis)>,
    node: Node<'a>,
    pose: Vector3<f64>,
    axis: Vector2<f64>,
    /// Length of a shadow over that of its link.
    scale: f64,
}

impl<'a> Seen<'a> {
    pub fn of(nodes: Nodes<'a>, node: usize, places: &impl Places) -> Self {
        let (links, of) = (nodes.links.len(), nodes.get(node));
        if node >= links {
            let PlacedLink { link, pose, axis } = PlacedLink::new(of, places.moved(node - links));
            return Self { shadow: None, node: link, pose, axis, scale: 1.0 };
        }
        let at = places.link(node);
        let scale = at.axis.xy().norm();
        let axis = if scale > UPRIGHT { at.axis.xy() / scale } else { Vector2::x() };
        let (contact_half_length, cg_offset) = (of.contact_half_length * scale, of.cg_offset * scale);
        let shadow = Link { contact_half_length, cg_offset, ..*of.link };
        Self { shadow: Some((shadow, at)), node: of, pose: at.position.xy().push(0.0), axis, scale }
    }

    pub fn placed(&self) -> PlacedLink<'_> {
        let link = self.shadow.as_ref().map_or(self.node, |(shadow, _)| shadow.into());
        PlacedLink { link, pose: self.pose, axis: self.axis }
    }

    /// From the CG of a link to the point of its centre line at this coordinate of its shadow.
    fn arm(&self, at: &LinkAxis, along: f64) -> Vector3<f64> {
        at.axis * if self.scale > UPRIGHT { along / self.scale } else { self.node.cg_offset }
    }

    /// A unit impulse `normal` on it, which in the plane has the given direction.
    fn wrench(&self, normal: &Vector2<f64>, along: f64, direction: &Vector3<f64>) -> Wrench {
        let Some((_, at)) = &self.shadow else { return Wrench::upright(direction) };
        let linear = normal.push(0.0);
        Wrench { linear, angular: self.arm(at, along).cross(&linear) }
    }

    /// How far a point of it has moved to where it is `there`, as a twist that has the power of that on the same impulse.
    fn moved_to(&self, there: &Self, along: f64) -> Twist {
        match (&self.shadow, &there.shadow) {
            (Some((_, from)), Some((_, to))) => {
                let point = |at: &LinkAxis| at.position + self.arm(at, along);
                Twist { linear: point(to) - point(from), ..Twist::zero() }
            }
            _ => Twist::upright(&(there.pose - self.pose)),
        }
    }
}

/// The contact of two nodes at a feature, with the impulses on both in 3D.
struct SeenPair<'a>([Seen<'a>; 2]);

impl<'a> SeenPair<'a> {
    fn of(nodes: Nodes<'a>, pair: [usize; 2], places: &impl Places) -> Self {
        Self(pair.map(|node| Seen::of(nodes, node, places)))
    }

    fn with_placed<R>(&self, of: impl FnOnce([&PlacedLink; 2]) -> R) -> R {
        let [first, second] = &self.0;
        of([&first.placed(), &second.placed()])
    }

    fn wrenches(&self, LinkPairContact { normal, along, direction, .. }: &LinkPairContact) -> [Wrench; 2] {
        let into = [*normal, -normal];
        [0, 1].map(|k| self.0[k].wrench(&into[k], along[k], &direction[k]))
    }
}

impl<T: Real> NodesInStage<'_, T> {
    /// The row of two nodes; see [`super::obstacle_contacts`] for where gaps are linearised.
    fn pair_row(&self, pair: [usize; 2], feature: usize, end: &SeenPair, at_end: &LinkPairContact) -> StagePair {
        let start = SeenPair::of(self.nodes, pair, &self.start);
        let at_start = start.with_placed(|links| link_pair_contact(links, feature));
        let touching = pair.map(|node| self.nodes.get(node).radius).iter().sum::<f64>();
        let displacement = [0, 1].map(|k| (end.0[k].pose - start.0[k].pose).xy().norm()).iter().sum::<f64>();
        let is_deep = at_end.gap < -DEEP * touching;
        let passes = displacement > touching && at_start.normal.dot(&at_end.normal) < SAME_SIDE;
        let (direction, gap, travelled) = if (is_deep || passes) && at_start.gap < f64::INFINITY {
            let direction = start.wrenches(&at_start);
            let base = SeenPair::of(self.nodes, pair, &self.base);
            let moved = [0, 1].map(|k| direction[k].dot(&start.0[k].moved_to(&base.0[k], at_start.along[k])));
            (direction, at_start.gap, -(moved[0] + moved[1]))
        } else {
            let direction = end.wrenches(at_end);
            let closing = [0, 1].map(|k| direction[k].dot(&self.expected(pair[k])));
            (direction, at_end.gap, self.coefficient * (closing[0] + closing[1]))
        };
        let depth = (-at_start.gap).max(0.0);
        StagePair { links: pair, direction, offset: offset(gap, travelled, depth, self.coefficient, self.elapsed) }
    }

    /// The row of something that can be pushed and a fixed obstacle or its stop, and friction there, if they may touch.
    fn obstacle_row(
        &self,
        node: usize,
        obstacles: &ObstacleGrid,
        at: (usize, usize),
    ) -> Option<(StageContact, Option<StageObstacleFriction>)> {
        let of = self.nodes.get(node);
        let pose = |places: &InLane<T>| places.moved(node - self.nodes.links.len());
        let contact = |places: &InLane<T>| link_obstacle_contact(&PlacedLink::new(of, pose(places)), obstacles, at);
        let (at_end, at_start) = (contact(&self.end), contact(&self.start));
        let is_covered = at_end.is_redundant && (at_start.is_redundant || at_end.gap > -of.radius);
        if at_end.gap >= MARGIN || is_covered {
            return None;
        }
        let touching = touching_distance(&of, obstacles, at.0);
        let is_deep = at_end.gap < -DEEP * touching;
        let displacement = (pose(&self.end) - pose(&self.start)).xy().norm();
        let is_same_side = at_start.direction.xy().dot(&at_end.direction.xy()) > SAME_SIDE;
        let passes = displacement > touching && !is_same_side;
        let (plane, travelled) = if (is_deep || passes) && !at_start.is_redundant {
            (at_start, -at_start.direction.dot(&(pose(&self.base) - pose(&self.start))))
        } else {
            (at_end, self.coefficient * at_end.direction.dot(&self.expected(node).in_plane()))
        };
        let depth = if at_start.is_redundant { 0.0 } else { (-at_start.gap).max(0.0) };
        let offset = offset(plane.gap, travelled, depth, self.coefficient, self.elapsed);
        let coefficient = obstacles.friction(at.0);
        let friction = (coefficient > 0.0).then(|| StageObstacleFriction {
            tangents: [Wrench::upright(&plane.tangent()), Wrench::zero()],
            coefficient,
        });
        Some((StageContact { link: node, direction: Wrench::upright(&plane.direction), offset }, friction))
    }
}

impl<T: Real> Workspace<T> {
    /// Finds the contacts of a lane's obstacles that can be pushed with fixed ones and with their stops.
    pub(super) fn find_movable_contacts(&mut self, lane: usize, links: &[Link], obstacles: &ObstacleGrid) {
        let Self { contacts, known, motion, stage: Stage { coefficient, surfaces, .. }, awake, .. } = self;
        let nodes = obstacles.nodes(links).among(awake.of(lane));
        let stage = NodesInStage::of(motion, *coefficient, nodes, lane);
        for node in nodes.links.len()..nodes.count() {
            if let Some(ball) = &nodes.movable(node).ball {
                if !stage.find_ball_contacts((lane, node, ball), obstacles, (contacts, &known[lane])) {
                    // Nothing rubs in the air.
                    surfaces[node - nodes.links.len()].set_lane(lane, &Vector3::zeros());
                }
                continue;
            }
            visit_neighbours(nodes, node, &stage.start, &stage.end, obstacles, |(obstacle, feature)| {
                if let Some((row, friction)) = stage.obstacle_row(node, obstacles, (obstacle, feature)) {
                    let id = ContactId { link: nodes.number(node), with: Source::Obstacle(obstacle), feature };
                    contacts.add(lane, id, known[lane].of(id), row, friction);
                }
            });
        }
    }

    /// Finds their contacts with links and with each other.
    pub(super) fn find_movable_pairs(&mut self, lane: usize, links: &[Link], obstacles: &ObstacleGrid) {
        let Self { self_contacts, known, motion, stage, awake, .. } = self;
        let nodes = obstacles.nodes(links).among(awake.of(lane));
        let stage = NodesInStage::of(motion, stage.coefficient, nodes, lane);
        let place = |node: usize| stage.end.place(links.len(), node);
        visit_movable_pairs(nodes, place, MARGIN, |first, second| {
            if is_round(nodes, [first, second]) {
                if let Some(row) = stage.round_row([first, second]) {
                    let id = ContactId::of_pair([first, second].map(|node| nodes.number(node)), 0);
                    self_contacts.rows.add(lane, id, known[lane].of(id), row);
                }
                return;
            }
            let end = SeenPair::of(nodes, [first, second], &stage.end);
            end.with_placed(|links| {
                for (feature, contact) in movable_contacts(links, MARGIN) {
                    let id = ContactId::of_pair([first, second].map(|node| nodes.number(node)), feature);
                    let row = stage.pair_row([first, second], feature, &end, &contact);
                    self_contacts.rows.add(lane, id, known[lane].of(id), row);
                }
            });
        });
    }

    /// What the step does to the penetrations of what a lane's robot can push.
    pub(super) fn sinking_of_movables(&mut self, system: &SpatialSystem, lane: usize, body: &SpatialBody) -> Sinking {
        let (obstacles, links) = (&body.obstacles, &system.robot.links);
        if obstacles.movables().is_empty() {
            return Sinking::No;
        }
        let farthest = {
            let [start, end] = self.ends_of_step(lane);
            let travelled = |node: usize| (end.place(links.len(), node) - start.place(links.len(), node)).norm();
            (0..links.len() + self.awake.of(lane).len()).map(travelled).fold(0.0, f64::max)
        };
        self.wake(system, lane, body, 2.0 * farthest, true);
        let nodes = obstacles.nodes(links).among(self.awake.of(lane));
        let [start, end] = &self.ends_of_step(lane);
        let mut sinking = Sinking::No;
        let travelled = |node: usize| (end.place(links.len(), node) - start.place(links.len(), node)).norm();
        for node in nodes.links.len()..nodes.count() {
            let number = node - nodes.links.len();
            if nodes.movable(node).ball.is_some() {
                let centres = [start, end].map(|places| places.centre(number));
                sinking = sinking.max(sinking_of_ball(nodes.get(node).link, obstacles, centres));
                continue;
            }
            let (of, places) = (nodes.get(node), [start, end].map(|places| places.moved(number)));
            let may_cross = travelled(node) > of.radius;
            visit_neighbours(nodes, node, start, end, obstacles, |at| {
                let [start, end] = places.map(|pose| link_obstacle_gap(&PlacedLink::new(of, pose), obstacles, at));
                if end < -ALLOWED {
                    sinking = sinking.max(Sinking::of(start, end));
                }
                if may_cross && start.min(end) < travelled(node) {
                    sinking = sinking.max(Sinking::TooDeep);
                }
            });
        }
        visit_movable_pairs(
            nodes,
            |node| end.place(links.len(), node),
            2.0 * farthest,
            |first, second| {
                let [at_start, at_end] = [start, end].map(|places| pair_gap(nodes, [first, second], places));
                if at_end < -ALLOWED {
                    sinking = sinking.max(Sinking::of(at_start, at_end));
                }
                let way = travelled(first) + travelled(second);
                if way > nodes.get(first).radius.min(nodes.get(second).radius) && at_start.min(at_end) < way {
                    sinking = sinking.max(Sinking::TooDeep);
                }
            },
        );
        sinking
    }

    /// A lane's robot, and what it can push, at the start of the step and where that has arrived.
    fn ends_of_step(&self, lane: usize) -> [InLane<'_, T>; 2] {
        let Motion { start, start_frames, frames, .. } = &self.motion;
        [(start_frames, &start.moved), (frames, &self.result.arrival.moved)].map(|(frames, moved)| InLane {
            frames,
            moved,
            lane,
        })
    }
}

/// Calls `visit` with every fixed obstacle, and the stop, that something that can be pushed may touch in a step, and each of
/// the features of the pair.
fn visit_neighbours(
    nodes: Nodes,
    node: usize,
    start: &impl Places,
    end: &impl Places,
    obstacles: &ObstacleGrid,
    mut visit: impl FnMut((usize, usize)),
) {
    let (k, of) = (node - nodes.links.len(), nodes.get(node));
    let (from, to) = (start.moved(k).xy(), end.moved(k).xy());
    let mut visit_all =
        |obstacle: usize| (0..features(&of, obstacles, obstacle)).for_each(|feature| visit((obstacle, feature)));
    obstacles.visit_obstacles(&to, of.reach() + (to - from).norm() + MARGIN, &mut visit_all);
    if nodes.movable(node).travel().is_finite() {
        visit_all(obstacles.len() + nodes.number(node) - nodes.links.len());
    }
}

/// The gap of two nodes of which one can be pushed \[m\].
pub(crate) fn pair_gap(nodes: Nodes, pair: [usize; 2], places: &impl Places) -> f64 {
    if is_round(nodes, pair) {
        return round_gap(nodes, pair, places);
    }
    SeenPair::of(nodes, pair, places).with_placed(link_pair_gap)
}

/// Smallest gap of what can be pushed to links and to each other \[m\]; infinite where nothing is near.
pub(crate) fn movable_gap(nodes: Nodes, places: &impl Places) -> f64 {
    let mut smallest = f64::INFINITY;
    visit_movable_pairs(
        nodes,
        |node| places.place(nodes.links.len(), node),
        0.0,
        |first, second| {
            smallest = smallest.min(pair_gap(nodes, [first, second], places));
        },
    );
    smallest
}

/// Length of the shadow of a link, over its own, below which it is upright.
const UPRIGHT: f64 = 1e-9;
