use crate::spatial::{Stage, StageSolution};
use crate::stepper::Tally;

/// Works of a stage's impulses \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Works {
    /// Of sliding and rolling friction, never positive.
    friction: f64,
    actuator: f64,
    /// Without what actuators absorb.
    positive_actuator: f64,
}

impl Works {
    pub fn of(stage: &Stage, solution: &StageSolution) -> Self {
        let mut works = Self::default();
        for (i, (link, x)) in stage.links.iter().zip(&solution.twist).enumerate() {
            for end in 0..2 {
                let slip = x.velocity_at(&link.ground_arm(end));
                let (t, p) = (&link.tangent, &solution.friction[i][end]);
                works.friction += p.x * (t.x * slip.x + t.y * slip.y) + p.y * (t.x * slip.y - t.y * slip.x);
            }
            let rolling = &solution.rolling[i];
            works.friction += link.radius * (rolling.y * x.angular.x - rolling.x * x.angular.y);
        }
        for (rate, drive) in solution.rate.iter().flatten().zip(solution.drive.iter().flatten()) {
            works.actuator += drive * rate;
            works.positive_actuator += (drive * rate).max(0.0);
        }
        works
    }

    /// Adds the works to a tally, taken `weight` times.
    pub fn add_to(&self, tally: &mut Tally, weight: f64) {
        tally.friction_work += weight * self.friction;
        tally.actuator_work += weight * self.actuator;
        tally.positive_actuator_work += weight * self.positive_actuator;
    }
}
