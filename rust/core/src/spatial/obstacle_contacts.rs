//! The contacts of a stage with obstacles: which pairs take part, and how the gap enters.

use nalgebra::{Vector2, Vector3};

use crate::contact::recovery::{DEEP, SAME_SIDE, offset};
use crate::contact::{ContactId, ContactMemory, KnownContact, Source, touching_distance};
use crate::math::{Laned, Real};
use crate::obstacles::{ObstacleGrid, SolidContact};
use crate::robot::Link;
use crate::stepping::lanes::Lanes;
use crate::stepping::{ContactImpulse, FoundRow, FoundRows};

use super::near_pairs::NearPairs;
use super::stage::CONTACTS_PER_LINK;
use super::workspace::{StageKinematics, Workspace};
use super::{
    LinkAxis, Stage, StageContact, StageObstacleFriction, StageSolution, Twist, Wrench, centre_line, nearest_point,
    solid_line,
};

/// The contacts of the current stage with obstacles, of all lanes.
pub struct ObstacleContacts<T> {
    pub rows: FoundRows<StageContact, T>,
    /// Those of them that have friction, by their index.
    frictional: Vec<(usize, StageObstacleFriction)>,
}

/// A link of a robot in a stage.
pub(super) struct LinkInStage<'a> {
    pub at: StageKinematics<'a>,
    /// c \[s\].
    pub coefficient: f64,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: f64,
}

/// One of the features that describe a link and a vertical obstacle of the scene.
#[derive(Clone, Copy)]
struct Feature<'a> {
    obstacles: &'a ObstacleGrid,
    obstacle: usize,
    feature: usize,
}

/// Plane that separates a link from an obstacle: normal, point of the centre line, and gap.
pub(super) struct Plane {
    pub normal: Vector3<f64>,
    /// From the CG to the point.
    pub arm: Vector3<f64>,
    pub gap: f64,
    /// Whether another feature covers this one.
    pub is_redundant: bool,
}

impl<T: Real> ObstacleContacts<T> {
    pub fn with_capacity(links: usize) -> Self {
        let contacts = CONTACTS_PER_LINK * links * T::LANES;
        Self { rows: FoundRows::with_capacity(links, contacts), frictional: Vec::with_capacity(contacts) }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.frictional.clear();
    }

    /// Finds the contacts of one node of a lane's robot, which has this number, with an obstacle; `known` are those of its last
    /// stage.
    pub(super) fn find(
        &mut self,
        (lane, [node, number], link): (usize, [usize; 2], &LinkInStage),
        (obstacles, obstacle): (&ObstacleGrid, usize),
        (known, of_ground): (&ContactMemory, &Vector2<f64>),
    ) {
        link.visit(node, obstacles, obstacle, |feature, row, surface| {
            let normal = &row.direction.linear;
            let friction = match obstacles.coefficient(obstacle, feature) {
                Some(coefficient) if coefficient > 0.0 => {
                    Some(StageObstacleFriction::new(normal, &surface, coefficient))
                }
                None if of_ground.max() > 0.0 => {
                    Some(StageObstacleFriction::along(&link.at.end.axis, normal, &surface, of_ground))
                }
                _ => None,
            };
            let id = ContactId { link: number, with: Source::Obstacle(obstacle), feature };
            self.add(lane, id, known.of(id), row, friction);
        });
    }

    /// Adds a contact of a lane, with its friction if it has any; contacts come lane by lane.
    pub fn add(
        &mut self,
        lane: usize,
        id: ContactId,
        known: KnownContact,
        row: StageContact,
        friction: Option<StageObstacleFriction>,
    ) {
        self.frictional.extend(friction.map(|friction| (self.rows.all().len(), friction)));
        self.rows.add(lane, id, 0, known, row);
    }

    /// Writes all contacts to the stage. Once one of them has friction, all have a row of it.
    pub fn lay_out(&mut self, stage: &mut Stage<T>, solution: &mut StageSolution<T>) {
        self.rows.lay_out(stage.coefficient, &mut stage.contacts, &mut solution.contact);
        stage.obstacle_friction.clear();
        solution.obstacle_friction.clear();
        if self.frictional.is_empty() {
            return;
        }
        stage.obstacle_friction.resize(stage.contacts.len(), StageObstacleFriction::empty());
        solution.obstacle_friction.resize(stage.contacts.len(), Vector2::new(T::zero(), T::zero()));
        for (index, friction) in &self.frictional {
            let FoundRow { lane, slot, known, .. } = self.rows.all()[*index];
            let c = stage.coefficient.lane(lane);
            let impulse = friction.impulse_of(&(known.friction * c));
            solution.obstacle_friction[slot].set_lane(lane, &impulse);
            stage.obstacle_friction[slot].set_lane(lane, friction);
        }
    }

    /// Impulses of friction in the solved lanes.
    pub fn friction_impulses<'a>(
        &'a self,
        stage: &'a Stage<T>,
        solution: &'a StageSolution<T>,
        solved: Lanes,
    ) -> impl Iterator<Item = ContactImpulse> + 'a {
        let found =
            self.frictional.iter().map(|(index, _)| &self.rows.all()[*index]).filter(move |row| solved[row.lane]);
        let impulses = found.map(|found| found.impulse(0, friction_of(stage, solution, found.slot, found.lane)));
        impulses.filter(|each| each.impulse != Vector3::zeros())
    }
}

/// Friction of a lane's contact as an impulse on the link, frame I \[N s\].
pub fn friction_of<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, slot: usize, lane: usize) -> Vector3<f64> {
    let Some(friction) = stage.obstacle_friction.get(slot) else { return Vector3::zeros() };
    let [along, across] = friction.tangents.map(|tangent| tangent.linear.lane(lane));
    let impulse = solution.obstacle_friction[slot].lane(lane);
    along * impulse.x + across * impulse.y
}

impl<T: Real> Workspace<T> {
    /// Finds the contacts of a lane's robot with obstacles that are near.
    pub(super) fn find_obstacle_contacts(
        &mut self,
        lane: usize,
        links: &[Link],
        near: &NearPairs,
        obstacles: &ObstacleGrid,
    ) {
        let Self { contacts, known, motion, stage, .. } = self;
        let [coefficient, elapsed] = [stage.coefficient, motion.elapsed].map(|time| time.lane(lane));
        let of_ground = stage.friction.sliding.map(|coefficient| coefficient.lane(lane));
        for (i, near) in near.by_link() {
            let [start, end] = [&motion.start_frames[i], &motion.frames[i]].map(|frame| frame.position.lane(lane));
            let distance = links[i].reach() + (end - start).norm() + MARGIN;
            // All else about the link is gathered only where an obstacle is near.
            let mut in_stage = None;
            for obstacle in near.filter(|&obstacle| obstacles.is_within(obstacle, &end.xy(), distance)) {
                let link = in_stage.get_or_insert_with(|| LinkInStage {
                    at: motion.of_link(links, i, lane),
                    coefficient,
                    elapsed,
                });
                contacts.find((lane, [i, i], link), (obstacles, obstacle), (&known[lane], &of_ground));
            }
        }
    }

    /// Lists the obstacles that links of a lane's robot may touch at the start of the step, at its end, or between.
    pub(super) fn list_near(&self, lane: usize, links: &[Link], near: &mut NearPairs, obstacles: &ObstacleGrid) {
        let places = self.motion.start_frames.iter().map(|frame| frame.position.lane(lane).xy());
        let reaches = links.iter().map(Link::reach);
        near.cover(self.motion.way.lane(lane) + MARGIN, places.zip(reaches), obstacles);
    }
}

impl LinkInStage<'_> {
    /// Calls `add` with every feature of an obstacle that may matter, its contact, and the contact's point of the link's
    /// surface, from the CG.
    pub fn visit(
        &self,
        index: usize,
        obstacles: &ObstacleGrid,
        obstacle: usize,
        mut add: impl FnMut(usize, StageContact, Vector3<f64>),
    ) {
        let body = obstacles.body(obstacle);
        let margin = if body.is_some() { BODY_MARGIN } else { MARGIN };
        let mut look = |feature: usize, at_end: Plane, touching: f64, at_start: &dyn Fn() -> Plane| {
            if !self.is_far(&at_end, touching, margin)
                && let Some((row, surface)) = self.row(index, [at_start(), at_end], touching, margin)
            {
                add(feature, row, surface);
            }
        };
        if let Some(solid) = obstacles.solid(obstacle) {
            let line = |at: &LinkAxis| solid_line(self.at.link, at);
            // Far above: not worth a look.
            let lowest = |at: &LinkAxis| at.position.z - self.at.link.reach();
            if lowest(&self.at.start).min(lowest(&self.at.end)) <= solid.height + MARGIN {
                solid.visit_contacts(&line(&self.at.end), |feature, at_end| {
                    look(feature, self.solid_plane(&self.at.end, &at_end), self.at.link.radius, &|| {
                        self.solid_plane(&self.at.start, &solid.contact_at(&line(&self.at.start), feature))
                    });
                });
            }
            return;
        }
        if let Some(body) = body {
            let [start, end] = [&self.at.start, &self.at.end].map(|at| solid_line(self.at.link, at));
            let Twist { linear, angular } = &self.at.expected;
            let farthest = self.at.link.contact_half_length + self.at.link.cg_offset.abs();
            let travelled = self.coefficient * (linear.norm() + angular.norm() * farthest);
            let reach = self.at.link.radius + margin + travelled;
            body.visit_contacts(&end, reach, |feature, at_end| {
                look(feature, self.solid_plane(&self.at.end, &at_end), self.at.link.radius, &|| {
                    self.solid_plane(&self.at.start, &body.contact_at(&start, reach, feature))
                });
            });
            return;
        }
        let touching = touching_distance(self.at.link, obstacles, obstacle);
        for feature in 0..obstacles.features(obstacle) {
            let plane = |at: &LinkAxis| self.plane(at, Feature { obstacles, obstacle, feature });
            look(feature, plane(&self.at.end), touching, &|| plane(&self.at.start));
        }
    }

    /// Velocity of the point at `arm` from the CG with which the end is predicted. On scalars the fused products of
    /// `Twist::velocity_at` can be function calls.
    fn expected_velocity(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.at.expected.linear + self.at.expected.angular.cross(arm)
    }

    /// Whether the plane at the predicted end is certainly beyond the margin of [`Self::row`], wherever that at the start
    /// of the step is: neither deep nor passed, with a penetration before the step that would only add to the gap.
    fn is_far(&self, plane: &Plane, touching: f64, margin: f64) -> bool {
        let travelled = self.coefficient * plane.normal.dot(&self.expected_velocity(&plane.arm));
        let displacement = (self.at.end.position - self.at.start.position).norm();
        plane.gap - travelled.max(0.0) > margin + ROUNDING && displacement <= touching
    }

    fn solid_plane(&self, at: &LinkAxis, contact: &SolidContact) -> Plane {
        let SolidContact { distance, normal, along, is_redundant } = *contact;
        let arm = at.axis * (along * self.at.link.contact_half_length + self.at.link.cg_offset);
        Plane { normal, arm, gap: distance - self.at.link.radius, is_redundant }
    }

    /// The row of a link and a point of its surface, from the CG, given the planes at the start of the step and at the
    /// predicted end; `touching` is the distance of the centre line at which the pair touches \[m\].
    ///
    /// The end-of-stage gap is linearised at the predicted end configuration, so that a sustained contact is exact to
    /// second order. Where the prediction runs deep into a peg, or past it, the side is uncertain, and the gap is
    /// linearised at the start of the step. `None` where another feature covers this one, and beyond the margin.
    pub fn row(
        &self,
        link: usize,
        [at_start, mut plane]: [Plane; 2],
        touching: f64,
        margin: f64,
    ) -> Option<(StageContact, Vector3<f64>)> {
        let (c, displacement) = (self.coefficient, (self.at.end.position - self.at.start.position).norm());
        let mut travelled = c * plane.normal.dot(&self.expected_velocity(&plane.arm));
        let depth = if at_start.is_redundant { 0.0 } else { (-at_start.gap).max(0.0) };
        let deep = plane.gap < -DEEP * touching;
        if plane.is_redundant && (at_start.is_redundant || !deep) {
            return None;
        }
        let from_start = deep || (displacement > touching && at_start.normal.dot(&plane.normal) < SAME_SIDE);
        if from_start && !at_start.is_redundant {
            // Where the point of the start lies at the base of the stage.
            let along = at_start.arm.dot(&self.at.start.axis);
            let moved = self.at.base.position + self.at.base.axis * along - (self.at.start.position + at_start.arm);
            plane = at_start;
            travelled = -plane.normal.dot(&moved);
        }
        let row = StageContact {
            link,
            direction: Wrench { linear: plane.normal, angular: plane.arm.cross(&plane.normal) },
            offset: offset(plane.gap, travelled, depth, c, self.elapsed),
        };
        // The gap without motion or the predicted one, whichever is less.
        let closing = plane.normal.dot(&self.expected_velocity(&plane.arm)).min(0.0);
        ((row.offset + closing) * c < margin).then(|| (row, plane.arm - plane.normal * self.at.link.radius))
    }

    fn plane(
        &self,
        LinkAxis { position, axis }: &LinkAxis,
        Feature { obstacles, obstacle, feature }: Feature,
    ) -> Plane {
        let Some(peg) = obstacles.pegs().get(obstacle) else {
            let line = centre_line(self.at.link, position, axis);
            let at = obstacles.polygon(obstacle).separation(&line, feature);
            return Plane {
                normal: at.normal.push(0.0),
                arm: axis * (at.along * self.at.link.contact_half_length + self.at.link.cg_offset),
                gap: at.distance - self.at.link.radius,
                is_redundant: at.is_redundant,
            };
        };
        let (offset, along) = nearest_point(self.at.link, position, axis, peg);
        let distance = offset.norm();
        let across = Vector2::new(-axis.y, axis.x);
        let normal = offset.try_normalize(0.0).or(across.try_normalize(0.0)).unwrap_or_else(Vector2::x);
        Plane {
            normal: Vector3::new(normal.x, normal.y, 0.0),
            arm: axis * along,
            gap: distance - (peg.radius + self.at.link.radius),
            is_redundant: false,
        }
    }
}

/// Predicted gap up to which a pair takes part \[m\].
pub(super) const MARGIN: f64 = 0.02;

/// The same for bodies that may have many features under a link: more than a stage ends from its prediction \[m\].
const BODY_MARGIN: f64 = 0.006;

/// Room for round-off of a gap \[m\].
const ROUNDING: f64 = 1e-9;
