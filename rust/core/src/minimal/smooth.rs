//! The smooth plant integrated by a stiff solver with error control: variable-order BDF, as Matlab's ode15s
//! (T 7.3.5 != D23).

use std::cell::RefCell;

use diffsol::{
    BdfState, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, VectorCommon,
};

use crate::gait::{JointTarget, Reference};
use crate::minimal::{MinimalState, Model, SmoothLaw};
use crate::stepping::{ImplicitConfig, StepStatistics};

use super::controller::{Controller, ROUND_OFF};
use super::smooth_plant::SmoothPlant;

/// The solver between two calls.
#[derive(Clone)]
pub struct Smooth {
    plant: RefCell<SmoothPlant>,
    /// Relative tolerance; the absolute one is a hundredth of it in m, rad, m/s and rad/s.
    tolerance: f64,
    /// Multistep history, unless something has jumped.
    history: Option<BdfState<NalgebraVec<f64>>>,
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
            tolerance: config.tolerance,
            history: None,
            y: vec![0.0; 2 * model.degrees()],
        }
    }

    /// Something jumps: the history no longer holds.
    pub fn handle_discontinuity(&mut self) {
        self.history = None;
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
    ) -> Result<(), diffsol::error::DiffsolError> {
        let Self { plant, tolerance, history, y, .. } = self;
        let n = y.len();
        // Before a jump that falls on the end.
        let f = |t: f64, y: &[f64], dy: &mut [f64]| {
            plant.borrow_mut().derivative(t.min(until - ROUND_OFF), y, reference, &controller.held, dy);
        };
        let scratch = RefCell::new(vec![0.0; 3 * n]);
        let start = y.clone();
        let mut problem = OdeBuilder::<NalgebraMat<f64>>::new()
            .t0(from)
            .rtol(*tolerance)
            .atol(vec![ABSOLUTE * *tolerance; n])
            .rhs_implicit(
                |y: &[f64], _: &[f64], t, dy: &mut [f64]| f(t, y, dy),
                |y: &[f64], _: &[f64], t, v: &[f64], jv: &mut [f64]| {
                    let mut scratch = scratch.borrow_mut();
                    let (ahead, rest) = scratch.split_at_mut(n);
                    let (behind, moved) = rest.split_at_mut(n);
                    for (side, out) in [(DIFFERENCE, ahead), (-DIFFERENCE, behind)] {
                        moved.iter_mut().zip(y.iter().zip(v)).for_each(|(m, (y, v))| *m = y + side * v);
                        f(t, moved, out);
                    }
                    for (k, jv) in jv.iter_mut().enumerate() {
                        *jv = (scratch[k] - scratch[n + k]) / (2.0 * DIFFERENCE);
                    }
                },
            )
            .init(move |_: &[f64], _, y: &mut [f64]| y.copy_from_slice(&start), n)
            .build()?;
        // Sliding starts and stops often; the solver's totals are not a sign of trouble.
        problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
        problem.ode_options.max_error_test_failures = usize::MAX;
        let mut solver = match history.take() {
            Some(state) => problem.bdf_solver::<NalgebraLU<f64>>(state)?,
            None => problem.bdf::<NalgebraLU<f64>>()?,
        };
        solver.set_stop_time(until)?;
        while !matches!(solver.step()?, OdeSolverStopReason::TstopReached) {}
        statistics.steps += u32::try_from(solver.get_statistics().number_of_steps).unwrap_or(u32::MAX);
        statistics.iterations +=
            u32::try_from(solver.get_statistics().number_of_nonlinear_solver_iterations).unwrap_or(u32::MAX);
        y.copy_from_slice(solver.state().y.inner().as_slice());
        let mut rate = vec![0.0; n];
        f(until, y, &mut rate);
        *history = Some(solver.into_state());
        Ok(())
    }
}

/// Absolute over relative tolerance.
const ABSOLUTE: f64 = 1e-2;

/// Step of the central differences: small against eps_C = 1e-3 m/s, large against round-off.
const DIFFERENCE: f64 = 1e-7;
