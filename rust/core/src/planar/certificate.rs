//! The certificate of a stage's solution, computed from the stage's data and [`crate::judge`] only.
//!
//! For the convex problem of [`super::stage`] a velocity u and impulses (P, D) are optimal exactly when the equations
//! of motion balance, the joints hold, and every law holds. Fenchel's inequality turns the laws into one number, the
//! duality gap: the sum of `support_C(-gamma) + P . gamma` over friction, of `P_H (w . u + offset)` over contacts, and
//! of half the squared imbalance in the norm of M^-1. For admissible impulses, open or touching contacts and drives
//! that obey their law, all of which the other figures measure, it bounds the distance to the exact velocity:
//! |u - u*|_M^2 / 2 <= gap.

use nalgebra::{Vector2, Vector3};

use crate::judge::{self, BalancedLink, ChainBalance, Mobility, worse};
use crate::math::{Real, add_scaled};
use crate::rows::{FrictionRow, Row};
use crate::stepping::StageStop;

use super::stage::{Stage, StageLink, StageSolution};

/// Violations of a stage's equations; zero for the exact solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certificate<T = f64> {
    /// Worst imbalance of the equations of motion, as a velocity \[m/s\].
    pub balance: T,
    /// Worst joint velocity |W_J^T u| \[m/s\].
    pub joint: T,
    /// Worst |P - prox_C(P - m gamma)| / m over friction, contact and torque laws \[m/s\].
    pub law: T,
    /// Duality gap \[J\]: an upper bound on |u - u*|_M^2 / 2.
    pub gap: T,
}

impl<T: Real> Certificate<T> {
    /// The worst of all violations \[m/s\].
    #[inline(always)]
    pub fn residual(&self) -> T {
        worse(worse(self.balance, self.joint), self.law)
    }
}

/// Verifies `solution` as a solution of `stage`.
#[inline(always)]
pub fn certify<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> Certificate<T> {
    let zero = T::zero();
    let mut certificate = Certificate { balance: zero, joint: zero, law: zero, gap: zero };
    verify_chain(stage, solution, &mut certificate);
    for (row, &impulse) in stage.obstacle_friction.iter().zip(&solution.obstacle_friction) {
        verify_friction(row, &solution.contact, (stage, solution), impulse, &mut certificate);
    }
    for (row, &impulse) in stage.pair_friction.iter().zip(&solution.pair_friction) {
        verify_friction(row, &solution.pair, (stage, solution), impulse, &mut certificate);
    }
    let mass = |link: usize| stage.links[link].mass;
    let contacts = judge::rows(&stage.contacts, &solution.contact, &solution.twist, mass);
    let pairs = judge::rows(&stage.pairs, &solution.pair, &solution.twist, mass);
    for (violation, gap) in [contacts, pairs] {
        certificate.law = worse(certificate.law, violation);
        certificate.gap += gap;
    }
    certificate
}

/// Balance, joints, friction on the ground and actuators, from the head to the tail, and of what the robot can push.
#[inline(always)]
fn verify_chain<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, certificate: &mut Certificate<T>) {
    let (mut squared_friction, mut squared_joint) = (T::zero(), T::zero());
    let mut balance = ChainBalance::new(T::zero());
    let shares = stage.skin.map(|skin| skin.shares());
    let last = stage.chain() - 1;
    let mut contacts = stage.contacts.iter().zip(&solution.contact).peekable();
    for (i, link) in stage.links.iter().enumerate() {
        let StageLink { mass, inertia, half_length, cg_offset, .. } = *link;
        let mobility = Mobility::of(mass, inertia, half_length);
        let u = &solution.twist[i];
        let slip = link.heading.to_link(u.xy());
        let friction = if i > last {
            let twist = Vector3::new(slip.x, slip.y, u.z);
            judge::limit_surface(&stage.limit_surface(i), &twist, &solution.surface_impulse(i), mass, half_length)
        } else {
            judge::ground(&link.friction, shares, &slip, &solution.friction[i], mass)
        };
        squared_friction = worse(squared_friction, friction.squared * (mobility.force * mobility.force));
        certificate.gap += worse(T::zero(), friction.gap);
        if let (Some(&bound), Some(&spin)) = (stage.link_spins().get(i), solution.spin.get(i)) {
            certificate.law = worse(certificate.law, judge::turning(bound, spin, u.z, mass, half_length));
            certificate.gap += worse(T::zero(), spin * u.z + bound * u.z.abs());
        }
        if i < last {
            let (next, u_next) = (&stage.links[i + 1], &solution.twist[i + 1]);
            let (joint, rate) = (&stage.joints[i], u_next.z - u.z);
            let (tight, motor) = (joint.drive - joint.stiffness * rate, stage.motors.get(i));
            let motor_and_rate = motor.map(|motor| (motor, rate));
            let violation = judge::drive(solution.actuator[i], tight, joint.slack, joint.limit, motor_and_rate);
            certificate.law = worse(certificate.law, violation * mobility.torque);
            if let (Some(motor), Some(&gear)) = (motor, solution.gear.get(i)) {
                certificate.law = worse(certificate.law, judge::turning(motor.friction, gear, rate, mass, half_length));
                certificate.gap += worse(T::zero(), gear * rate + motor.friction * rate.abs());
            }
            if let (Some(stop), Some(impulses)) = (stage.stops.get(i), solution.stop.get(i)) {
                verify_stop(stop, mass, u_next.z - u.z, impulses, certificate);
            }
            let near = end_velocity(link, u, T::splat(1.0));
            let far = end_velocity(next, u_next, T::splat(-1.0));
            let (x, y) = (near.x - far.x, near.y - far.y);
            squared_joint = worse(squared_joint, x * x + y * y);
        }
        let mut applied = applied_impulse(stage, solution, i);
        while let Some((contact, &impulse)) = contacts.next_if(|(contact, _)| contact.link == i) {
            applied = add_scaled(&applied, &contact.direction, impulse);
        }
        let change = Vector3::new(u.x - link.reference.x, u.y - link.reference.y, u.z - link.reference.z);
        let lateral = link.heading.lateral();
        let balanced = BalancedLink { mass, inertia, half_length, cg_offset, mobility, lateral, change, applied };
        balance.add(&balanced, i >= last);
    }
    certificate.law = worse(certificate.law, squared_friction.sqrt());
    certificate.joint = squared_joint.sqrt();
    certificate.balance = balance.worst;
    certificate.gap += balance.energy;
}

/// Both stops of a joint at its rate, behind a link of mass `mass`.
#[inline(always)]
fn verify_stop<T: Real>(stop: &StageStop<T>, mass: T, rate: T, impulses: &[T; 2], certificate: &mut Certificate<T>) {
    let velocity = stop.lever * rate;
    let openings = [stop.offset[0] - velocity, stop.offset[1] + velocity];
    for (opening, &impulse) in openings.into_iter().zip(impulses) {
        certificate.law = worse(certificate.law, judge::half_line(impulse, opening, mass) / mass);
        certificate.gap += worse(T::zero(), impulse * opening);
    }
}

/// Coulomb's law at a contact with the bound of the solution's own `normal` impulse, whatever bound the solver held.
#[inline(always)]
fn verify_friction<R: Row<Vector3<T>, T>, T: Real>(
    row: &FrictionRow<R, T>,
    normal: &[T],
    (stage, solution): (&Stage<T>, &StageSolution<T>),
    impulse: T,
    certificate: &mut Certificate<T>,
) {
    let slip = row.along.rate(&solution.twist);
    let bound = row.coefficient * normal[row.normal];
    let mass = stage.links[row.along.first_link()].mass;
    let violation = judge::clamp(impulse, impulse - mass * slip, bound);
    certificate.law = worse(certificate.law, violation / mass);
    certificate.gap += worse(T::zero(), impulse * slip + bound * slip.abs());
}

/// Velocity of a link's end; `side` is 1 for the far joint, -1 for the near one.
#[inline(always)]
fn end_velocity<T: Real>(link: &StageLink<T>, u: &Vector3<T>, side: T) -> Vector2<T> {
    let swing = (side * link.half_length + link.cg_offset) * u.z;
    Vector2::new(u.x - link.heading.sin * swing, u.y + link.heading.cos * swing)
}

/// Impulses of everything but joints and contacts with obstacles on link `i` as (x, y, moment about the CG).
#[inline(always)]
fn applied_impulse<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, i: usize) -> Vector3<T> {
    let mut applied = own_impulse(stage, solution, i);
    for (friction, &impulse) in stage.obstacle_friction.iter().zip(&solution.obstacle_friction) {
        if friction.along.link == i {
            applied = add_scaled(&applied, &friction.along.direction, impulse);
        }
    }
    let friction = stage.pair_friction.iter().map(|row| &row.along).zip(&solution.pair_friction);
    for (pair, &impulse) in stage.pairs.iter().zip(&solution.pair).chain(friction) {
        for (_, w) in pair.links.iter().zip(&pair.direction).filter(|(link, _)| **link == i) {
            applied = add_scaled(&applied, w, impulse);
        }
    }
    applied
}

/// Impulse of a joint's actuator, motor and stops, positive driving phi upwards \[N m s\].
#[inline(always)]
fn joint_impulse<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, joint: usize) -> T {
    let mut impulse = solution.actuator[joint];
    if let (Some(stop), Some([upper, lower])) = (stage.stops.get(joint), solution.stop.get(joint)) {
        impulse += stop.lever * (*lower - *upper);
    }
    if let (Some(motor), Some(gear)) = (stage.motors.get(joint), solution.gear.get(joint)) {
        let (first, second) = (&solution.twist[joint], &solution.twist[joint + 1]);
        impulse += judge::motor_impulse(motor, *gear, second.z - first.z);
    }
    impulse
}

/// Impulses of friction and joints on link `i` as (x, y, moment about the CG).
#[inline(always)]
fn own_impulse<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, i: usize) -> Vector3<T> {
    let friction = stage.links[i].heading.to_world(solution.friction[i]);
    let mut moment = solution.spin.get(i).copied().unwrap_or(T::zero());
    if (1..stage.chain()).contains(&i) {
        moment += joint_impulse(stage, solution, i - 1);
    }
    if i < solution.actuator.len() {
        moment -= joint_impulse(stage, solution, i);
    }
    Vector3::new(friction.x, friction.y, moment)
}
