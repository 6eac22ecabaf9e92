use crate::math::Real;
use crate::spatial::{Stage, StageSolution};
use crate::stepping::energy::Works;

/// Works of a stage's impulses; rolling friction counts as friction.
#[inline(always)]
pub fn works_of<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> Works<T> {
    let mut works = Works::none();
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
