//! The control plant in matrices, as printed (T 6.27)-(T 6.60): for reading and for tests.
//!
//! With velocities nu = (v_O2 in frame B_3, theta', phi') the heading drops out of (T 6.37). Forces and
//! Jacobians are those of the process plant, described in frame B_3.

use nalgebra::{DMatrix, DVector, Rotation2};

use super::Model;
use super::SmoothLaw;
use super::process_plant::ProcessPlant;

/// Matrices and vectors of (T 6.37) and of its two parts (T 6.50)-(T 6.51).
#[derive(Debug, Clone, PartialEq)]
pub struct ControlPlant {
    /// M (T 6.38).
    pub mass: DMatrix<f64>,
    /// C (T 6.39).
    pub coriolis: DMatrix<f64>,
    /// J_vF and J_vR of all links, one below the other (T 6.32)-(T 6.33).
    pub jacobian_front: DMatrix<f64>,
    pub jacobian_rear: DMatrix<f64>,
    /// F_F and F_R in frame B_3 (T 6.40) \[N\].
    pub friction_front: DVector<f64>,
    pub friction_rear: DVector<f64>,
    /// h = C nu (T 6.43).
    pub h: DVector<f64>,
    /// g (T 6.44).
    pub g: DVector<f64>,
    /// M_V: -M_V nu is the generalised viscous friction (T 6.101)-(T 6.102), (T A.8).
    pub viscous: DMatrix<f64>,
}

/// What is left for the joints when (T 6.53) has removed w': (T 6.55)-(T 6.57).
#[derive(Debug, Clone, PartialEq)]
pub struct JointDynamics {
    pub mass: DMatrix<f64>,
    pub h: DVector<f64>,
    pub g: DVector<f64>,
}

impl ControlPlant {
    /// At joint angles `phi` and velocities `nu` (T 6.30).
    pub fn new(model: &Model, law: SmoothLaw, phi: &[f64], nu: &[f64]) -> Self {
        Self::at_heading(model, law, 0.0, phi, nu)
    }

    /// The same, by way of the process plant at heading `theta`: the result does not depend on it.
    pub fn at_heading(model: &Model, law: SmoothLaw, theta: f64, phi: &[f64], nu: &[f64]) -> Self {
        let transform = velocity_transform(model, theta);
        let nu = DVector::from_row_slice(nu);
        let rate = &transform * &nu;
        let q: Vec<f64> = [0.0, 0.0, theta].into_iter().chain(phi.iter().copied()).collect();
        let plant = ProcessPlant::new(model, law, &q, rate.as_slice());
        let turn = turn_all(model, theta);
        let coriolis =
            transform.tr_mul(&(&plant.mass * transform_rate(model, theta, nu[2]) + &plant.coriolis * &transform));
        let seen = |jacobian: &DMatrix<f64>| turn.tr_mul(jacobian) * &transform;
        let (front, rear) = (seen(&plant.jacobian_front), seen(&plant.jacobian_rear));
        let friction = |force: &DVector<f64>| turn.tr_mul(force);
        let (at_front, at_rear) = (friction(&plant.friction_front), friction(&plant.friction_rear));
        Self {
            mass: transform.tr_mul(&(&plant.mass * &transform)),
            h: &coriolis * &nu,
            g: front.tr_mul(&at_front) + rear.tr_mul(&at_rear),
            viscous: viscous(model, phi, &front) + viscous(model, phi, &rear),
            coriolis,
            jacobian_front: front,
            jacobian_rear: rear,
            friction_front: at_front,
            friction_rear: at_rear,
        }
    }

    /// M_11, M_12, M_21, M_22 (T 6.52).
    pub fn mass_blocks(&self) -> [DMatrix<f64>; 4] {
        let m = self.mass.nrows() - 3;
        let block = |i, j, rows, columns| self.mass.view((i, j), (rows, columns)).into_owned();
        [block(0, 0, 3, 3), block(0, 3, 3, m), block(3, 0, m, 3), block(3, 3, m, m)]
    }

    /// M_22_bar, h_2_bar, g_2_bar (T 6.55)-(T 6.57).
    pub fn joint_dynamics(&self) -> JointDynamics {
        let [m11, m12, m21, m22] = self.mass_blocks();
        let inverse = m11.cholesky().expect("M_11 is positive definite").inverse();
        let coupling = m21 * inverse;
        let joints = m12.ncols();
        let reduce = |x: &DVector<f64>| x.rows(3, joints) - &coupling * x.rows(0, 3);
        JointDynamics { mass: m22 - &coupling * &m12, h: reduce(&self.h), g: reduce(&self.g) }
    }
}

impl JointDynamics {
    /// tau (T 6.58).
    pub fn torque(&self, u: &DVector<f64>) -> DVector<f64> {
        &self.mass * u + &self.h - &self.g
    }
}

/// T_q (T 6.29).
pub fn velocity_transform(model: &Model, theta: f64) -> DMatrix<f64> {
    let mut transform = DMatrix::identity(model.degrees(), model.degrees());
    transform.fixed_view_mut::<2, 2>(0, 0).copy_from(Rotation2::new(theta).matrix());
    transform
}

/// dT_q/dt (T 6.34).
fn transform_rate(model: &Model, theta: f64, rate: f64) -> DMatrix<f64> {
    let mut change = DMatrix::zeros(model.degrees(), model.degrees());
    let quarter = std::f64::consts::FRAC_PI_2;
    change.fixed_view_mut::<2, 2>(0, 0).copy_from(&(Rotation2::new(theta + quarter).matrix() * rate));
    change
}

/// R_B3^I for the points of all links at once.
fn turn_all(model: &Model, theta: f64) -> DMatrix<f64> {
    let mut turn = DMatrix::zeros(2 * model.link_count(), 2 * model.link_count());
    for i in 0..model.link_count() {
        turn.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(Rotation2::new(theta).matrix());
    }
    turn
}

/// sum J^T R_Bi^B3 (F_N / 2) D_mu_V (R_Bi^B3)^T J over the links, for one point of each (T 6.101), (T A.8).
fn viscous(model: &Model, phi: &[f64], jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let mut total = DMatrix::zeros(model.degrees(), model.degrees());
    let mut angle = 0.0;
    for (i, link) in model.links.iter().enumerate() {
        angle += if i > 0 { phi[i - 1] } else { 0.0 };
        let rows = Rotation2::new(-angle).matrix() * jacobian.fixed_rows::<2>(2 * i);
        let weighted = nalgebra::Matrix2::from_diagonal(&link.friction.viscous) * &rows;
        total += rows.tr_mul(&weighted);
    }
    total
}
