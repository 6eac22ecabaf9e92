use crate::math::Real;
use crate::rows::Row;
use crate::stepping::EnergyLedger;

use super::{Stage, StageSolution};

/// Work of a stage's impulses.
#[inline(always)]
pub fn work_of<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> EnergyLedger<T> {
    let mut work = EnergyLedger::zero();
    let StageSolution { twist, friction, actuator, .. } = solution;
    for ((link, u), impulse) in stage.links.iter().zip(twist).zip(friction) {
        let slip = link.heading.to_link(u.xy());
        work.friction += impulse.x * slip.x + impulse.y * slip.y;
    }
    for (impulse, u) in solution.spin.iter().zip(twist) {
        work.friction += *impulse * u.z;
    }
    for (row, impulse) in stage.obstacle_friction.iter().zip(&solution.obstacle_friction) {
        work.friction += *impulse * row.along.rate(twist);
    }
    for (row, impulse) in stage.pair_friction.iter().zip(&solution.pair_friction) {
        work.friction += *impulse * row.along.rate(twist);
    }
    for (j, (impulse, motor)) in solution.gear.iter().zip(&stage.motors).enumerate() {
        work.friction += motor.gear_work(*impulse, twist[j + 1].z - twist[j].z);
    }
    for (j, impulse) in actuator.iter().enumerate() {
        work.add_drive(*impulse, twist[j + 1].z - twist[j].z, stage.motors.get(j));
    }
    work
}
