//! Pairs of links of one robot that may touch each other at the predicted end of a stage, and their linearised gaps.

use nalgebra::{Vector2, Vector3};

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{LinkPairContact, PlacedLink, centre_lines_cross, link_pair_contact, link_pair_contacts};
use crate::math::{Laned, Real};
use crate::robot::Link;

use super::{Heading, StagePair};

/// One robot of a stage, as its contacts with itself are found.
pub struct PosedRobot<'a, T> {
    pub links: &'a [Link],
    pub lane: usize,
    /// Configurations at the start of the step and of the stage, and at its predicted end.
    pub start: &'a [Vector3<T>],
    pub base: &'a [Vector3<T>],
    pub end: &'a [Vector3<T>],
    /// Headings at the predicted end.
    pub heading: &'a [Heading<T>],
    /// Mean velocity on the way there.
    pub travel: &'a [Vector3<T>],
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
    /// Largest displacement of any point of the robot from the start of the step to the predicted end \[m\].
    pub displacement: f64,
    /// Predicted gap up to which a pair takes part \[m\].
    pub margin: f64,
    /// Whether links on either side of a link may touch.
    pub is_sharp: bool,
}

impl<T: Real> PosedRobot<'_, T> {
    /// Visits the contacts within the margin of these pairs.
    pub fn visit_contacts(
        &self,
        pairs: impl Iterator<Item = [usize; 2]>,
        mut visit: impl FnMut([usize; 2], usize, &[PlacedLink; 2], &LinkPairContact),
    ) {
        for links in pairs.filter(|[i, j]| self.is_sharp || *j > i + 2) {
            let at_end = links.map(|link| place_in_lane(self.links, link, self.lane, self.end, self.heading));
            for (end, contact) in link_pair_contacts([&at_end[0], &at_end[1]], self.margin) {
                visit(links, end, &at_end, &contact);
            }
        }
    }

    /// The row of a contact with a penetration of `depth` \[m\]; see [`super::contacts::Prediction`] for where gaps are
    /// linearised.
    pub fn row(
        &self,
        pair: [usize; 2],
        end: usize,
        at_end: &[PlacedLink; 2],
        contact: &LinkPairContact,
        depth: f64,
    ) -> StagePair {
        let lane = self.lane;
        let row = |LinkPairContact { gap, direction, .. }: &LinkPairContact, travelled: f64| StagePair {
            links: pair,
            direction: *direction,
            offset: offset(*gap, travelled, depth, self.coefficient, self.elapsed),
        };
        let touching = self.links[pair[0]].radius + self.links[pair[1]].radius;
        let along = |direction: &[Vector3<f64>; 2], of: &dyn Fn(usize) -> Vector3<f64>| {
            direction[0].dot(&of(pair[0])) + direction[1].dot(&of(pair[1]))
        };
        let is_deep = contact.gap < -DEEP * touching || centre_lines_cross([&at_end[0], &at_end[1]]);
        if is_deep || self.displacement > touching {
            let at_start = pair.map(|link| PlacedLink::new(&self.links[link], self.start[link].lane(lane)));
            let start = link_pair_contact([&at_start[0], &at_start[1]], end);
            let is_same_side = start.normal.dot(&contact.normal) > SAME_SIDE;
            if is_deep || !is_same_side {
                let moved = |link: usize| self.base[link].lane(lane) - self.start[link].lane(lane);
                return row(&start, -along(&start.direction, &moved));
            }
        }
        let travel = |link: usize| self.travel[link].lane(lane);
        row(contact, self.coefficient * along(&contact.direction, &travel))
    }
}

/// A link of a lane's robot at a pose whose direction is known.
pub fn place_in_lane<'a, T: Real>(
    links: &'a [Link],
    link: usize,
    lane: usize,
    pose: &[Vector3<T>],
    heading: &[Heading<T>],
) -> PlacedLink<'a> {
    let Heading { cos, sin } = heading[link].lane(lane);
    let axis = Vector2::new(cos, sin);
    PlacedLink { link: &links[link], pose: pose[link].lane(lane), axis }
}
