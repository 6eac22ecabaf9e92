use crate::math::Real;
use crate::spatial::{Stage, StageSolution};
use crate::stepper::Tally;

/// Works of a stage's impulses \[J\].
#[derive(Debug, Clone, Copy)]
pub struct Works<T> {
    /// Of sliding and rolling friction, never positive.
    pub friction: T,
    pub actuator: T,
    /// Without what actuators absorb.
    pub positive_actuator: T,
}

impl<T: Real> Works<T> {
    pub fn none() -> Self {
        Self { friction: T::zero(), actuator: T::zero(), positive_actuator: T::zero() }
    }

    #[inline(always)]
    pub fn of(stage: &Stage<T>, solution: &StageSolution<T>) -> Self {
        let mut works = Self::none();
        for (i, (link, x)) in stage.links.iter().zip(&solution.twist).enumerate() {
            for end in 0..2 {
                let slip = x.velocity_at(&link.ground_arm(end));
                let (t, p) = (&link.tangent, &solution.friction[i][end]);
                works.friction += p.x * (t.x * slip.x + t.y * slip.y) + p.y * (t.x * slip.y - t.y * slip.x);
            }
            let rolling = &solution.rolling[i];
            works.friction += link.radius * (rolling.y * x.angular.x - rolling.x * x.angular.y);
        }
        for (rate, drive) in solution.rate.iter().zip(&solution.drive) {
            for axis in 0..2 {
                let work = drive[axis] * rate[axis];
                works.actuator += work;
                works.positive_actuator += work.max(T::zero());
            }
        }
        works
    }

    /// Takes other works over in the given lanes.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        self.friction = T::select(lanes, other.friction, self.friction);
        self.actuator = T::select(lanes, other.actuator, self.actuator);
        self.positive_actuator = T::select(lanes, other.positive_actuator, self.positive_actuator);
    }

    /// Adds one robot's works to its tally, taken `weight` times.
    pub fn add_lane_to(&self, lane: usize, tally: &mut Tally, weight: f64) {
        tally.friction_work += weight * self.friction.lane(lane);
        tally.actuator_work += weight * self.actuator.lane(lane);
        tally.positive_actuator_work += weight * self.positive_actuator.lane(lane);
    }
}
