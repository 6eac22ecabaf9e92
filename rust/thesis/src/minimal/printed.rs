//! The set-valued plant by the time stepping of chapter 3, with dense matrices (T 3.6.1), (T 6.24).
//!
//! Midpoint q_M, torque and gyroscopic terms from the start of the step (T 3.51 != D8), and Algorithm 3.1 with the
//! friction of two points per link. There are no joint impulses: the coordinates are minimal.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Rotation2, Vector2};
use snake_core::gait::{JointTarget, Reference};
use snake_core::laws::{ConvexSet, Ellipse};
use snake_core::stepping::{Record, StepStatistics};

use crate::ThesisConfig;
use crate::minimal::{MinimalState, Model, ProcessPlant, SmoothLaw, actuation};

use super::controller::Controller;

/// Workspace of the scheme.
#[derive(Debug, Clone)]
pub struct Thesis {
    config: ThesisConfig,
    actuation: DMatrix<f64>,
    /// P_T of F_i of all links, then of R_i, in the links' frames \[N s\].
    impulse: DVector<f64>,
    pub torque: Vec<f64>,
    /// What a run records besides its motion, if it does.
    pub record: Option<Box<Record>>,
}

impl Thesis {
    pub fn new(config: ThesisConfig, model: &Model) -> Self {
        Self {
            config,
            actuation: actuation(model),
            impulse: DVector::zeros(4 * model.link_count()),
            torque: vec![0.0; model.joint_count()],
            record: None,
        }
    }

    /// Clears impulses.
    pub fn clear(&mut self) {
        self.impulse.fill(0.0);
    }

    /// One step of length `h`.
    pub fn step(
        &mut self,
        model: &Model,
        state: &mut MinimalState,
        controller: &mut Controller,
        reference: &impl Reference<JointTarget>,
        h: f64,
        statistics: &mut StepStatistics,
    ) {
        controller.begin_step(model, state, reference);
        self.torque.copy_from_slice(&controller.held);
        let rate = DVector::from_row_slice(&state.rate);
        let midpoint: Vec<f64> = state.q.iter().zip(&state.rate).map(|(q, v)| q + 0.5 * h * v).collect();
        let plant = ProcessPlant::new(model, SmoothLaw::PRINTED, &midpoint, &state.rate);
        let slip = slip_jacobian(model, &plant, &midpoint);
        let force = &self.actuation * DVector::from_row_slice(&self.torque)
            - &plant.coriolis * &rate
            - slip.tr_mul(&viscous(model, &slip, &rate));
        let Some(mass) = plant.mass.clone().cholesky() else {
            state.rate.fill(f64::NAN);
            return;
        };
        let mut free = &rate + mass.solve(&force) * h;
        // Gravity accelerates all links alike.
        free[0] += model.pull.x * h;
        free[1] += model.pull.y * h;
        let end = self.iterate(model, &mass, &slip, &free, h, statistics);
        self.add_to_record(model, &midpoint, &slip, (&rate, &end), h, statistics);
        for (k, q) in state.q.iter_mut().enumerate() {
            *q = midpoint[k] + 0.5 * h * end[k];
        }
        state.rate.copy_from_slice(end.as_slice());
        statistics.steps += 1;
    }

    /// P_T = prox_C(P_T - r_T gamma_T) (T 3.79) until the impulses change by less than epsilon (T 3.81); returns u_E.
    fn iterate(
        &mut self,
        model: &Model,
        mass: &Cholesky<f64, Dyn>,
        slip: &DMatrix<f64>,
        free: &DVector<f64>,
        h: f64,
        statistics: &mut StepStatistics,
    ) -> DVector<f64> {
        let response = mass.solve(&slip.transpose());
        let epsilon = self.config.tolerance.unwrap_or(EPSILON);
        let (cap, r) = (self.config.max_iterations, self.config.r_t.unwrap_or(R_T));
        let mut end = free + &response * &self.impulse;
        let (mut iterations, mut change) = (0, f64::INFINITY);
        while iterations < cap && change >= epsilon {
            iterations += 1;
            let wanted = &self.impulse - slip * &end * r;
            change = 0.0;
            for (i, place) in points(model) {
                let axes = model.links[i].friction.coulomb * h;
                let projected = Ellipse { axes }.project(Vector2::new(wanted[place], wanted[place + 1]));
                let mut impulse = self.impulse.fixed_rows_mut::<2>(place);
                change += (projected - &impulse).norm_squared();
                impulse.copy_from(&projected);
            }
            change = change.sqrt();
            end = free + &response * &self.impulse;
        }
        let converged = change < epsilon;
        statistics.add_solve(iterations, !converged, self.violation(model, &(slip * &end), h), 0.0);
        end
    }

    /// Adds a step of length `h` from `rate` to `end` to what the run records.
    fn add_to_record(
        &mut self,
        model: &Model,
        midpoint: &[f64],
        slip: &DMatrix<f64>,
        (rate, end): (&DVector<f64>, &DVector<f64>),
        h: f64,
        statistics: &mut StepStatistics,
    ) {
        let Self { impulse, torque, record: Some(record), .. } = self else { return };
        let impulse = &*impulse - viscous(model, slip, rate) * h;
        statistics.friction_work += impulse.dot(&(slip * end));
        let links = model.link_count();
        let mut angle = midpoint[2..].to_vec();
        (1..angle.len()).for_each(|i| angle[i] += angle[i - 1]);
        for (k, (i, place)) in points(model).enumerate() {
            let along = Vector2::new(impulse[place], impulse[place + 1]);
            record.sum.ground[i][k / links] += (Rotation2::new(angle[i]) * along).push(0.0);
        }
        for (j, (work, torque)) in record.sum.actuator_work.iter_mut().zip(torque).enumerate() {
            let done = h * *torque * end[3 + j];
            work[0] += done;
            statistics.actuator_work += done;
        }
    }

    /// Worst |P - prox_C(P - m gamma)| / m \[m/s\].
    fn violation(&self, model: &Model, slip: &DVector<f64>, h: f64) -> f64 {
        let mut worst: f64 = 0.0;
        for (i, place) in points(model) {
            let link = &model.links[i];
            let impulse: Vector2<f64> = self.impulse.fixed_rows::<2>(place).into_owned();
            let slip = slip.fixed_rows::<2>(place);
            let nearest = Ellipse { axes: link.friction.coulomb * h }.project(impulse - slip * link.mass);
            worst = worst.max((impulse - nearest).norm() / link.mass);
        }
        worst
    }
}

/// r_T of (T Table 7.2), "robot model": with two contact points per link the iteration diverges above 0.68.
const R_T: f64 = 0.2;

/// epsilon of (T Table 7.2), "robot model" \[N s\].
const EPSILON: f64 = 1e-5;

/// Link and first row of each contact point: F_i of all links, then R_i.
fn points(model: &Model) -> impl Iterator<Item = (usize, usize)> {
    let links = model.link_count();
    (0..2 * links).map(move |k| (k % links, 2 * k))
}

/// Slip velocities along and across the links are this times q': F_i of all links, then R_i.
fn slip_jacobian(model: &Model, plant: &ProcessPlant, q: &[f64]) -> DMatrix<f64> {
    let (links, n) = (model.link_count(), model.degrees());
    let mut slip = DMatrix::zeros(4 * links, n);
    let mut angle = 0.0;
    for i in 0..links {
        angle += q[2 + i];
        let turn = Rotation2::new(-angle);
        for (jacobian, place) in [(&plant.jacobian_front, 2 * i), (&plant.jacobian_rear, 2 * (links + i))] {
            let rows = turn.matrix() * jacobian.fixed_rows::<2>(2 * i);
            slip.fixed_rows_mut::<2>(place).copy_from(&rows);
        }
    }
    slip
}

/// Viscous coefficients times slip at all contact points (T 6.26) \[N\].
fn viscous(model: &Model, slip: &DMatrix<f64>, rate: &DVector<f64>) -> DVector<f64> {
    let mut force = slip * rate;
    for (i, place) in points(model) {
        let coefficients = model.links[i].friction.viscous;
        force[place] *= coefficients.x;
        force[place + 1] *= coefficients.y;
    }
    force
}
