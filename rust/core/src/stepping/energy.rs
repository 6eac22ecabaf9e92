//! What friction and actuators do over a stage.

use crate::math::Real;
use crate::planar::{Stage, StageSolution};

/// Work of friction and of the actuators over a stage \[J\].
#[derive(Debug, Clone, Copy)]
pub struct Works<T> {
    /// Never positive.
    pub friction: T,
    pub actuator: T,
    /// Without what actuators absorb.
    pub positive_actuator: T,
}

impl<T: Real> Works<T> {
    /// Takes the works of `lane` over from one robot's.
    pub fn set_lane(&mut self, lane: usize, one: &Works<f64>) {
        self.friction.set_lane(lane, one.friction);
        self.actuator.set_lane(lane, one.actuator);
        self.positive_actuator.set_lane(lane, one.positive_actuator);
    }

    /// Takes other works over in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        self.friction = T::select(lanes, other.friction, self.friction);
        self.actuator = T::select(lanes, other.actuator, self.actuator);
        self.positive_actuator = T::select(lanes, other.positive_actuator, self.positive_actuator);
    }

    pub fn none() -> Self {
        Self { friction: T::zero(), actuator: T::zero(), positive_actuator: T::zero() }
    }

    #[inline(always)]
    pub fn of(stage: &Stage<T>, solution: &StageSolution<T>) -> Self {
        let mut works = Self::none();
        let StageSolution { twist, friction, drive, .. } = solution;
        for ((link, u), impulse) in stage.links.iter().zip(twist).zip(friction) {
            let slip = link.heading.to_link(u.xy());
            works.friction += impulse.x * slip.x + impulse.y * slip.y;
        }
        for (j, drive) in drive.iter().enumerate() {
            let work = *drive * (twist[j + 1].z - twist[j].z);
            works.actuator += work;
            works.positive_actuator += work.max(T::zero());
        }
        works
    }
}
