//! What friction and actuators do over a stage.

use crate::math::Real;
use crate::planar::{Stage, StageSolution};

/// Work of friction and of the actuators over a stage \[J\].
#[derive(Debug, Clone, Copy)]
pub struct Works<T> {
    pub friction: T,
    pub actuator: T,
    pub positive_actuator: T,
}

impl<T: Real> Works<T> {
    /// Takes the works of `lane` over from one robot's.
    pub fn set_lane(&mut self, lane: usize, one: &Works<f64>) {
        self.friction.set_lane(lane, one.friction);
        self.actuator.set_lane(lane, one.actuator);
        self.positive_actuator.set_lane(lane, one.positive_actuator);
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
