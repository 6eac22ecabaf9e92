//! The nodes behind the chain: what can be pushed and is awake, lane by lane.

use std::ops::Range;

use nalgebra::Vector3;

use crate::contact::PlacedLink;
use crate::math::{Laned, MAX_LANES, Real, laned};
use crate::obstacles::Movable;
use crate::robot::Link;
use crate::spatial::balls::floor;
use crate::spatial::movables::Seen;
use crate::spatial::nodes::{InLane, Places};
use crate::spatial::spatial_vector::{along, scaled, zero_vector};
use crate::spatial::{Spatial, SpatialBody, SpatialSystem, SpatialVector, StageLink, Twist};
use crate::stepping::{Members, StageSpring, are_within, holding};

use super::Workspace;

/// Constants of something that can be pushed.
#[derive(Debug, Clone, Copy)]
pub struct StageMovable<T> {
    mass: T,
    inertia: T,
    half_length: T,
    /// Farthest point of its outline that turning moves \[m\].
    pub reach: T,
    /// Semi-axes of its limit surface \[N\], \[N m\].
    friction: Vector3<T>,
    /// Acceleration, along the ground alone of what stays upright \[m/s^2\].
    pull: Vector3<T>,
    pub spring: StageSpring<T>,
}

laned! {
    StageMovable { mass, inertia, half_length, reach, friction, pull, spring };
}

impl<T: Real> StageMovable<T> {
    /// In the place of one that only other lanes have: nothing moves it.
    pub fn absent(system: &SpatialSystem) -> Self {
        let Link { mass, inertia, length, .. } = system.robot.links[0];
        Self {
            mass: T::splat(mass),
            inertia: T::splat(inertia),
            half_length: T::splat(0.5 * length),
            reach: T::zero(),
            friction: zero_vector(),
            pull: zero_vector(),
            spring: StageSpring::none(),
        }
    }

    /// Its node and the semi-axes of its friction in a stage of coefficient `c`, before which it is at `base`.
    #[inline(always)]
    fn node(
        &self,
        c: T,
        base: &SpatialVector<T>,
        reference: &Twist<T>,
        upright: &StageLink<T>,
    ) -> (StageLink<T>, Vector3<T>) {
        let pulled = along(&reference.linear, &self.pull, c);
        let (mass, linear) = self.spring.hold(c, &base.linear, self.mass, &pulled);
        let (inertia, half_length) = (self.inertia, self.half_length);
        let mut link = StageLink { mass, inertia, roll_inertia: inertia, half_length, ..*upright };
        link.momentum = link.momentum_of(&Twist { linear, angular: reference.angular });
        (link, scaled(&self.friction, c))
    }
}

impl StageMovable<f64> {
    fn of(system: &SpatialSystem, movable: &Movable) -> Self {
        let Link { mass, inertia, .. } = movable.link;
        Self {
            mass,
            inertia,
            half_length: movable.link.reach(),
            reach: movable.turning_reach(),
            friction: movable.friction(-system.gravity.z),
            pull: system.gravity.xy().push(if movable.ball.is_some() { system.gravity.z } else { 0.0 }),
            spring: StageSpring::of(movable),
        }
    }
}

impl<T: Real> Workspace<T> {
    /// Gives the register room for what its robots can push, and nodes to what moves, or may.
    pub(super) fn load_movables(&mut self, members: &Members<Spatial>) {
        let body = |lane: usize| (lane < T::LANES).then(|| members.body(lane));
        let most = (0..MAX_LANES).filter_map(body).map(|body| body.state.movables.len()).fold(0, usize::max);
        if most > self.room {
            *self = Self::new(members.system, most);
        }
        if self.room == 0 {
            return;
        }
        for lane in 0..T::LANES {
            let SpatialBody { warm_start: state, obstacles, .. } = members.body(lane);
            let is_awake = |number: usize| {
                let guess = if state.is_postponed { state.guess.moved[number] } else { Twist::zero() };
                let movable = &obstacles.movables()[number];
                let is_held = holding(movable, &state.moved(number), &members.system.gravity).is_some();
                let hovers =
                    movable.ball.is_some() && floor(&state.configuration.moved[number].linear, obstacles) != 0.0;
                guess != Twist::zero() || !is_held || hovers
            };
            self.awake.begin(lane, obstacles.movables().len(), is_awake);
        }
        self.resize(0);
        self.resize(self.awake.most());
        for lane in 0..T::LANES {
            let all = 0..self.awake.of(lane).len();
            self.load_nodes(members.system, lane, members.body(lane), all);
            self.awake.write(
                lane,
                &mut self.motion.start_velocity.moved,
                &members.body(lane).warm_start.velocity.moved,
            );
        }
    }

    /// The nodes of a lane behind the chain that have these places.
    fn load_nodes(&mut self, system: &SpatialSystem, lane: usize, body: &SpatialBody, places: Range<usize>) {
        let SpatialBody { warm_start: state, obstacles, .. } = body;
        for (place, &number) in places.clone().zip(&self.awake.of(lane)[places]) {
            self.movables[place].set_lane(lane, &StageMovable::of(system, &obstacles.movables()[number]));
            self.surface_force[place].set_lane(lane, &state.last.surface[number]);
            self.motion.start.moved[place].set_lane(lane, &state.configuration.moved[number]);
        }
    }

    /// Wakes what sleeps near the nodes of a lane, which are at these places; it has been still up to now.
    pub(in crate::spatial) fn wake(
        &mut self,
        system: &SpatialSystem,
        lane: usize,
        body: &SpatialBody,
        margin: f64,
        is_at_end: bool,
    ) {
        let nodes = body.obstacles.nodes(&system.robot.links);
        let Self { awake, motion, result, .. } = self;
        let moved = if is_at_end { &result.arrival.moved } else { &motion.predicted.moved };
        let places = InLane { frames: &motion.frames, moved, lane };
        let chain = nodes.links.len();
        let meets = |node: usize, number: usize, sleeper: &PlacedLink| {
            let seen = (node < chain).then(|| Seen::of(nodes, node, &places));
            let pushed = || PlacedLink::new(nodes.get(number), places.moved(node - chain));
            are_within(margin, [&seen.as_ref().map_or_else(pushed, Seen::placed), sleeper])
        };
        let lying = |number: usize| body.warm_start.configuration.moved[number].in_plane();
        let woken = awake.wake_near(lane, (nodes, margin), lying, |node| places.place(chain, node), meets);
        if woken.is_empty() {
            return;
        }
        self.resize(self.movables.len().max(woken.end));
        self.load_nodes(system, lane, body, woken.clone());
        let c = self.stage.coefficient.lane(lane);
        for place in woken {
            let lies = self.motion.start.moved[place].lane(lane);
            for configuration in [&mut self.motion.base, &mut self.motion.predicted, &mut self.result.arrival] {
                configuration.moved[place].set_lane(lane, &lies);
            }
            let movable = self.movables[place].lane(lane);
            let (node, friction) = movable.node(c, &lies, &Twist::zero(), &self.upright.lane(lane));
            self.stage.links[chain + place].set_lane(lane, &node);
            self.stage.surfaces[place].set_lane(lane, &friction);
        }
    }

    #[inline(always)]
    pub(super) fn fill_movables(&mut self) {
        let (c, first) = (self.stage.coefficient, self.motion.frames.len());
        let nodes = self.stage.links[first..].iter_mut().zip(&mut self.stage.surfaces);
        for (k, ((link, friction), movable)) in nodes.zip(&self.movables).enumerate() {
            (*link, *friction) = movable.node(c, &self.motion.base.moved[k], &self.motion.moved[k], &self.upright);
        }
    }

    /// Makes so many nodes behind the chain; new ones are absent in all lanes.
    fn resize(&mut self, count: usize) {
        let nodes = self.motion.frames.len() + count;
        let Self { motion, result, stage, solution, .. } = self;
        for friction in [&mut self.surface_force, &mut stage.surfaces, &mut solution.surface] {
            friction.resize(count, zero_vector());
        }
        for moved in [
            &mut motion.start.moved,
            &mut motion.start_velocity.moved,
            &mut motion.base.moved,
            &mut motion.guess.moved,
            &mut motion.moved,
            &mut motion.predicted.moved,
            &mut result.kept.end.moved,
            &mut result.arrival.moved,
        ] {
            moved.resize(count, SpatialVector::zero());
        }
        motion.expected.resize(nodes, Twist::zero());
        solution.twist.resize(nodes, Twist::zero());
        stage.links.resize(nodes, self.upright);
        self.movables.resize(count, self.absent);
    }
}
