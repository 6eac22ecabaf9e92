use crate::math::Real;
use crate::spatial::{Stage, StageSolution};
use crate::stepping::EnergyLedger;

/// Work of a stage's impulses; rolling friction counts as friction.
#[inline(always)]
pub fn work_of<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> EnergyLedger<T> {
    let mut total = EnergyLedger::zero();
    let chain = stage.chain();
    for (i, (link, x)) in stage.links[..chain].iter().zip(&solution.twist).enumerate() {
        for end in 0..2 {
            let slip = x.velocity_at(&link.ground_arm(end));
            let (t, p) = (&link.tangent, &solution.friction[i][end]);
            total.friction += p.x * (t.x * slip.x + t.y * slip.y) + p.y * (t.x * slip.y - t.y * slip.x);
        }
        let rolling = &solution.rolling[i];
        total.friction += link.radius * (rolling.y * x.angular.x - rolling.x * x.angular.y);
    }
    for (p, x) in solution.surface.iter().zip(&solution.twist[chain..]) {
        total.friction += p.x * x.linear.x + p.y * x.linear.y + p.z * x.angular.z;
    }
    for ((row, p), contact) in stage.obstacle_friction.iter().zip(&solution.obstacle_friction).zip(&stage.contacts) {
        let [along, across] = &row.tangents;
        let x = &solution.twist[contact.link];
        total.friction += p.x * along.dot(x) + p.y * across.dot(x);
    }
    for ((rate, gear), motor) in solution.rate.iter().flatten().zip(&solution.gear).zip(&stage.motors) {
        total.friction += motor.gear_work(*gear, *rate);
    }
    for (j, (rate, drive)) in solution.rate.iter().zip(&solution.actuator).enumerate() {
        for axis in 0..2 {
            total.add_drive(drive[axis], rate[axis], stage.motors.get(2 * j + axis));
        }
    }
    total
}
