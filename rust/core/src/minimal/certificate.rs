//! The judge of a stage's solution; no solver uses this code.
//!
//! It rebuilds the joint impulses from the momentum balance of one link after the other and reports the worst
//! violation of balance, joints and laws as a velocity.

use nalgebra::{Vector2, Vector3};

use crate::laws::{ConvexSet, Disc};
use crate::math::judge::{ratio, worse};

use super::motion::cross;
use super::stage::{Stage, StageLink, StageSolution};

/// Violations of a stage's equations; zero for the exact solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Certificate {
    /// Worst imbalance of the equations of motion, as a velocity \[m/s\].
    pub balance: f64,
    /// Worst velocity at which a joint opens \[m/s\].
    pub joint: f64,
    /// Worst violation of a friction or drive law, as a velocity \[m/s\].
    pub law: f64,
}

impl Certificate {
    /// The worst of all violations \[m/s\]; NaN if any is.
    pub fn residual(&self) -> f64 {
        worse(worse(self.balance, self.joint), self.law)
    }
}

/// Judges `solution` as a solution of `stage`.
pub fn certify(stage: &Stage, solution: &StageSolution) -> Certificate {
    let mut certificate = Certificate::default();
    for (i, link) in stage.links.iter().enumerate() {
        for (slip, impulse) in link.slip(&solution.twist[i]).iter().zip(&solution.friction[i]) {
            certificate.law = worse(certificate.law, friction_violation(link, slip, impulse));
        }
    }
    judge_drives(stage, solution, &mut certificate);
    judge_joints(stage, solution, &mut certificate);
    judge_balance(stage, solution, &mut certificate);
    certificate
}

/// Of -gamma in N_C(P), in coordinates in which the ellipse is the unit disc.
fn friction_violation(link: &StageLink, slip: &Vector2<f64>, impulse: &Vector2<f64>) -> f64 {
    let a = link.coulomb;
    let largest = a.max();
    let p = impulse.zip_map(&a, ratio);
    let outside = (impulse - p.component_mul(&a)).norm();
    if largest == 0.0 {
        return outside / link.mass;
    }
    let rate = link.mass / (largest * largest);
    let nearest = Disc { radius: 1.0 }.project(p - a.component_mul(slip) * rate);
    ((p - nearest).norm() * largest + outside) / link.mass
}

/// Of D = clamp(wanted): a torque impulse moves a link's end by (L/2) D / Theta.
///
/// M_22_bar omega_J is, joint by joint, minus the moment about the joint of the momenta of the links before it,
/// relative to the rigid motion with the same total.
fn judge_drives(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    let mean = stage.mean_motion(&stage.composite(), &solution.twist);
    let (mut before, mut moment) = (Vector2::zeros(), 0.0);
    for (j, joint) in stage.joints.iter().enumerate() {
        let link = &stage.links[j];
        let half = link.axial * link.half_length;
        let momentum = Stage::relative_momentum(link, &solution.twist[j], &mean);
        moment += momentum.z - cross(half, momentum.xy()) - 2.0 * cross(half, before);
        before += momentum.xy();
        let rate = solution.twist[j + 1].z - solution.twist[j].z;
        let wanted = joint.drive - joint.stiffness * rate + stage.following * moment;
        let law = wanted.max(-joint.limit).min(joint.limit);
        let violation = (solution.drive[j] - law).abs() / (link.mass * link.half_length);
        certificate.law = worse(certificate.law, violation);
    }
}

fn judge_joints(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    for (links, twists) in stage.links.windows(2).zip(solution.twist.windows(2)) {
        let near = twists[0].xy() + links[0].swing() * twists[0].z;
        let far = twists[1].xy() - links[1].swing() * twists[1].z;
        certificate.joint = worse(certificate.joint, (near - far).norm());
    }
}

/// The joint impulses that balance the linear momentum of links 1..i in turn leave on each link a moment that must
/// vanish, and on the last one a force that must vanish.
fn judge_balance(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    let mut from_before = Vector2::zeros();
    let last = stage.links.len() - 1;
    for (i, link) in stage.links.iter().enumerate() {
        let applied = applied_impulse(stage, solution, i);
        let change = solution.twist[i] - link.reference;
        let left = applied.xy() + from_before - change.xy() * link.mass;
        let to_next = if i == last { Vector2::zeros() } else { left };
        let swing = link.swing();
        let moment = applied.z - swing.dot(&(from_before + to_next)) - link.inertia * change.z;
        certificate.balance = worse(certificate.balance, moment.abs() / link.inertia * link.half_length);
        if i == last {
            certificate.balance = worse(certificate.balance, left.norm() / link.mass);
        }
        from_before = to_next;
    }
}

/// Coulomb and viscous friction and the drives on link `i` as force and moment about its CG.
fn applied_impulse(stage: &Stage, solution: &StageSolution, i: usize) -> Vector3<f64> {
    let link = &stage.links[i];
    let slips = link.slip(&solution.twist[i]);
    let [front, rear] = [0, 1].map(|k| solution.friction[i][k] - link.viscous.component_mul(&slips[k]));
    let before = if i > 0 { solution.drive[i - 1] } else { 0.0 };
    let after = solution.drive.get(i).copied().unwrap_or(0.0);
    link.to_world(front + rear).push(link.lever * (front.y - rear.y) + before - after)
}
