//! The certificate of a stage's solution, computed from the stage's data and [`crate::judge`] only.
//!
//! For the convex problem of [`super::stage`] a velocity u and impulses (P, D) are optimal exactly when the equations
//! of motion balance, the joints hold, and every law holds. Fenchel's inequality turns the laws into one number, the
//! duality gap: the sum of `support_C(-gamma) + P . gamma` over friction, of `P_H (w . u + offset)` over contacts, and
//! of half the squared imbalance in the norm of M^-1. For admissible impulses, open or touching contacts and drives
//! that obey their law, all of which the other figures measure, it bounds the distance to the exact velocity:
//! |u - u*|_M^2 / 2 <= gap.

use nalgebra::{Vector2, Vector3};

use crate::judge::{self, BalancedLink, ChainBalance, DiscViolation, worse};
use crate::math::{Real, add_scaled};

use super::stage::{Stage, StageContact, StageContactFriction, StageJoint, StageLink, StagePair, StageSolution};

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
    for (i, link) in stage.links.iter().enumerate() {
        verify_friction(link, &solution.twist[i], &solution.friction[i], &mut certificate);
    }
    for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
        let link = &stage.links[contact.link];
        verify_contact(contact, link, &solution.twist[contact.link], impulse, &mut certificate);
    }
    for (friction, &impulse) in stage.contact_friction.iter().zip(&solution.contact_friction) {
        verify_contact_friction(friction, stage, solution, impulse, &mut certificate);
    }
    for (pair, &impulse) in stage.pairs.iter().zip(&solution.pair) {
        verify_pair(pair, stage, solution, impulse, &mut certificate);
    }
    let mut squared_joint = zero;
    for (j, joint) in stage.joints.iter().enumerate() {
        let rate = solution.twist[j + 1].z - solution.twist[j].z;
        verify_actuator(joint, &stage.links[j], rate, solution.actuator[j], &mut certificate);
        let near = end_velocity(&stage.links[j], &solution.twist[j], T::splat(1.0));
        let far = end_velocity(&stage.links[j + 1], &solution.twist[j + 1], T::splat(-1.0));
        let (x, y) = (near.x - far.x, near.y - far.y);
        squared_joint = worse(squared_joint, x * x + y * y);
    }
    certificate.joint = squared_joint.sqrt();
    verify_balance(stage, solution, &mut certificate);
    certificate
}

#[inline(always)]
fn verify_friction<T: Real>(
    link: &StageLink<T>,
    u: &Vector3<T>,
    impulse: &Vector2<T>,
    certificate: &mut Certificate<T>,
) {
    let slip = link.heading.to_link(u.xy());
    let DiscViolation { law, gap } = judge::disc(&link.friction, &slip, impulse, link.mass);
    certificate.law = worse(certificate.law, law / link.mass);
    certificate.gap += worse(T::zero(), gap);
}

#[inline(always)]
fn verify_contact<T: Real>(
    contact: &StageContact<T>,
    link: &StageLink<T>,
    u: &Vector3<T>,
    impulse: T,
    certificate: &mut Certificate<T>,
) {
    let w = &contact.direction;
    let opening = w.x * u.x + w.y * u.y + w.z * u.z + contact.offset;
    certificate.law = worse(certificate.law, judge::half_line(impulse, opening, link.mass));
    certificate.gap += worse(T::zero(), impulse * opening);
}

/// Coulomb's law at an obstacle with the bound of the solution's own normal impulse, whatever bound the solver held.
#[inline(always)]
fn verify_contact_friction<T: Real>(
    friction: &StageContactFriction<T>,
    stage: &Stage<T>,
    solution: &StageSolution<T>,
    impulse: T,
    certificate: &mut Certificate<T>,
) {
    let (w, u) = (&friction.direction, &solution.twist[friction.link]);
    let slip = w.x * u.x + w.y * u.y + w.z * u.z;
    let bound = friction.coefficient * solution.contact[friction.contact];
    let mass = stage.links[friction.link].mass;
    let violation = judge::clamp(impulse, impulse - mass * slip, bound);
    certificate.law = worse(certificate.law, violation / mass);
    certificate.gap += worse(T::zero(), impulse * slip + bound * slip.abs());
}

#[inline(always)]
fn verify_pair<T: Real>(
    pair: &StagePair<T>,
    stage: &Stage<T>,
    solution: &StageSolution<T>,
    impulse: T,
    certificate: &mut Certificate<T>,
) {
    let mut opening = pair.offset;
    for (link, w) in pair.links.into_iter().zip(&pair.direction) {
        let u = &solution.twist[link];
        opening += w.x * u.x + w.y * u.y + w.z * u.z;
    }
    let mass = stage.links[pair.links[0]].mass;
    certificate.law = worse(certificate.law, judge::half_line(impulse, opening, mass));
    certificate.gap += worse(T::zero(), impulse * opening);
}

#[inline(always)]
fn verify_actuator<T: Real>(
    joint: &StageJoint<T>,
    link: &StageLink<T>,
    rate: T,
    drive: T,
    certificate: &mut Certificate<T>,
) {
    let tight = joint.drive - joint.stiffness * rate;
    let violation = judge::clamp_with_backlash(drive, tight, joint.slack, joint.limit);
    certificate.law = worse(certificate.law, violation / (link.mass * link.half_length));
}

/// Velocity of a link's end; `side` is 1 for the far joint, -1 for the near one.
#[inline(always)]
fn end_velocity<T: Real>(link: &StageLink<T>, u: &Vector3<T>, side: T) -> Vector2<T> {
    let swing = side * link.half_length * u.z;
    Vector2::new(u.x - link.heading.sin * swing, u.y + link.heading.cos * swing)
}

#[inline(always)]
fn verify_balance<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, certificate: &mut Certificate<T>) {
    let mut balance = ChainBalance::new(certificate.gap);
    let last = stage.links.len() - 1;
    let mut contacts = stage.contacts.iter().zip(&solution.contact).peekable();
    for (i, link) in stage.links.iter().enumerate() {
        let (u, reference) = (&solution.twist[i], &link.reference);
        let mut applied = applied_impulse(stage, solution, i);
        while let Some((contact, &impulse)) = contacts.next_if(|(contact, _)| contact.link == i) {
            applied = add_scaled(&applied, &contact.direction, impulse);
        }
        for (friction, &impulse) in stage.contact_friction.iter().zip(&solution.contact_friction) {
            if friction.link == i {
                let w = &friction.direction;
                applied = Vector3::new(applied.x + w.x * impulse, applied.y + w.y * impulse, applied.z + w.z * impulse);
            }
        }
        for (pair, &impulse) in stage.pairs.iter().zip(&solution.pair) {
            for (_, w) in pair.links.iter().zip(&pair.direction).filter(|(link, _)| **link == i) {
                applied = add_scaled(&applied, w, impulse);
            }
        }
        let change = Vector3::new(u.x - reference.x, u.y - reference.y, u.z - reference.z);
        let StageLink { mass, inertia, half_length, .. } = *link;
        let lateral = link.heading.lateral();
        balance.add(&BalancedLink { mass, inertia, half_length, lateral, change, applied }, i == last);
    }
    (certificate.balance, certificate.gap) = (balance.worst, balance.energy);
}

/// Friction and actuator impulses on link `i` as (x, y, moment about the CG).
#[inline(always)]
fn applied_impulse<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, i: usize) -> Vector3<T> {
    let friction = stage.links[i].heading.to_world(solution.friction[i]);
    let mut moment = T::zero();
    if i > 0 {
        moment += solution.actuator[i - 1];
    }
    if i < solution.actuator.len() {
        moment -= solution.actuator[i];
    }
    Vector3::new(friction.x, friction.y, moment)
}
