//! The process plant in matrices, as printed (T 6.1)-(T 6.26): for reading, for the thesis's scheme and for tests.
//!
//! M_P(q) q'' + C_P(q, q') q' = P_phi tau + sum (J_F^T F_F + J_R^T F_R) (T 6.14). Columns of a
//! Jacobian: two prismatic joints, the revolute theta, the joints phi; row 2i, 2i + 1: link i.

use nalgebra::{DMatrix, DVector, Rotation2, Vector2};

use super::Model;
use super::SmoothLaw;
use super::motion::quarter_turn;

/// Matrices and forces of (T 6.14) at one state, in frame I.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcessPlant {
    /// M_P (T 6.15).
    pub mass: DMatrix<f64>,
    /// C_P (T 6.16).
    pub coriolis: DMatrix<f64>,
    /// J_vG, J_vF, J_vR of all links, one below the other (T 6.5), (T 6.11).
    pub jacobian_centre: DMatrix<f64>,
    pub jacobian_front: DMatrix<f64>,
    pub jacobian_rear: DMatrix<f64>,
    /// F_F and F_R (T 6.19), (T 6.21), (T 6.26) of all links, one after the other \[N\].
    pub friction_front: DVector<f64>,
    pub friction_rear: DVector<f64>,
}

/// Absolute angles of the links, and places of the joints O_2, O_3, ... and of points on the links.
struct Configuration {
    angle: Vec<f64>,
    /// O_i of the rear end of each link.
    rear_end: Vec<Vector2<f64>>,
}

impl Configuration {
    fn new(model: &Model, q: &[f64]) -> Self {
        let (mut at, mut theta) = (Vector2::new(q[0], q[1]), q[2]);
        let (mut angle, mut rear_end) = (Vec::new(), Vec::new());
        for (i, link) in model.links.iter().enumerate() {
            theta += if i > 0 { q[2 + i] } else { 0.0 };
            angle.push(theta);
            rear_end.push(at);
            at += axial(theta) * (2.0 * link.half_length);
        }
        Self { angle, rear_end }
    }

    /// The point of link `i` that lies `ahead` of G_i (T 6.2), (T 6.13).
    fn point(&self, model: &Model, i: usize, ahead: f64) -> Vector2<f64> {
        self.rear_end[i] + axial(self.angle[i]) * (model.links[i].half_length + ahead)
    }
}

fn axial(theta: f64) -> Vector2<f64> {
    Vector2::new(theta.cos(), theta.sin())
}

impl ProcessPlant {
    /// At coordinates `q` and velocities `rate`, both of length n (T 6.3).
    pub fn new(model: &Model, law: SmoothLaw, q: &[f64], rate: &[f64]) -> Self {
        let configuration = Configuration::new(model, q);
        let jacobian = |side: f64| jacobian(model, &configuration, side);
        let (centre, front, rear) = (jacobian(0.0), jacobian(1.0), jacobian(-1.0));
        let change = jacobian_rate(model, &configuration, rate);
        let turning = rotation_jacobian(model);
        let weight = |i: usize| model.links[i / 2].mass;
        let weighted = DMatrix::from_fn(centre.nrows(), centre.ncols(), |i, j| weight(i) * centre[(i, j)]);
        let inertia =
            DMatrix::from_fn(turning.nrows(), turning.ncols(), |i, j| model.links[i].inertia * turning[(i, j)]);
        let velocity = DVector::from_row_slice(rate);
        Self {
            mass: weighted.tr_mul(&centre) + turning.tr_mul(&inertia),
            // c_ijk of (T 6.17) is sum m dr/dq_i . d2r/dq_j dq_k, since omega is linear in q'.
            coriolis: weighted.tr_mul(&change),
            friction_front: friction(model, &configuration, law, &front * &velocity),
            friction_rear: friction(model, &configuration, law, &rear * &velocity),
            jacobian_centre: centre,
            jacobian_front: front,
            jacobian_rear: rear,
        }
    }

    /// sum J_F^T F_F + J_R^T F_R: the generalised friction.
    pub fn friction(&self) -> DVector<f64> {
        self.jacobian_front.tr_mul(&self.friction_front) + self.jacobian_rear.tr_mul(&self.friction_rear)
    }
}

/// P_phi (T 6.18).
pub fn actuation(model: &Model) -> DMatrix<f64> {
    let n = model.degrees();
    DMatrix::from_fn(n, n - 3, |i, j| if i == j + 3 { 1.0 } else { 0.0 })
}

/// J of the points `side * L_GS` ahead of each G_i: G for 0, F for 1, R for -1 (T 6.6), (T 6.12).
fn jacobian(model: &Model, configuration: &Configuration, side: f64) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(2 * model.link_count(), model.degrees());
    for (i, link) in model.links.iter().enumerate() {
        let point = configuration.point(model, i, side * link.lever);
        jacobian[(2 * i, 0)] = 1.0;
        jacobian[(2 * i + 1, 1)] = 1.0;
        for k in 0..=i {
            let column = quarter_turn(point - configuration.rear_end[k]);
            jacobian.fixed_view_mut::<2, 1>(2 * i, 2 + k).copy_from(&column);
        }
    }
    jacobian
}

/// dJ_vG/dt.
fn jacobian_rate(model: &Model, configuration: &Configuration, rate: &[f64]) -> DMatrix<f64> {
    let mut change = DMatrix::zeros(2 * model.link_count(), model.degrees());
    let (mut omega, mut velocity) = (0.0, Vector2::new(rate[0], rate[1]));
    let mut rear_velocity = Vec::new();
    for i in 0..model.link_count() {
        omega += rate[2 + i];
        rear_velocity.push(velocity);
        let swing = quarter_turn(axial(configuration.angle[i])) * (model.links[i].half_length * omega);
        for (k, rear) in rear_velocity.iter().enumerate() {
            let column = quarter_turn(velocity + swing - rear);
            change.fixed_view_mut::<2, 1>(2 * i, 2 + k).copy_from(&column);
        }
        velocity += swing * 2.0;
    }
    change
}

/// J_omega of all links (T 6.8)-(T 6.9).
fn rotation_jacobian(model: &Model) -> DMatrix<f64> {
    DMatrix::from_fn(model.link_count(), model.degrees(), |i, k| if k >= 2 && k <= i + 2 { 1.0 } else { 0.0 })
}

/// Friction at one point of each link, turned into the links' frames and back (T 6.1).
fn friction(model: &Model, configuration: &Configuration, law: SmoothLaw, velocity: DVector<f64>) -> DVector<f64> {
    let mut force = DVector::zeros(velocity.len());
    for (i, link) in model.links.iter().enumerate() {
        let turn = Rotation2::new(configuration.angle[i]);
        let slip = turn.inverse() * velocity.fixed_rows::<2>(2 * i);
        force.fixed_rows_mut::<2>(2 * i).copy_from(&(turn * link.friction.force(law, slip)));
    }
    force
}
