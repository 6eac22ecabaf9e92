//! The judge of a stage's solution; no solver uses this code.
//!
//! For the convex problem of [`super::stage`] a velocity u and impulses (P, D) are optimal exactly
//! when the equations of motion balance, the joints hold, and every law holds. Fenchel's inequality
//! turns the laws into one number, the duality gap: the sum of `support_C(-gamma) + P . gamma` over
//! friction, of `P_H (w . u + offset)` over contacts, and of half the squared imbalance in the norm of
//! M^-1. It bounds the squared distance to the exact velocity: |u - u*|_M^2 / 2 <= gap.

use nalgebra::Vector2;

use crate::laws::{ConvexSet, Ellipse, Interval, NonNegative};

use super::{Stage, StageContact, StageJoint, StageLink, StageSolution, Twist};

/// Violations of a stage's equations; zero for the exact solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Certificate {
    /// Worst imbalance of the equations of motion, as a velocity \[m/s\].
    pub balance: f64,
    /// Worst joint velocity |W_J^T u| \[m/s\].
    pub joint: f64,
    /// Worst |P - prox_C(P - m gamma)| / m over friction, contact and torque laws \[m/s\].
    pub law: f64,
    /// Duality gap \[J\]: an upper bound on |u - u*|_M^2 / 2.
    pub gap: f64,
}

impl Certificate {
    /// The worst of all violations \[m/s\].
    pub fn residual(&self) -> f64 {
        self.balance.max(self.joint).max(self.law)
    }
}

/// Judges `solution` as a solution of `stage`.
pub fn certify(stage: &Stage, solution: &StageSolution) -> Certificate {
    let mut certificate = Certificate::default();
    for (i, link) in stage.links.iter().enumerate() {
        judge_friction(link, &solution.twist[i], solution.friction[i], &mut certificate);
    }
    for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
        judge_contact(contact, &stage.links[contact.link], &solution.twist[contact.link], impulse, &mut certificate);
    }
    for (j, joint) in stage.joints.iter().enumerate() {
        let pair = [&stage.links[j], &stage.links[j + 1]];
        let twist = [&solution.twist[j], &solution.twist[j + 1]];
        certificate.joint = certificate.joint.max(joint_velocity(pair, twist).norm());
        judge_drive(joint, pair[0], twist[1].z - twist[0].z, solution.drive[j], &mut certificate);
    }
    judge_balance(stage, solution, &mut certificate);
    certificate
}

fn judge_friction(link: &StageLink, u: &Twist, impulse: Vector2<f64>, certificate: &mut Certificate) {
    let set = Ellipse { axes: link.friction };
    let slip = link.heading.to_link(u.xy());
    let nearest = set.project(impulse - slip * link.mass);
    certificate.law = certificate.law.max((impulse - nearest).norm() / link.mass);
    certificate.gap += (set.support(-slip) + impulse.dot(&slip)).max(0.0);
}

fn judge_contact(contact: &StageContact, link: &StageLink, u: &Twist, impulse: f64, certificate: &mut Certificate) {
    let opening = contact.direction.dot(u) + contact.offset;
    let nearest = NonNegative.project(impulse - link.mass * opening);
    certificate.law = certificate.law.max((impulse - nearest).abs() / link.mass);
    certificate.gap += (impulse * opening).max(0.0);
}

fn judge_drive(joint: &StageJoint, link: &StageLink, rate: f64, drive: f64, certificate: &mut Certificate) {
    let law = Interval { limit: joint.limit }.project(joint.drive - joint.stiffness * rate);
    certificate.law = certificate.law.max((drive - law).abs() / (link.mass * link.half_length));
}

/// W_J^T u of one joint: velocity of the near link's far end minus that of the far link's near end.
fn joint_velocity(links: [&StageLink; 2], twist: [&Twist; 2]) -> Vector2<f64> {
    let end = |k: usize, side: f64| twist[k].xy() + links[k].heading.lateral() * (side * links[k].half_length * twist[k].z);
    end(0, 1.0) - end(1, -1.0)
}

/// The joint impulses that balance the linear momentum of links 1..i in turn leave, on each link, a
/// moment that must vanish, and on the last one a force that must vanish.
fn judge_balance(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    let mut from_before: Vector2<f64> = Vector2::zeros();
    let last = stage.links.len() - 1;
    for (i, link) in stage.links.iter().enumerate() {
        let applied = applied_impulse(stage, solution, i);
        let change = solution.twist[i] - link.reference;
        let to_next = applied.xy() + from_before - change.xy() * link.mass;
        let (to_next, unbalanced) = if i == last { (Vector2::zeros(), to_next) } else { (to_next, Vector2::zeros()) };
        let arm = link.heading.lateral() * link.half_length;
        let moment = applied.z - arm.dot(&(from_before + to_next)) - link.inertia * change.z;
        certificate.balance = certificate.balance.max(unbalanced.norm() / link.mass);
        certificate.balance = certificate.balance.max(moment.abs() / link.inertia * link.half_length);
        certificate.gap += 0.5 * (unbalanced.norm_squared() / link.mass + moment * moment / link.inertia);
        from_before = to_next;
    }
}

/// Friction, contact and actuator impulses on link `i` as (x, y, moment about the CG).
fn applied_impulse(stage: &Stage, solution: &StageSolution, i: usize) -> Twist {
    let friction = stage.links[i].heading.to_world(solution.friction[i]);
    let contacts = stage.contacts.iter().zip(&solution.contact).filter(|(contact, _)| contact.link == i);
    let pushed: Twist = contacts.map(|(contact, impulse)| contact.direction * *impulse).sum();
    let before = if i > 0 { solution.drive[i - 1] } else { 0.0 };
    let after = solution.drive.get(i).copied().unwrap_or(0.0);
    pushed + Twist::new(friction.x, friction.y, before - after)
}
