//! Conversion between the numbers of one robot and its lane of a register.

use nalgebra::{Vector2, Vector3};

use crate::math::Real;
use crate::stepping::StageStop;

use super::{
    ChainVelocity, Configuration, Frame, SpatialVector, Stage, StageDrive, StageLink, StagePair, StagePeg,
    StagePegFriction, StageSolution, Wrench,
};

/// Data of several robots side by side.
pub trait Laned<T: Real> {
    /// The same of one robot.
    type One;

    fn lane(&self, lane: usize) -> Self::One;
    fn set_lane(&mut self, lane: usize, one: &Self::One);
}

/// Copies one robot's data from its lane; both have the same length.
pub fn read_lane<T: Real, X: Laned<T>>(from: &[X], lane: usize, to: &mut [X::One]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.lane(lane);
    }
}

/// Copies one robot's data to its lane; both have the same length.
pub fn write_lane<T: Real, X: Laned<T>>(to: &mut [X], lane: usize, from: &[X::One]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.set_lane(lane, from);
    }
}

impl<T: Real> Laned<T> for T {
    type One = f64;

    #[inline]
    fn lane(&self, lane: usize) -> f64 {
        Real::lane(*self, lane)
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &f64) {
        Real::set_lane(self, lane, *one);
    }
}

impl<T: Real, X: Laned<T>, const N: usize> Laned<T> for [X; N] {
    type One = [X::One; N];

    #[inline]
    fn lane(&self, lane: usize) -> Self::One {
        std::array::from_fn(|i| self[i].lane(lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Self::One) {
        for (entry, one) in self.iter_mut().zip(one) {
            entry.set_lane(lane, one);
        }
    }
}

/// Implements [`Laned`] field by field for types generic over the number.
macro_rules! laned {
    ($($name:ident { $($field:ident),* };)*) => {
        $(impl<T: Real> Laned<T> for $name<T> {
            type One = $name<f64>;

            #[inline]
            fn lane(&self, lane: usize) -> Self::One {
                $name { $($field: Laned::<T>::lane(&self.$field, lane)),* }
            }

            #[inline]
            fn set_lane(&mut self, lane: usize, one: &Self::One) {
                $(Laned::<T>::set_lane(&mut self.$field, lane, &one.$field);)*
            }
        })*
    };
}

laned! {
    SpatialVector { linear, angular };
    Frame { position, axes };
    StageDrive { drive, stiffness, limit, slack };
    StageLink {
        axes, momentum, mass, inertia, roll_inertia, half_length, sphere, radius, tangent, share, ground
    };
}

impl<T: Real> Laned<T> for Vector2<T> {
    type One = Vector2<f64>;

    #[inline]
    fn lane(&self, lane: usize) -> Vector2<f64> {
        Vector2::new(Real::lane(self.x, lane), Real::lane(self.y, lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Vector2<f64>) {
        Real::set_lane(&mut self.x, lane, one.x);
        Real::set_lane(&mut self.y, lane, one.y);
    }
}

impl<T: Real> Laned<T> for Vector3<T> {
    type One = Vector3<f64>;

    #[inline]
    fn lane(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(Real::lane(self.x, lane), Real::lane(self.y, lane), Real::lane(self.z, lane))
    }

    #[inline]
    fn set_lane(&mut self, lane: usize, one: &Vector3<f64>) {
        Real::set_lane(&mut self.x, lane, one.x);
        Real::set_lane(&mut self.y, lane, one.y);
        Real::set_lane(&mut self.z, lane, one.z);
    }
}

impl<T: Real> StagePeg<T> {
    /// A contact that is in no lane yet.
    pub fn nowhere(link: usize) -> Self {
        Self { link, direction: Wrench::zero(), offset: T::splat(1.0) }
    }

    pub fn lane(&self, lane: usize) -> StagePeg {
        StagePeg { link: self.link, direction: self.direction.lane(lane), offset: Real::lane(self.offset, lane) }
    }

    pub fn set_lane(&mut self, lane: usize, one: &StagePeg) {
        self.direction.set_lane(lane, &one.direction);
        Real::set_lane(&mut self.offset, lane, one.offset);
    }
}

impl<T: Real> StagePegFriction<T> {
    /// Friction that is in no lane yet.
    pub fn nowhere() -> Self {
        Self { tangents: [Wrench::zero(); 2], coefficient: T::zero() }
    }

    pub fn lane(&self, lane: usize) -> StagePegFriction {
        let tangents = Laned::<T>::lane(&self.tangents, lane);
        StagePegFriction { tangents, coefficient: Real::lane(self.coefficient, lane) }
    }

    pub fn set_lane(&mut self, lane: usize, one: &StagePegFriction) {
        Laned::<T>::set_lane(&mut self.tangents, lane, &one.tangents);
        Real::set_lane(&mut self.coefficient, lane, one.coefficient);
    }
}

impl<T: Real> StagePair<T> {
    /// A contact that is in no lane yet.
    pub fn nowhere(links: [usize; 2]) -> Self {
        Self { links, direction: [Wrench::zero(); 2], offset: T::splat(1.0) }
    }

    pub fn lane(&self, lane: usize) -> StagePair {
        let direction = Laned::<T>::lane(&self.direction, lane);
        StagePair { links: self.links, direction, offset: Real::lane(self.offset, lane) }
    }

    pub fn set_lane(&mut self, lane: usize, one: &StagePair) {
        Laned::<T>::set_lane(&mut self.direction, lane, &one.direction);
        Real::set_lane(&mut self.offset, lane, one.offset);
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
    /// The stage of one robot; of all peg contacts those of `pegs` are its own. Its stops become contacts between
    /// neighbouring links: the fallback needs one kind of row less.
    pub fn read_lane(&self, lane: usize, pegs: impl Iterator<Item = usize> + Clone, to: &mut Stage) {
        to.coefficient = Real::lane(self.coefficient, lane);
        to.friction.sliding = self.friction.sliding.lane(lane);
        to.friction.rolling = Real::lane(self.friction.rolling, lane);
        to.links.clear();
        to.links.extend(self.links.iter().map(|link| link.lane(lane)));
        to.joints.clear();
        to.joints.extend(self.joints.iter().map(|joint| Laned::<T>::lane(joint, lane)));
        to.peg_friction.clear();
        to.peg_friction.extend(pegs.clone().filter_map(|peg| Some(self.peg_friction.get(peg)?.lane(lane))));
        to.pegs.clear();
        to.pegs.extend(pegs.map(|peg| self.pegs[peg].lane(lane)));
        to.pairs.clear();
        to.pairs.extend(self.pairs.iter().map(|pair| pair.lane(lane)));
        to.stops.clear();
        for (axis, side) in StageStop::in_lane(&self.stops, lane) {
            let joint = axis / 2;
            let about = [to.links[joint].axes[1], to.links[joint + 1].axes[0]][axis % 2];
            let turn = StageStop::<T>::SIDES[side] * Real::lane(self.stops[axis].lever, lane);
            let direction = [turn, -turn].map(|turn| Wrench { angular: about * turn, ..Wrench::zero() });
            let offset = Real::lane(self.stops[axis].offset[side], lane);
            to.pairs.push(StagePair { links: [joint, joint + 1], direction, offset });
        }
    }
}

impl<T: Real> StageSolution<T> {
    /// The solution of one robot; `pegs` as in [`Stage::read_lane`].
    pub fn read_lane(
        &self,
        stage: &Stage<T>,
        lane: usize,
        pegs: impl Iterator<Item = usize> + Clone,
        to: &mut StageSolution,
    ) {
        let stops = StageStop::in_lane(&stage.stops, lane);
        read_lane::<T, _>(&self.twist, lane, &mut to.twist);
        read_lane::<T, _>(&self.rate, lane, &mut to.rate);
        read_lane::<T, _>(&self.normal, lane, &mut to.normal);
        read_lane::<T, _>(&self.friction, lane, &mut to.friction);
        read_lane::<T, _>(&self.rolling, lane, &mut to.rolling);
        read_lane::<T, _>(&self.actuator, lane, &mut to.actuator);
        to.peg_friction.clear();
        to.peg_friction.extend(pegs.clone().filter_map(|peg| Some(self.peg_friction.get(peg)?.lane(lane))));
        to.peg.clear();
        to.peg.extend(pegs.map(|peg| Real::lane(self.peg[peg], lane)));
        to.pair.clear();
        to.pair.extend(self.pair.iter().map(|pair| Real::lane(*pair, lane)));
        to.stop.clear();
        to.pair.extend(stops.map(|(axis, side)| Real::lane(self.stop[axis][side], lane)));
    }

    pub fn set_lane(
        &mut self,
        stage: &Stage<T>,
        lane: usize,
        pegs: impl Iterator<Item = usize> + Clone,
        from: &StageSolution,
    ) {
        let stops = StageStop::in_lane(&stage.stops, lane);
        write_lane::<T, _>(&mut self.twist, lane, &from.twist);
        write_lane::<T, _>(&mut self.rate, lane, &from.rate);
        write_lane::<T, _>(&mut self.normal, lane, &from.normal);
        write_lane::<T, _>(&mut self.friction, lane, &from.friction);
        write_lane::<T, _>(&mut self.rolling, lane, &from.rolling);
        write_lane::<T, _>(&mut self.actuator, lane, &from.actuator);
        for (peg, impulse) in pegs.clone().zip(&from.peg_friction) {
            self.peg_friction[peg].set_lane(lane, impulse);
        }
        for (peg, impulse) in pegs.zip(&from.peg) {
            Real::set_lane(&mut self.peg[peg], lane, *impulse);
        }
        write_lane::<T, _>(&mut self.pair, lane, &from.pair);
        for ((axis, side), impulse) in stops.zip(&from.pair[self.pair.len()..]) {
            Real::set_lane(&mut self.stop[axis][side], lane, *impulse);
        }
    }
}
