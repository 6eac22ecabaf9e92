//! Conversion between the numbers of one robot and its lane of a register.

use crate::math::{Laned, Real, laned, read_lane, replace_by_lane, write_lane};
use crate::rows::{read_rows, write_rows};
use crate::stepping::StageStop;

use super::{
    ChainVelocity, Configuration, Frame, SpatialVector, Stage, StageLink, StageObstacleFriction, StagePair,
    StageSolution, Wrench, hinge_directions,
};

laned! {
    SpatialVector { linear, angular };
    Frame { position, axes };
    StageObstacleFriction { tangents, coefficient };
    StageLink {
        axes, momentum, mass, inertia, roll_inertia, half_length, cg_offset, sphere, radius, tangent, share, ground
    };
}

impl<T: Real> StageObstacleFriction<T> {
    /// Friction that no lane has.
    pub fn empty() -> Self {
        Self { tangents: [Wrench::zero(); 2], coefficient: T::zero() }
    }
}

/// Of a chain; what it can push has its own numbers, see [`crate::stepping::Awake`].
impl<T: Real> Configuration<T> {
    pub fn read_lane(&self, lane: usize, to: &mut Configuration) {
        (to.position, to.orientation) = (self.position.lane(lane), Laned::<T>::lane(&self.orientation, lane));
        read_lane::<T, _>(&self.angle, lane, &mut to.angle);
    }

    pub fn set_lane(&mut self, lane: usize, from: &Configuration) {
        self.position.set_lane(lane, &from.position);
        Laned::<T>::set_lane(&mut self.orientation, lane, &from.orientation);
        write_lane::<T, _>(&mut self.angle, lane, &from.angle);
    }
}

/// Of a chain.
impl<T: Real> ChainVelocity<T> {
    pub fn read_lane(&self, lane: usize, to: &mut ChainVelocity) {
        to.head = self.head.lane(lane);
        read_lane::<T, _>(&self.rate, lane, &mut to.rate);
    }

    pub fn set_lane(&mut self, lane: usize, from: &ChainVelocity) {
        self.head.set_lane(lane, &from.head);
        write_lane::<T, _>(&mut self.rate, lane, &from.rate);
    }
}

impl<T: Real> Stage<T> {
    /// The stage of one robot, with the contacts that the lane has. Its stops become contacts between neighbouring links:
    /// the fallback needs one kind of row less.
    pub fn copy_lane(&self, lane: usize, to: &mut Stage) {
        to.coefficient = Real::lane(&self.coefficient, lane);
        to.friction.sliding = self.friction.sliding.lane(lane);
        to.friction.rolling = Real::lane(&self.friction.rolling, lane);
        to.friction.skin = self.friction.skin;
        replace_by_lane::<T, _>(&mut to.links, &self.links, lane);
        replace_by_lane::<T, _>(&mut to.surfaces, &self.surfaces, lane);
        to.axes.clone_from(&self.axes);
        replace_by_lane::<T, _>(&mut to.joints, &self.joints, lane);
        read_rows(&self.obstacle_friction, &self.contacts, lane, &mut to.obstacle_friction);
        // Rows that only other lanes need are none.
        if to.obstacle_friction.iter().all(|row| row.coefficient == 0.0) {
            to.obstacle_friction.clear();
        }
        read_rows(&self.contacts, &self.contacts, lane, &mut to.contacts);
        replace_by_lane::<T, _>(&mut to.motors, &self.motors, lane);
        read_rows(&self.pairs, &self.pairs, lane, &mut to.pairs);
        to.stops.clear();
        for (axis, side) in self.stops_in_lane(lane) {
            let joint = axis / 2;
            let about = hinge_directions(to.axes_of(joint), &to.links[joint].axes, &to.links[joint + 1].axes)[axis % 2];
            let turn = StageStop::<T>::SIDES[side] * Real::lane(&self.stops[axis].lever, lane);
            let direction = [turn, -turn].map(|turn| Wrench { angular: about * turn, ..Wrench::zero() });
            let offset = Real::lane(&self.stops[axis].offset[side], lane);
            to.pairs.push(StagePair { links: [joint, joint + 1], direction, offset });
        }
    }

    /// Axes and sides of the stops that a lane's robot may reach: an axis that a joint does not have has none.
    fn stops_in_lane(&self, lane: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        StageStop::in_lane(&self.stops, lane).filter(|(axis, _)| self.axes_of(axis / 2).has(axis % 2))
    }
}

impl<T: Real> StageSolution<T> {
    /// Copies the solution of `lane` into `to`, with the impulses of those contacts of `stage` that the lane has.
    pub fn copy_lane(&self, stage: &Stage<T>, lane: usize, to: &mut StageSolution) {
        to.twist.clear();
        to.twist.extend(self.twist.iter().map(|twist| twist.lane(lane)));
        to.surface.clear();
        to.surface.extend(self.surface.iter().map(|impulse| impulse.lane(lane)));
        read_lane::<T, _>(&self.rate, lane, &mut to.rate);
        read_lane::<T, _>(&self.normal, lane, &mut to.normal);
        read_lane::<T, _>(&self.friction, lane, &mut to.friction);
        read_lane::<T, _>(&self.rolling, lane, &mut to.rolling);
        read_lane::<T, _>(&self.actuator, lane, &mut to.actuator);
        replace_by_lane::<T, _>(&mut to.gear, &self.gear, lane);
        read_rows(&self.obstacle_friction, &stage.contacts, lane, &mut to.obstacle_friction);
        read_rows(&self.contact, &stage.contacts, lane, &mut to.contact);
        read_rows(&self.pair, &stage.pairs, lane, &mut to.pair);
        to.stop.clear();
        let stops = stage.stops_in_lane(lane);
        to.pair.extend(stops.map(|(axis, side)| Real::lane(&self.stop[axis][side], lane)));
    }

    /// Copies `from` to the solution of `lane`; both are of the same `stage`.
    pub fn set_lane(&mut self, stage: &Stage<T>, lane: usize, from: &StageSolution) {
        write_lane::<T, _>(&mut self.twist, lane, &from.twist);
        write_lane::<T, _>(&mut self.surface, lane, &from.surface);
        write_lane::<T, _>(&mut self.rate, lane, &from.rate);
        write_lane::<T, _>(&mut self.normal, lane, &from.normal);
        write_lane::<T, _>(&mut self.friction, lane, &from.friction);
        write_lane::<T, _>(&mut self.rolling, lane, &from.rolling);
        write_lane::<T, _>(&mut self.actuator, lane, &from.actuator);
        write_lane::<T, _>(&mut self.gear, lane, &from.gear);
        write_rows(&mut self.obstacle_friction, &stage.contacts, lane, &from.obstacle_friction);
        write_rows(&mut self.contact, &stage.contacts, lane, &from.contact);
        let written = write_rows(&mut self.pair, &stage.pairs, lane, &from.pair);
        let stops = stage.stops_in_lane(lane);
        for ((axis, side), impulse) in stops.zip(&from.pair[written..]) {
            Real::set_lane(&mut self.stop[axis][side], lane, *impulse);
        }
    }
}
