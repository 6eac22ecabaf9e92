//! Algorithm 3.1, the Modified Newton iteration, as printed (T 3.6.2).
//!
//! It is a projected Jacobi iteration on the impulses with the joint impulses eliminated exactly.
//! The joint drive is data here (explicit PD): [`StageJoint::stiffness`](snake_core::planar::StageJoint) must be 0.

use nalgebra::{Matrix2, Vector2};
use snake_core::laws::{ConvexSet, Ellipse, HalfLine};
use snake_core::planar::{Stage, StageLink, StageSolution, Twist};

/// r_T and r_H of (T 3.78)-(T 3.79).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalties {
    pub friction: f64,
    pub contact: f64,
}

/// Workspace of the iteration.
#[derive(Debug, Clone)]
pub struct ModifiedNewton {
    /// Blocks of the factorised W_J^T M^-1 W_J: inverse pivots and couplings to the next joint.
    inverse_pivot: Vec<Matrix2<f64>>,
    coupling: Vec<Matrix2<f64>>,
    /// P_J of each joint \[N s\].
    joint: Vec<Vector2<f64>>,
    /// u_A + M^-1 (S + tau dt): the velocity without joints.
    free: Vec<Twist>,
}

impl ModifiedNewton {
    pub fn new(links: usize) -> Self {
        Self {
            inverse_pivot: vec![Matrix2::zeros(); links - 1],
            coupling: vec![Matrix2::zeros(); links - 1],
            joint: vec![Vector2::zeros(); links - 1],
            free: vec![Twist::zeros(); links],
        }
    }

    /// Iterates from the impulses in `solution` until (T 3.81) holds with `epsilon` \[N s\].
    /// Returns the number of iterations and whether that happened.
    pub fn solve(
        &mut self,
        stage: &Stage,
        solution: &mut StageSolution,
        r: Penalties,
        epsilon: f64,
        max_iterations: u32,
    ) -> (u32, bool) {
        self.factorise(stage);
        for (drive, joint) in solution.actuator.iter_mut().zip(&stage.joints) {
            *drive = joint.drive.clamp(-joint.limit, joint.limit);
        }
        for iterations in 1..=max_iterations {
            self.move_freely(stage, solution);
            self.solve_joints(stage);
            self.apply_joints(stage, solution);
            let change = project_contacts(stage, solution, r.contact) + project_friction(stage, solution, r.friction);
            if change < epsilon {
                return (iterations, true);
            }
        }
        (max_iterations, false)
    }

    /// Block elimination of W_J^T M^-1 W_J, which is block tridiagonal.
    fn factorise(&mut self, stage: &Stage) {
        for i in 0..stage.joints.len() {
            let (near, far) = (&stage.links[i], &stage.links[i + 1]);
            let mut pivot = mobility(near) + mobility(far);
            if i > 0 {
                let coupling = self.coupling[i - 1];
                pivot -= coupling.transpose() * self.inverse_pivot[i - 1] * coupling;
            }
            self.inverse_pivot[i] = pivot.try_inverse().unwrap_or_else(Matrix2::zeros);
            self.coupling[i] = mobility(far) - Matrix2::identity() * (2.0 / far.mass);
        }
    }

    /// u_A + M^-1 (S + tau dt) with S of (T 3.76).
    fn move_freely(&mut self, stage: &Stage, solution: &StageSolution) {
        for (i, (free, link)) in self.free.iter_mut().zip(&stage.links).enumerate() {
            let friction = link.heading.to_world(solution.friction[i]) / link.mass;
            let before = if i > 0 { solution.actuator[i - 1] } else { 0.0 };
            let after = solution.actuator.get(i).copied().unwrap_or(0.0);
            *free = link.reference + Twist::new(friction.x, friction.y, (before - after) / link.inertia);
        }
        for (contact, impulse) in stage.contacts.iter().zip(&solution.contact) {
            let link = &stage.links[contact.link];
            self.free[contact.link] += by_inertia(link, contact.direction * *impulse);
        }
    }

    /// P_J = -(W_J^T M^-1 W_J)^-1 W_J^T (free velocity) (T 3.75).
    fn solve_joints(&mut self, stage: &Stage) {
        for i in 0..self.joint.len() {
            let gap_rate = end_velocity(&stage.links[i], &self.free[i], 1.0)
                - end_velocity(&stage.links[i + 1], &self.free[i + 1], -1.0);
            let carried = if i > 0 { self.coupling[i - 1].transpose() * self.joint[i - 1] } else { Vector2::zeros() };
            self.joint[i] = self.inverse_pivot[i] * (-gap_rate - carried);
        }
        for i in (0..self.joint.len().saturating_sub(1)).rev() {
            let carried = self.inverse_pivot[i] * (self.coupling[i] * self.joint[i + 1]);
            self.joint[i] -= carried;
        }
    }

    /// u_E from (T 3.77).
    fn apply_joints(&self, stage: &Stage, solution: &mut StageSolution) {
        solution.twist.copy_from_slice(&self.free);
        for (i, impulse) in self.joint.iter().enumerate() {
            let (near, far) = (&stage.links[i], &stage.links[i + 1]);
            solution.twist[i] += by_inertia(near, with_moment(near, *impulse, 1.0));
            solution.twist[i + 1] -= by_inertia(far, with_moment(far, *impulse, -1.0));
        }
    }
}

/// (T 3.78); returns |change of P_H|.
fn project_contacts(stage: &Stage, solution: &mut StageSolution, r: f64) -> f64 {
    let mut change = 0.0;
    for (contact, impulse) in stage.contacts.iter().zip(&mut solution.contact) {
        let opening = contact.direction.dot(&solution.twist[contact.link]) + contact.offset;
        let projected = HalfLine.project(*impulse - r * opening);
        change += (projected - *impulse).powi(2);
        *impulse = projected;
    }
    change.sqrt()
}

/// (T 3.79); returns |change of P_T|.
fn project_friction(stage: &Stage, solution: &mut StageSolution, r: f64) -> f64 {
    let mut change = 0.0;
    for (i, link) in stage.links.iter().enumerate() {
        let slip = link.heading.to_link(solution.twist[i].xy());
        let projected = Ellipse { axes: link.friction }.project(solution.friction[i] - slip * r);
        change += (projected - solution.friction[i]).norm_squared();
        solution.friction[i] = projected;
    }
    change.sqrt()
}

/// Velocity of a link's end; `side` is 1 for the far joint, -1 for the near one.
fn end_velocity(link: &StageLink, u: &Twist, side: f64) -> Vector2<f64> {
    u.xy() + link.heading.lateral() * (side * link.half_length * u.z)
}

/// An impulse at a link's end as (x, y, moment about the CG).
fn with_moment(link: &StageLink, impulse: Vector2<f64>, side: f64) -> Twist {
    Twist::new(impulse.x, impulse.y, side * link.half_length * link.heading.lateral().dot(&impulse))
}

/// M_i^-1 p.
fn by_inertia(link: &StageLink, p: Twist) -> Twist {
    Twist::new(p.x / link.mass, p.y / link.mass, p.z / link.inertia)
}

/// Velocity of a link's end per impulse there: I / m + a a^T / Theta with a = (L/2) e_y^B.
fn mobility(link: &StageLink) -> Matrix2<f64> {
    let arm = link.heading.lateral() * link.half_length;
    Matrix2::identity() / link.mass + arm * arm.transpose() / link.inertia
}
