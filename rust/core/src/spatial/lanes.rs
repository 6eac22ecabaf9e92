//! Conversion between the numbers of one robot and its lane of a register.

use crate::math::{Laned, Real, laned, read_lane, write_lane};
use crate::rows::{InLane, read_rows, write_rows};
use crate::stepping::StageStop;

use super::{
    ChainVelocity, Configuration, Frame, SpatialVector, Stage, StageDrive, StageLink, StageObstacleFriction, StagePair,
    StageSolution, Wrench, hinge_directions,
};

laned! {
    SpatialVector { linear, angular };
    Frame { position, axes };
    StageDrive { drive, stiffness, limit, slack };
    StageLink {
        axes, momentum, mass, inertia, roll_inertia, half_length, cg_offset, sphere, radius, tangent, share, ground
    };
}

impl<T: Real> StageObstacleFriction<T> {
    /// Friction that no lane has.
    pub fn empty() -> Self {
        Self { tangents: [Wrench::zero(); 2], coefficient: T::zero() }
    }

    pub fn lane(&self, lane: usize) -> StageObstacleFriction {
        let tangents = Laned::<T>::lane(&self.tangents, lane);
        StageObstacleFriction { tangents, coefficient: Real::lane(&self.coefficient, lane) }
    }

    pub fn set_lane(&mut self, lane: usize, one: &StageObstacleFriction) {
        Laned::<T>::set_lane(&mut self.tangents, lane, &one.tangents);
        Real::set_lane(&mut self.coefficient, lane, one.coefficient);
    }
}

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
        to.links.clear();
        to.links.extend(self.links.iter().map(|link| link.lane(lane)));
        to.axes.clone_from(&self.axes);
        to.joints.clear();
        to.joints.extend(self.joints.iter().map(|joint| Laned::<T>::lane(joint, lane)));
        to.obstacle_friction.clear();
        let rows = self.obstacle_friction.iter().zip(&self.contacts).filter(|(_, contact)| contact.is_in(lane));
        to.obstacle_friction.extend(rows.map(|(row, _)| row.lane(lane)));
        // Rows that only other lanes need are none.
        if to.obstacle_friction.iter().all(|row| row.coefficient == 0.0) {
            to.obstacle_friction.clear();
        }
        to.contacts.clear();
        to.contacts
            .extend(self.contacts.iter().filter(|contact| contact.is_in(lane)).map(|contact| contact.lane(lane)));
        to.motors.clear();
        to.motors.extend(self.motors.iter().map(|motor| Laned::<T>::lane(motor, lane)));
        to.pairs.clear();
        to.pairs.extend(self.pairs.iter().filter(|pair| pair.is_in(lane)).map(|pair| pair.lane(lane)));
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
        read_lane::<T, _>(&self.twist, lane, &mut to.twist);
        read_lane::<T, _>(&self.rate, lane, &mut to.rate);
        read_lane::<T, _>(&self.normal, lane, &mut to.normal);
        read_lane::<T, _>(&self.friction, lane, &mut to.friction);
        read_lane::<T, _>(&self.rolling, lane, &mut to.rolling);
        read_lane::<T, _>(&self.actuator, lane, &mut to.actuator);
        to.gear.clear();
        to.gear.extend(self.gear.iter().map(|impulse| Real::lane(impulse, lane)));
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
