//! The certificate of a stage's solution, computed from the stage's data and [`snake_core::judge`] only.
//!
//! It rebuilds the joint impulses from the momentum balance of one link after the other and reports the worst violation
//! of balance, joints and laws as a velocity. Kinematics are its own: velocities of points in the frame of the stage,
//! and momenta about the centre of mass.

use nalgebra::{Vector2, Vector3};
use snake_core::judge::{self, BalancedLink, ChainBalance, Mobility, worse};

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

/// Verifies `solution` as a solution of `stage`.
pub fn certify(stage: &Stage, solution: &StageSolution) -> Certificate {
    let mut certificate = Certificate::default();
    for (i, link) in stage.links.iter().enumerate() {
        for (slip, impulse) in slips(link, &solution.twist[i]).iter().zip(&solution.friction[i]) {
            let violation = judge::ellipse(&link.coulomb, slip, impulse, link.mass).squared.sqrt() / link.mass;
            certificate.law = worse(certificate.law, violation);
        }
    }
    verify_actuators(stage, solution, &mut certificate);
    verify_joints(stage, solution, &mut certificate);
    verify_balance(stage, solution, &mut certificate);
    certificate
}

/// Of D = clamp(wanted): a torque impulse moves a link's end by (L/2) D / Theta.
///
/// M_22_bar omega_J is, joint by joint, minus the moment about the joint of the momenta of the links before it,
/// relative to the rigid motion with the same total.
fn verify_actuators(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    let relative = relative_momenta(stage, solution);
    let (mut before, mut moment) = (Vector2::zeros(), 0.0);
    for (j, ((joint, link), momentum)) in stage.joints.iter().zip(&stage.links).zip(relative).enumerate() {
        let half = link.axial * link.half_length;
        moment += momentum.z - half.perp(&momentum.xy()) - 2.0 * half.perp(&before);
        before += momentum.xy();
        let rate = solution.twist[j + 1].z - solution.twist[j].z;
        let wanted = joint.drive - joint.stiffness * rate + stage.momentum_feedforward * moment;
        let violation = judge::clamp(solution.actuator[j], wanted, joint.limit) / (link.mass * link.half_length);
        certificate.law = worse(certificate.law, violation);
    }
}

/// Momenta of the links, about their CG, relative to the rigid motion with the same total momenta: velocity of the
/// centre of mass, and the angular momentum about it over the moment of inertia of the chain.
fn relative_momenta<'a>(stage: &'a Stage, solution: &'a StageSolution) -> impl Iterator<Item = Vector3<f64>> + 'a {
    let links = || stage.links.iter().zip(&solution.twist);
    let mass: f64 = stage.links.iter().map(|link| link.mass).sum();
    let centre = stage.links.iter().map(|link| link.arm * link.mass).sum::<Vector2<f64>>() / mass;
    let velocity = links().map(|(link, u)| u.xy() * link.mass).sum::<Vector2<f64>>() / mass;
    let (mut spin, mut inertia) = (0.0, 0.0);
    for (link, u) in links() {
        let arm = link.arm - centre;
        spin += link.mass * arm.perp(&(u.xy() - velocity)) + link.inertia * u.z;
        inertia += link.mass * arm.norm_squared() + link.inertia;
    }
    let rate = spin / inertia;
    links().map(move |(link, u)| {
        let rigid = velocity + left(link.arm - centre) * rate;
        ((u.xy() - rigid) * link.mass).push(link.inertia * (u.z - rate))
    })
}

fn verify_joints(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    for (links, twists) in stage.links.windows(2).zip(solution.twist.windows(2)) {
        let near = point_velocity(&links[0], &twists[0], links[0].half_length);
        let far = point_velocity(&links[1], &twists[1], -links[1].half_length);
        certificate.joint = worse(certificate.joint, (near - far).norm());
    }
}

fn verify_balance(stage: &Stage, solution: &StageSolution, certificate: &mut Certificate) {
    let mut balance = ChainBalance::new(0.0);
    let last = stage.links.len() - 1;
    for (i, link) in stage.links.iter().enumerate() {
        let StageLink { mass, inertia, half_length, .. } = *link;
        let (lateral, change) = (left(link.axial), solution.twist[i] - link.reference);
        let applied = applied_impulse(stage, solution, i);
        let mobility = Mobility::of(mass, inertia, half_length);
        let cg_offset = 0.0;
        let balanced = BalancedLink { mass, inertia, half_length, cg_offset, mobility, lateral, change, applied };
        balance.add(&balanced, i == last);
    }
    certificate.balance = balance.worst;
}

/// Coulomb and viscous friction and the actuators on link `i` as force and moment about its CG.
fn applied_impulse(stage: &Stage, solution: &StageSolution, i: usize) -> Vector3<f64> {
    let link = &stage.links[i];
    let slips = slips(link, &solution.twist[i]);
    let [front, rear] = [0, 1].map(|k| solution.friction[i][k] - link.viscous.component_mul(&slips[k]));
    let before = if i > 0 { solution.actuator[i - 1] } else { 0.0 };
    let after = solution.actuator.get(i).copied().unwrap_or(0.0);
    let force = link.axial * (front.x + rear.x) + left(link.axial) * (front.y + rear.y);
    force.push(link.lever * (front.y - rear.y) + before - after)
}

/// Slip velocities along and across the link at its front and its rear contact point (T 6.10).
fn slips(link: &StageLink, u: &Vector3<f64>) -> [Vector2<f64>; 2] {
    [link.lever, -link.lever].map(|along| {
        let velocity = point_velocity(link, u, along);
        Vector2::new(link.axial.dot(&velocity), left(link.axial).dot(&velocity))
    })
}

/// Velocity of the point of a link's centre line at the coordinate `along`, in the frame of the stage.
fn point_velocity(link: &StageLink, u: &Vector3<f64>, along: f64) -> Vector2<f64> {
    u.xy() + left(link.axial) * (along * u.z)
}

/// A vector turned to the left by a right angle.
fn left(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}
