//! The smooth plant integrated by a stiff solver with error control: variable-order BDF, as Matlab's ode15s
//! (T 7.3.5 != D23).

use std::cell::RefCell;

use differential_equations::error::Error;
use differential_equations::linalg::Matrix;
use differential_equations::methods::{BackwardDifferentiationFormula, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use snake_core::gait::{JointTarget, Reference};
use snake_core::stepping::{ImplicitConfig, StepStatistics};

use crate::minimal::{MinimalState, Model, SmoothLaw};

use super::controller::{Controller, ROUND_OFF};
use super::implicit::tolerance_of;
use super::smooth_plant::SmoothPlant;

type Solver = BackwardDifferentiationFormula<Ordinary, f64, Vec<f64>>;

/// The solver between two calls.
pub struct Smooth {
    plant: RefCell<SmoothPlant>,
    /// Relative tolerance; the absolute one is a hundredth of it in m, rad, m/s and rad/s.
    tolerance: f64,
    /// With its multistep history, unless something has jumped.
    solver: Option<Solver>,
    y: Vec<f64>,
}

impl std::fmt::Debug for Smooth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Smooth").field("tolerance", &self.tolerance).finish_non_exhaustive()
    }
}

impl Smooth {
    pub fn new(config: &ImplicitConfig, model: &Model, law: SmoothLaw, controller: &Controller) -> Self {
        let plant = SmoothPlant::new(model, law, *controller.config());
        Self {
            plant: RefCell::new(plant),
            tolerance: tolerance_of(config),
            solver: None,
            y: vec![0.0; 2 * model.degrees()],
        }
    }

    /// Something jumps: the history no longer holds.
    pub fn handle_discontinuity(&mut self) {
        self.solver = None;
    }

    /// Integrates to `until`, before which nothing jumps; a failure leaves a state that is not finite.
    pub fn run_to(
        &mut self,
        state: &mut MinimalState,
        controller: &Controller,
        reference: &impl Reference<JointTarget>,
        until: f64,
        statistics: &mut StepStatistics,
    ) {
        let n = state.q.len();
        self.y[..n].copy_from_slice(&state.q);
        self.y[n..].copy_from_slice(&state.rate);
        if self.integrate(state.time, until, controller, reference, statistics).is_err() {
            self.y.fill(f64::NAN);
        }
        state.q.copy_from_slice(&self.y[..n]);
        state.rate.copy_from_slice(&self.y[n..]);
    }

    /// tau of each joint at the last evaluation \[N m\].
    pub fn write_torque(&self, torque: &mut [f64]) {
        torque.copy_from_slice(&self.plant.borrow().torque);
    }

    fn integrate(
        &mut self,
        from: f64,
        until: f64,
        controller: &Controller,
        reference: &impl Reference<JointTarget>,
        statistics: &mut StepStatistics,
    ) -> Result<(), Error<f64, Vec<f64>>> {
        let Self { plant, tolerance, solver: kept, y } = self;
        let equation = Equation { plant, reference, held: &controller.held, until };
        let mut solver = match kept.take() {
            Some(solver) => solver,
            None => {
                let solver = Solver::adaptive().rtol(*tolerance).atol(ABSOLUTE * *tolerance).h0(FIRST_STEP);
                // Sliding starts and stops often; the number of steps is not a sign of trouble.
                let mut solver = solver.max_steps(usize::MAX);
                solver.init(&equation, from, until, y)?;
                solver
            }
        };
        while until - solver.t() > ARRIVED {
            let left = until - solver.t();
            if solver.h() > left {
                solver.set_h(left);
            }
            let evaluations = solver.step(&equation)?.function;
            statistics.steps += 1;
            statistics.iterations += u32::try_from(evaluations).unwrap_or(u32::MAX);
        }
        y.copy_from_slice(solver.y());
        let mut rate = vec![0.0; y.len()];
        equation.diff(until, y, &mut rate);
        *kept = Some(solver);
        Ok(())
    }
}

/// y' = f(t, y) up to `until`.
struct Equation<'a, R> {
    plant: &'a RefCell<SmoothPlant>,
    reference: &'a R,
    held: &'a [f64],
    until: f64,
}

impl<R: Reference<JointTarget>> ODE<f64, Vec<f64>> for Equation<'_, R> {
    fn diff(&self, t: f64, y: &Vec<f64>, dy: &mut Vec<f64>) {
        // The solver's first call hands over an empty vector.
        dy.resize(y.len(), 0.0);
        // Before a jump that falls on the end.
        self.plant.borrow_mut().derivative(t.min(self.until - ROUND_OFF), y, self.reference, self.held, dy);
    }

    /// Central differences.
    fn jacobian(&self, t: f64, y: &Vec<f64>, jacobian: &mut Matrix<f64>) {
        let (mut moved, mut ahead, mut behind) = (y.clone(), y.clone(), y.clone());
        for column in 0..y.len() {
            for (side, out) in [(DIFFERENCE, &mut ahead), (-DIFFERENCE, &mut behind)] {
                moved[column] = y[column] + side;
                self.diff(t, &moved, out);
            }
            moved[column] = y[column];
            for (row, (ahead, behind)) in ahead.iter().zip(&behind).enumerate() {
                jacobian[(row, column)] = (ahead - behind) / (2.0 * DIFFERENCE);
            }
        }
    }
}

/// Absolute over relative tolerance.
const ABSOLUTE: f64 = 1e-2;

/// First step after a jump \[s\]: the solver's own estimate is below round-off at small tolerances.
const FIRST_STEP: f64 = 1e-6;

/// Step of the central differences: small against eps_C = 1e-3 m/s, large against round-off.
const DIFFERENCE: f64 = 1e-7;

/// An interval of time too short for a step \[s\].
const ARRIVED: f64 = 1e-12;
