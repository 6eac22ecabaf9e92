//! Pairs of links of one robot that may touch each other at the predicted end of a stage, and their linearised gaps.

use nalgebra::{Vector2, Vector3};

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{
    LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contact, link_pair_contacts, movable_contacts,
    visit_movable_pairs,
};
use crate::math::{Laned, Real};
use crate::obstacles::{Moved, Nodes};

use super::workspace::StageKinematics;
use super::{Heading, StagePair};

impl<T: Real> StageKinematics<'_, T> {
    /// Visits the contacts of these pairs within the margin; `is_sharp` where links on either side of a link may touch.
    pub fn visit_contacts(
        &self,
        pairs: impl Iterator<Item = [usize; 2]>,
        is_sharp: bool,
        mut visit: impl FnMut([usize; 2], usize, &[PlacedLink; 2], &LinkPairContact),
    ) {
        let margin = self.margin(2.0);
        for links in pairs.filter(|[i, j]| is_sharp || *j > i + 2) {
            let at_end = links.map(|link| self.placed(link));
            for (end, contact) in link_pair_contacts([&at_end[0], &at_end[1]], margin) {
                visit(links, end, &at_end, &contact);
            }
        }
    }

    /// Visits the contacts within the margin of what can be pushed with links and with each other.
    pub fn visit_movable_contacts(&self, mut visit: impl FnMut([usize; 2], usize, &[PlacedLink; 2], &LinkPairContact)) {
        let margin = self.margin(2.0);
        visit_movable_pairs(
            self.nodes,
            |node| self.end(node).xy(),
            margin,
            |first, second| {
                let at_end = [first, second].map(|node| self.placed(node));
                for (feature, contact) in movable_contacts([&at_end[0], &at_end[1]], margin) {
                    visit([first, second], feature, &at_end, &contact);
                }
            },
        );
    }

    /// The row of a contact with a penetration of `depth` \[m\], and one along the surfaces; see [`super::contacts`] for where
    /// gaps are linearised.
    pub fn row(
        &self,
        pair: [usize; 2],
        end: usize,
        at_end: &[PlacedLink; 2],
        contact: &LinkPairContact,
        depth: f64,
    ) -> (StagePair, impl FnOnce() -> StagePair + use<T>) {
        let radius = pair.map(|node| self.nodes.get(node).radius);
        let touching = radius[0] + radius[1];
        let along = |direction: &[Vector3<f64>; 2], of: &dyn Fn(usize) -> Vector3<f64>| {
            direction[0].dot(&of(pair[0])) + direction[1].dot(&of(pair[1]))
        };
        let (mut plane, mut axis) = (*contact, [at_end[0].axis, at_end[1].axis]);
        let mut travelled = self.coefficient * along(&contact.direction, &|link| self.travel(link));
        let is_deep = contact.gap < -DEEP * touching || centre_lines_cross([&at_end[0], &at_end[1]]);
        if is_deep || self.bound.displacement > touching {
            let at_start = pair.map(|link| self.placed_at_start(link));
            let start = link_pair_contact([&at_start[0], &at_start[1]], end);
            let is_same_side = start.normal.dot(&contact.normal) > SAME_SIDE;
            if start.gap < f64::INFINITY && (is_deep || !is_same_side) {
                (plane, axis) = (start, [at_start[0].axis, at_start[1].axis]);
                travelled = -along(&start.direction, &|link| self.base(link) - self.start(link));
            }
        }
        let row = move |direction: [Vector3<f64>; 2], offset: f64| StagePair { links: pair, direction, offset };
        let offset = offset(plane.gap, travelled, depth, self.coefficient, self.elapsed);
        (row(plane.direction, offset), move || row(plane.tangent(&axis, &radius), 0.0))
    }
}

/// A link of a lane's robot, or what can be pushed, by its number in the scene: where what sleeps lies, else as
/// [`place_in_lane`].
pub fn place_numbered<'a, T: Real>(
    (nodes, lying): (Nodes<'a>, &[Moved]),
    number: usize,
    lane: usize,
    pose: &[Vector3<T>],
    heading: &[Heading<T>],
) -> PlacedLink<'a> {
    match nodes.place_of(number) {
        Some(node) => place_in_lane(nodes, node, lane, pose, heading),
        None => PlacedLink::new(nodes.all().get(number), lying[number - nodes.links.len()].pose),
    }
}

/// A link of a lane's robot at a pose whose direction is known, or what can be pushed.
pub fn place_in_lane<'a, T: Real>(
    nodes: Nodes<'a>,
    link: usize,
    lane: usize,
    pose: &[Vector3<T>],
    heading: &[Heading<T>],
) -> PlacedLink<'a> {
    let Heading { cos, sin } = heading[link].lane(lane);
    let axis = Vector2::new(cos, sin);
    PlacedLink { link: nodes.get(link), pose: pose[link].lane(lane), axis }
}
