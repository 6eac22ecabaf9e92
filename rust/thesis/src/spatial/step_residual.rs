//! Residual of a solution of a step; shares no code with the solver.

use snake_core::laws::{ConvexSet, HalfLine};
use snake_core::spatial::StackedTwist;

use super::step::{GroundImpulse, Step, StepGround, StepSolution};

/// The worst violation of any law of a step, as a velocity \[m/s\]; rotations count with the radius of gyration.
///
/// A law -gamma in N_C(P) holds exactly if P = prox_C(P - m gamma) (T 4.88); the distance between the two sides over
/// the mass m of the link is how far it is from holding.
pub fn step_residual(step: &Step, solution: &StepSolution) -> f64 {
    let contacts = step.ground.iter().zip(&solution.ground).map(|(contact, impulse)| {
        let u = &solution.twist[contact.link];
        ground_error(step, contact, impulse, u, mass(step, contact.link))
    });
    let pegs = step.pegs.iter().zip(&solution.peg).map(|(contact, &impulse)| {
        let mass = mass(step, contact.link);
        let opening = contact.direction.dot(&solution.twist[contact.link]);
        (impulse - HalfLine.project(impulse - mass * opening)).abs() / mass
    });
    contacts.chain(pegs).chain(joint_errors(step, solution)).chain(momentum_errors(step, solution)).fold(0.0, f64::max)
}

fn mass(step: &Step, link: usize) -> f64 {
    1.0 / step.links[link].inverse_mass.x
}

fn ground_error(step: &Step, contact: &StepGround, impulse: &GroundImpulse, u: &StackedTwist, mass: f64) -> f64 {
    let GroundImpulse { normal, tangent, rolling } = *impulse;
    let rows = &contact.rows;
    let apart = (normal - HalfLine.project(normal - mass * rows.normal.dot(u))).abs();
    let slip = tangent - step.friction_set(normal).project(tangent - rows.tangent.tr_mul(u) * mass);
    let roll = rolling - step.rolling_set(normal).project(rolling - rows.rolling.tr_mul(u) * mass);
    apart.max(slip.norm()).max(roll.norm()) / mass
}

/// W_J^T u_E = 0, the rotational row times a length of 1 m.
fn joint_errors<'a>(step: &'a Step, solution: &'a StepSolution) -> impl Iterator<Item = f64> + 'a {
    let pairs = solution.twist.windows(2);
    step.joints.iter().zip(pairs).map(|(rows, u)| (rows.near.tr_mul(&u[0]) + rows.far.tr_mul(&u[1])).amax())
}

/// u_E against the velocity that all impulses together give (T 4.112), link by link.
fn momentum_errors<'a>(step: &'a Step, solution: &'a StepSolution) -> impl Iterator<Item = f64> + 'a {
    (0..step.links.len()).map(move |i| {
        let link = &step.links[i];
        let on_ground = step.ground.iter().zip(&solution.ground).filter(|(contact, _)| contact.link == i);
        let at_pegs = step.pegs.iter().zip(&solution.peg).filter(|(contact, _)| contact.link == i);
        let mut impulse = on_ground.map(|(contact, impulse)| impulse.on_link(&contact.rows)).sum::<StackedTwist>();
        impulse += at_pegs.map(|(contact, impulse)| contact.direction * *impulse).sum::<StackedTwist>();
        if let Some(rows) = step.joints.get(i) {
            impulse += rows.near * solution.joint[i];
        }
        if i > 0 {
            impulse += step.joints[i - 1].far * solution.joint[i - 1];
        }
        let error = solution.twist[i] - link.reference - link.inverse_mass.component_mul(&impulse);
        let gyration = (link.inverse_mass.x / link.inverse_mass[3]).sqrt();
        error.fixed_rows::<3>(0).norm().max(gyration * error.fixed_rows::<3>(3).norm())
    })
}
