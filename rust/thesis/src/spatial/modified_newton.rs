//! Algorithm 4.2, the Modified Newton iteration (T 4.6.2).
//!
//! It is a projected Jacobi iteration on the contact impulses with the joint impulses eliminated exactly.

use nalgebra::{Matrix4, Vector4, Vector6};
use snake_core::laws::{ConvexSet, HalfLine};
use snake_core::spatial::StackedTwist;

use super::JointRows;
use super::step::{Step, StepSolution};

/// r_N, r_T, r_V and r_H of (T 4.113)-(T 4.116).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPenalties {
    pub normal: f64,
    pub friction: f64,
    pub rolling: f64,
    pub peg: f64,
}

/// Workspace of the iteration.
#[derive(Debug, Clone)]
pub struct ModifiedNewton {
    /// Blocks of the factorised W_J^T M^-1 W_J: inverse pivots and couplings to the next joint.
    inverse_pivot: Vec<Matrix4<f64>>,
    coupling: Vec<Matrix4<f64>>,
    /// u_R + M^-1 S: the velocity without joints.
    free: Vec<StackedTwist>,
}

impl ModifiedNewton {
    pub fn new(links: usize) -> Self {
        Self {
            inverse_pivot: vec![Matrix4::zeros(); links - 1],
            coupling: vec![Matrix4::zeros(); links - 1],
            free: vec![StackedTwist::zeros(); links],
        }
    }

    /// Iterates from the impulses in `solution` until (T 4.121) holds with `epsilon` \[N s\].
    /// Returns the number of iterations and whether that happened.
    pub fn solve(
        &mut self,
        step: &Step,
        solution: &mut StepSolution,
        r: ContactPenalties,
        epsilon: f64,
        max_iterations: u32,
    ) -> (u32, bool) {
        self.factorise(step);
        for iterations in 1..=max_iterations {
            self.move_freely(step, solution);
            self.solve_joints(step, solution);
            self.apply_joints(step, solution);
            if project_ground(step, solution, r) + project_pegs(step, solution, r.peg) < epsilon {
                return (iterations, true);
            }
        }
        (max_iterations, false)
    }

    /// Block elimination of W_J^T M^-1 W_J, which is block tridiagonal.
    fn factorise(&mut self, step: &Step) {
        for (j, rows) in step.joints.iter().enumerate() {
            let (near, far) = (&step.links[j].inverse_mass, &step.links[j + 1].inverse_mass);
            let mut pivot = rows.near.tr_mul(&scaled(&rows.near, near)) + rows.far.tr_mul(&scaled(&rows.far, far));
            if j > 0 {
                let coupling = self.coupling[j - 1];
                pivot -= coupling.tr_mul(&(self.inverse_pivot[j - 1] * coupling));
            }
            self.inverse_pivot[j] = pivot.try_inverse().unwrap_or_else(Matrix4::zeros);
            if let Some(next) = step.joints.get(j + 1) {
                self.coupling[j] = rows.far.tr_mul(&scaled(&next.near, far));
            }
        }
    }

    /// u_R + M^-1 S with S of (T 4.111).
    fn move_freely(&mut self, step: &Step, solution: &StepSolution) {
        for (free, link) in self.free.iter_mut().zip(&step.links) {
            *free = link.reference;
        }
        for (contact, impulse) in step.ground.iter().zip(&solution.ground) {
            self.push(step, contact.link, impulse.on_link(&contact.rows));
        }
        for (contact, impulse) in step.pegs.iter().zip(&solution.peg) {
            self.push(step, contact.link, contact.direction * *impulse);
        }
    }

    fn push(&mut self, step: &Step, link: usize, impulse: Vector6<f64>) {
        self.free[link] += step.links[link].inverse_mass.component_mul(&impulse);
    }

    /// P_J = -(W_J^T M^-1 W_J)^-1 W_J^T (free velocity) (T 4.110 != D31).
    fn solve_joints(&mut self, step: &Step, solution: &mut StepSolution) {
        let joint = &mut solution.joint;
        for (j, JointRows { near, far }) in step.joints.iter().enumerate() {
            let gap_rate = near.tr_mul(&self.free[j]) + far.tr_mul(&self.free[j + 1]);
            let carried = if j > 0 { self.coupling[j - 1].tr_mul(&joint[j - 1]) } else { Vector4::zeros() };
            joint[j] = self.inverse_pivot[j] * (-gap_rate - carried);
        }
        for j in (0..joint.len().saturating_sub(1)).rev() {
            let carried = self.inverse_pivot[j] * (self.coupling[j] * joint[j + 1]);
            joint[j] -= carried;
        }
    }

    /// u_E from (T 4.112).
    fn apply_joints(&self, step: &Step, solution: &mut StepSolution) {
        let StepSolution { twist, joint, .. } = solution;
        twist.copy_from_slice(&self.free);
        for (j, (rows, impulse)) in step.joints.iter().zip(joint.iter()).enumerate() {
            twist[j] += step.links[j].inverse_mass.component_mul(&(rows.near * impulse));
            twist[j + 1] += step.links[j + 1].inverse_mass.component_mul(&(rows.far * impulse));
        }
    }
}

/// (T 4.113)-(T 4.115); returns |change of P_N| + |change of P_T| + |change of P_V|.
///
/// The friction sets are those of the normal impulse just found.
fn project_ground(step: &Step, solution: &mut StepSolution, r: ContactPenalties) -> f64 {
    let (mut normal, mut tangent, mut rolling) = (0.0, 0.0, 0.0);
    for (contact, impulse) in step.ground.iter().zip(&mut solution.ground) {
        let (u, rows, old) = (&solution.twist[contact.link], &contact.rows, *impulse);
        impulse.normal = HalfLine.project(old.normal - r.normal * rows.normal.dot(u));
        let bounds = impulse.normal;
        impulse.tangent = step.friction_set(bounds).project(old.tangent - rows.tangent.tr_mul(u) * r.friction);
        impulse.rolling = step.rolling_set(bounds).project(old.rolling - rows.rolling.tr_mul(u) * r.rolling);
        normal += (impulse.normal - old.normal).powi(2);
        tangent += (impulse.tangent - old.tangent).norm_squared();
        rolling += (impulse.rolling - old.rolling).norm_squared();
    }
    f64::sqrt(normal) + f64::sqrt(tangent) + f64::sqrt(rolling)
}

/// (T 4.116 != D32); returns |change of P_H|.
fn project_pegs(step: &Step, solution: &mut StepSolution, r: f64) -> f64 {
    let mut change = 0.0;
    for (contact, impulse) in step.pegs.iter().zip(&mut solution.peg) {
        let opening = contact.direction.dot(&solution.twist[contact.link]);
        let projected = HalfLine.project(*impulse - r * opening);
        change += (projected - *impulse).powi(2);
        *impulse = projected;
    }
    change.sqrt()
}

/// M_i^-1 times four columns.
fn scaled(rows: &nalgebra::Matrix6x4<f64>, inverse_mass: &Vector6<f64>) -> nalgebra::Matrix6x4<f64> {
    let mut scaled = *rows;
    for mut column in scaled.column_iter_mut() {
        column.component_mul_assign(inverse_mass);
    }
    scaled
}
