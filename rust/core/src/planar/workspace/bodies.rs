//! The nodes behind the chain: what can be pushed and is awake, lane by lane.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};

use crate::contact::PlacedLink;
use crate::math::{Laned, MAX_LANES, Real};
use crate::obstacles::{Nodes, ObstacleGrid};
use crate::planar::{Body, Heading, Planar, PlanarSystem, Twist, WarmStart};
use crate::stepping::{Members, StageSpring, are_within, holding};

use super::{LinkConstants, Workspace};

impl<T: Real> Workspace<T> {
    /// Gives the register room for what its robots can push, and nodes to what moves, or may.
    pub(super) fn load_movables(&mut self, members: &Members<Planar>) {
        let body = |lane: usize| (lane < T::LANES).then(|| members.body(lane));
        let most = (0..MAX_LANES).filter_map(body).map(|body| body.state.movables.len()).fold(0, usize::max);
        if most > self.room {
            *self = Self::new(members.system, most);
        }
        if self.room == 0 {
            return;
        }
        let (chain, gravity) = (members.system.robot.link_count(), members.system.gravity);
        for lane in 0..T::LANES {
            let Body { state, warm_start, obstacles, .. } = members.body(lane);
            let is_awake = |number: usize| {
                let is_guessed = warm_start.guess.get(chain + number).is_some_and(|guess| *guess != Twist::zeros());
                is_guessed || holding(&obstacles.movables()[number], &state.movables[number], &gravity).is_none()
            };
            self.awake.begin(lane, state.movables.len(), is_awake);
            let radii = obstacles.movables().iter().map(|movable| movable.link.radius);
            let smallest = radii.fold(members.system.smallest_radius, f64::min);
            Real::set_lane(&mut self.motion.smallest_radius, lane, smallest);
        }
        self.has_springs = members.any(|body| body.obstacles.movables().iter().any(|one| one.spring.is_some()));
        self.resize(0);
        self.resize(self.awake.most());
        for lane in 0..T::LANES {
            let all = 0..self.awake.of(lane).len();
            self.load_nodes(members.system, lane, members.body(lane), all);
            for (node, &number) in (chain..).zip(self.awake.of(lane)) {
                self.motion.start_twist[node].set_lane(lane, &members.body(lane).state.movables[number].twist);
            }
        }
    }

    /// The nodes of a lane behind the chain that have these places.
    fn load_nodes(&mut self, system: &PlanarSystem, lane: usize, body: &Body, places: Range<usize>) {
        let chain = system.robot.link_count();
        for (place, &number) in places.clone().zip(&self.awake.of(lane)[places]) {
            let (movable, node) = (&body.obstacles.movables()[number], chain + place);
            self.constants[node].set_lane(lane, &LinkConstants::of_movable(system, movable));
            self.springs[place].set_lane(lane, &StageSpring::of(movable));
            self.motion.start_pose[node].set_lane(lane, &body.state.movables[number].pose);
            let WarmStart { friction, spin, .. } = &body.warm_start;
            self.friction_force[node].set_lane(lane, &friction.get(chain + number).copied().unwrap_or_default());
            Real::set_lane(&mut self.spin_torque[node], lane, spin.get(chain + number).copied().unwrap_or(0.0));
        }
    }

    /// Wakes what sleeps within `margin` of the nodes of a lane at the predicted end of the stage, or at that of the step; it
    /// has been still up to now.
    pub(in crate::planar) fn wake(
        &mut self,
        system: &PlanarSystem,
        lane: usize,
        body: &Body,
        margin: f64,
        is_at_end: bool,
    ) {
        let Self { awake, motion, result, .. } = self;
        let poses = if is_at_end { &result.end } else { &motion.predicted };
        let nodes = system.nodes(&body.obstacles);
        let meets = |node: usize, number: usize, sleeper: &PlacedLink| {
            let Heading { cos, sin } = motion.heading[node].lane(lane);
            let (link, axis) = (nodes.get(number), Vector2::new(cos, sin));
            are_within(margin, [&PlacedLink { link, pose: poses[node].lane(lane), axis }, sleeper])
        };
        let lying = |number: usize| body.state.movables[number].pose;
        let woken = awake.wake_near(lane, (nodes, margin), lying, |node| poses[node].lane(lane).xy(), meets);
        if woken.is_empty() {
            return;
        }
        self.resize(self.springs.len().max(woken.end));
        self.load_nodes(system, lane, body, woken.clone());
        for node in woken.map(|place| system.robot.link_count() + place) {
            let lies = self.motion.start_pose[node].lane(lane);
            for poses in [&mut self.motion.base, &mut self.motion.predicted, &mut self.result.end] {
                poses[node].set_lane(lane, &lies);
            }
            self.motion.heading[node].set_lane(lane, &Heading::of(lies.z));
        }
    }

    /// A lane's links and, behind them, what is awake.
    pub(in crate::planar) fn nodes<'a>(
        &'a self,
        system: &'a PlanarSystem,
        lane: usize,
        obstacles: &'a ObstacleGrid,
    ) -> Nodes<'a> {
        system.nodes(obstacles).among(self.awake.of(lane))
    }

    /// Makes so many nodes behind the chain; new ones are absent in all lanes.
    fn resize(&mut self, count: usize) {
        let (nodes, zero) = (self.motion.arms.len() + count, T::zero());
        let none = Vector3::new(zero, zero, zero);
        let Self { motion, result, solution, .. } = self;
        for each in [
            &mut motion.start_pose,
            &mut motion.start_twist,
            &mut motion.base,
            &mut motion.reference,
            &mut motion.guess,
            &mut motion.predicted,
            &mut motion.travel,
            &mut result.twist,
            &mut result.end,
            &mut solution.twist,
        ] {
            each.resize(nodes, none);
        }
        let no_force = Vector2::new(zero, zero);
        motion.heading.resize(nodes, Heading { cos: T::splat(1.0), sin: zero });
        solution.friction.resize(nodes, no_force);
        self.friction_force.resize(nodes, no_force);
        self.spin_torque.resize(if self.resists_spin || count > 0 { nodes } else { 0 }, zero);
        self.constants.resize(nodes, self.absent);
        self.springs.resize(count, StageSpring::none());
    }
}
