//! The set-valued plant by the stages of the project's default scheme (T 3.65 != D2), in minimal coordinates.
//!
//! Order 1 is implicit Euler; order 2 the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself:
//! stage (q_A, u_A, gamma h) gives u_1; stage (q_A + (1 - gamma) h u_1, u_A + (1 - gamma)/gamma (u_1 - u_A), gamma h)
//! gives u_E. There are no impacts here, so nothing needs to be retaken.

use nalgebra::{Vector2, Vector3};
use snake_core::control::{ControlLaw, Treatment};
use snake_core::gait::{JointTarget, Reference};
use snake_core::robot::{Breakage, LOCK_STIFFNESS};
use snake_core::solver::{Outcome, RESIDUAL_LIMIT, is_unsolved};
use snake_core::stepping::sdirk::{EXTRAPOLATION, GAMMA};
use snake_core::stepping::{ImplicitConfig, Record, StageRecord, StepStatistics};

use crate::minimal::{
    Base, InverseDynamics, MinimalState, Model, Motion, Newton, Stage, StageJoint, StageLink, StageSolution, Twist,
    certify,
};

use super::controller::{Controller, ROUND_OFF};
use super::feedback::output;
use super::motion::quarter_turn;

/// Workspace of the scheme.
#[derive(Debug, Clone)]
pub struct Implicit {
    /// Accuracy of the velocities in a stage \[m/s\].
    tolerance: f64,
    max_iterations: u32,
    /// Order 1.
    is_euler: bool,
    stage: Stage,
    solution: StageSolution,
    newton: Newton,
    /// Positions and velocities at the start of the step, and at the predicted end of the stage.
    start: Motion,
    predicted: Motion,
    reference: Vec<Twist>,
    base: Vec<f64>,
    guess: Vec<f64>,
    predicted_q: Vec<f64>,
    /// q' at the end of the last stage.
    rate: Vec<f64>,
    /// q'' of the last step, for predictions.
    acceleration: Vec<f64>,
    first_rate: Vec<f64>,
    /// Coulomb friction of the last stage \[N\].
    friction: Vec<[Vector2<f64>; 2]>,
    control: ControlModel,
    /// Whether input-output linearisation wanted more than the torque limit during the last step.
    pub saturated: bool,
    /// What a run records besides its motion, if it does.
    pub record: Option<Box<Record>>,
}

/// The controller's model inside a stage.
#[derive(Debug, Clone)]
struct ControlModel {
    dynamics: InverseDynamics,
    u: Vec<f64>,
    tau: Vec<f64>,
    /// Inertia that each joint of the straight robot feels when all others are free \[kg m^2\].
    own_inertia: Vec<f64>,
}

impl Implicit {
    pub fn new(config: ImplicitConfig, model: &Model) -> Self {
        let (links, degrees) = (model.link_count(), model.degrees());
        let zero = vec![0.0; degrees];
        Self {
            tolerance: tolerance_of(&config),
            max_iterations: config.max_iterations,
            is_euler: config.order == 1,
            stage: Stage {
                coefficient: 0.0,
                links: Vec::with_capacity(links),
                joints: Vec::with_capacity(links - 1),
                momentum_feedforward: 0.0,
            },
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            start: Motion::new(links),
            predicted: Motion::new(links),
            reference: vec![Twist::zeros(); links],
            base: zero.clone(),
            guess: zero.clone(),
            predicted_q: zero.clone(),
            rate: zero.clone(),
            acceleration: zero.clone(),
            first_rate: zero,
            friction: vec![[Vector2::zeros(); 2]; links],
            control: ControlModel::new(model),
            saturated: false,
            record: None,
        }
    }

    /// Clears forces and predictions.
    pub fn clear(&mut self) {
        self.acceleration.fill(0.0);
        self.friction.fill([Vector2::zeros(); 2]);
    }

    /// Discards predictions, because the references or the torques jump.
    pub fn handle_discontinuity(&mut self) {
        self.acceleration.fill(0.0);
    }

    /// One step of length `h`; references are those before a jump at its very end.
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
        self.saturated = false;
        self.start.set(model, state.base(), state.phi(), state.phi_rate());
        for (to, from) in self.reference.iter_mut().zip(&self.start.links) {
            *to = from.twist;
        }
        self.base.copy_from_slice(&state.q);
        let end = state.time + h;
        if self.is_euler {
            self.guess_from(&state.rate, h);
            self.run_stage(model, controller, reference, h, end, statistics);
        } else {
            let c = GAMMA * h;
            self.guess_from(&state.rate, c);
            self.run_stage(model, controller, reference, c, state.time + c, statistics);
            self.begin_second_stage(state, h);
            self.record_stage(statistics, EXTRAPOLATION);
            self.run_stage(model, controller, reference, c, end, statistics);
        }
        self.record_stage(statistics, 1.0);
        for (k, acceleration) in self.acceleration.iter_mut().enumerate() {
            *acceleration = (self.rate[k] - state.rate[k]) / h;
        }
        for (k, q) in state.q.iter_mut().enumerate() {
            *q = self.base[k] + self.stage.coefficient * self.rate[k];
        }
        state.rate.copy_from_slice(&self.rate);
        statistics.steps += 1;
    }

    /// Adds the last stage, `weight` times, to what the run records.
    fn record_stage(&mut self, statistics: &mut StepStatistics, weight: f64) {
        let Self { stage, solution, record: Some(record), .. } = self else { return };
        let StageRecord { ground, actuator_work, .. } = &mut record.sum;
        for (i, link) in stage.links.iter().enumerate() {
            for (point, slip) in link.slip(&solution.twist[i]).into_iter().enumerate() {
                let impulse = (solution.friction[i][point] - link.viscous.component_mul(&slip)) * weight;
                ground[i][point] += (link.axial * impulse.x + quarter_turn(link.axial) * impulse.y).push(0.0);
                statistics.friction_work += impulse.dot(&slip);
            }
        }
        for (work, (drive, pair)) in
            actuator_work.iter_mut().zip(solution.actuator.iter().zip(solution.twist.windows(2)))
        {
            let done = weight * drive * (pair[1].z - pair[0].z);
            work[0] += done;
            statistics.actuator_work += done;
        }
    }

    /// tau of each joint in the last stage \[N m\].
    pub fn torque(&self) -> impl Iterator<Item = f64> + '_ {
        self.solution.actuator.iter().map(|drive| drive / self.stage.coefficient)
    }

    fn guess_from(&mut self, rate: &[f64], ahead: f64) {
        for (k, guess) in self.guess.iter_mut().enumerate() {
            *guess = rate[k] + ahead * self.acceleration[k];
        }
    }

    fn begin_second_stage(&mut self, state: &MinimalState, h: f64) {
        self.first_rate.copy_from_slice(&self.rate);
        for (k, base) in self.base.iter_mut().enumerate() {
            *base = state.q[k] + (1.0 - GAMMA) * h * self.first_rate[k];
            self.guess[k] = state.rate[k] + (self.first_rate[k] - state.rate[k]) / GAMMA;
        }
        for (i, reference) in self.reference.iter_mut().enumerate() {
            let start = self.start.links[i].twist;
            *reference = start + (self.solution.twist[i] - start) * EXTRAPOLATION;
        }
    }

    /// Predicts, solves and certifies a stage that ends at `time`; predicts again where the end is far from the
    /// prediction.
    fn run_stage(
        &mut self,
        model: &Model,
        controller: &mut Controller,
        reference: &impl Reference<JointTarget>,
        c: f64,
        time: f64,
        statistics: &mut StepStatistics,
    ) {
        // Before a jump that falls on the end of the stage.
        reference.targets(time - ROUND_OFF, &mut controller.targets);
        let limit = controller.config().limit_at(time - ROUND_OFF);
        for _ in 0..MAX_PREDICTIONS {
            self.predict(model, c);
            self.fill_joints(model, controller, limit);
            self.replace_broken_joints(model, controller);
            let mut outcome = self.solve(self.tolerance);
            let is_beyond = |drive: &f64| drive.abs() > c * limit;
            if controller.config().law == ControlLaw::Io && self.solution.actuator.iter().any(is_beyond) {
                self.saturated = true;
                self.load_guess();
                self.limit_torques(model, controller, limit);
                outcome.iterations += self.solve(self.tolerance).iterations;
            }
            self.judge(outcome, statistics);
            self.keep();
            if self.deviation() <= MAX_DEVIATION {
                break;
            }
            self.guess.copy_from_slice(&self.rate);
        }
    }

    /// Positions and velocities at the end of the stage if it moved as guessed, and the links of the stage.
    fn predict(&mut self, model: &Model, c: f64) {
        for (k, q) in self.predicted_q.iter_mut().enumerate() {
            *q = self.base[k] + c * self.guess[k];
        }
        let rate = Vector3::new(self.guess[0], self.guess[1], self.guess[2]);
        let base = Base { theta: self.predicted_q[2], rate };
        self.predicted.set(model, base, &self.predicted_q[3..], &self.guess[3..]);
        self.stage.coefficient = c;
        self.stage.links.clear();
        let gain = (model.pull * c).push(0.0);
        for ((link, at), reference) in model.links.iter().zip(&self.predicted.links).zip(&self.reference) {
            self.stage.links.push(StageLink::new(link, at, reference + gain, c));
        }
        self.load_guess();
    }

    /// First guess of the solution: predicted velocities, the friction forces of the last stage.
    fn load_guess(&mut self) {
        let c = self.stage.coefficient;
        for (i, at) in self.predicted.links.iter().enumerate() {
            self.solution.twist[i] = at.twist;
            self.solution.friction[i] = self.friction[i].map(|force| force * c);
        }
    }

    /// The drives of the stage: torques held over it, or linear in the velocities at its end.
    fn fill_joints(&mut self, model: &Model, controller: &Controller, limit: f64) {
        let Self { stage, control, predicted, base, .. } = self;
        let (config, c) = (controller.config(), stage.coefficient);
        stage.joints.clear();
        stage.momentum_feedforward = 0.0;
        if config.treatment != Treatment::Implicit || limit == 0.0 {
            // An implicit controller holds no torque; while switched off it exerts none.
            stage.joints.extend(controller.held.iter().map(|tau| constant_drive(c * tau)));
            return;
        }
        for ((u, target), angle) in control.u.iter_mut().zip(&controller.targets).zip(&base[3..]) {
            *u = output(config, target, *angle, 0.0);
        }
        let stiffness = c * (config.kd + c * config.kp);
        match config.law {
            ControlLaw::Pd => {
                let drives = control.u.iter().map(|u| StageJoint { drive: c * u, stiffness, limit: c * limit });
                stage.joints.extend(drives);
            }
            ControlLaw::Io => {
                control.find_torques(model, predicted);
                stage.joints.extend(control.tau.iter().map(|tau| constant_drive(c * tau)));
                stage.momentum_feedforward = stiffness;
            }
        }
    }

    /// A locked joint is held at its reference, the angle at which it broke, by a stiff spring without limit; a limp one
    /// has no torque.
    fn replace_broken_joints(&mut self, model: &Model, controller: &Controller) {
        let c = self.stage.coefficient;
        for &(j, breakage) in &model.broken {
            let stiffness = match breakage {
                Breakage::Locked => c * LOCK_STIFFNESS,
                Breakage::Limp => 0.0,
            };
            let error = controller.targets[j].angle - self.base[3 + j];
            self.stage.joints[j] =
                StageJoint { drive: stiffness * error, stiffness: c * stiffness, limit: f64::INFINITY };
        }
    }

    /// Input-output linearisation within the torque limit (T 6.58 != D21): linear in each joint's own rate about the
    /// guess, which is good in the short steps taken at the limit. M_22_bar within the clamps has no potential.
    fn limit_torques(&mut self, model: &Model, controller: &Controller, limit: f64) {
        let Self { stage, control, predicted, predicted_q, guess, .. } = self;
        let (config, c, f) = (controller.config(), stage.coefficient, stage.momentum_feedforward);
        stage.momentum_feedforward = 0.0;
        for (j, (u, target)) in control.u.iter_mut().zip(&controller.targets).enumerate() {
            *u = output(config, target, predicted_q[3 + j], guess[3 + j]);
        }
        control.find_torques(model, predicted);
        for (j, joint) in stage.joints.iter_mut().enumerate() {
            let stiffness = f * control.own_inertia[j];
            *joint = StageJoint { drive: c * control.tau[j] + stiffness * guess[3 + j], stiffness, limit: c * limit };
        }
    }

    fn solve(&mut self, tolerance: f64) -> Outcome {
        self.newton.solve(&self.stage, &mut self.solution, tolerance, self.max_iterations)
    }

    /// Certifies the solution. Newton's method bounds the velocity of its last step; where that step ends between
    /// sticking and slipping, the stiffness of sticking makes a larger imbalance of it, and the stage is solved further.
    fn judge(&mut self, mut outcome: Outcome, statistics: &mut StepStatistics) {
        let tolerance = self.tolerance;
        let limit = RESIDUAL_LIMIT * tolerance;
        let mut residual = certify(&self.stage, &self.solution).residual();
        if outcome.converged && residual > limit {
            outcome.iterations += self.solve(tolerance / RESIDUAL_LIMIT).iterations;
            residual = certify(&self.stage, &self.solution).residual();
        }
        let unconverged = is_unsolved(outcome.converged, residual, limit);
        statistics.add_solve(outcome.iterations as u32, unconverged, residual, 0.0);
    }

    /// Takes over velocities and forces.
    fn keep(&mut self) {
        let c = self.stage.coefficient;
        let twist = &self.solution.twist;
        let base = twist[0].xy() - self.stage.links[0].swing() * twist[0].z;
        (self.rate[0], self.rate[1], self.rate[2]) = (base.x, base.y, twist[0].z);
        for (j, pair) in twist.windows(2).enumerate() {
            self.rate[3 + j] = pair[1].z - pair[0].z;
        }
        for (force, impulse) in self.friction.iter_mut().zip(&self.solution.friction) {
            *force = impulse.map(|impulse| impulse / c);
        }
    }

    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    fn deviation(&self) -> f64 {
        let mut fastest: f64 = 0.0;
        for ((u, at), link) in self.solution.twist.iter().zip(&self.predicted.links).zip(&self.stage.links) {
            let change = u - at.twist;
            fastest = fastest.max(change.xy().norm() + link.half_length * change.z.abs());
        }
        fastest * self.stage.coefficient
    }
}

impl ControlModel {
    fn new(model: &Model) -> Self {
        let zero = vec![0.0; model.joint_count()];
        Self { dynamics: InverseDynamics::new(model), u: zero.clone(), tau: zero, own_inertia: model.own_inertia() }
    }

    /// tau (T 6.58) for the joint accelerations `u` at the predicted end of the stage.
    fn find_torques(&mut self, model: &Model, predicted: &Motion) {
        self.dynamics.torques(model, predicted, &self.u, &mut self.tau);
    }
}

/// A torque impulse that does not depend on the velocities.
fn constant_drive(drive: f64) -> StageJoint {
    StageJoint { drive, stiffness: 0.0, limit: f64::INFINITY }
}

/// A stage that ends farther than this from its prediction is predicted again \[m\].
const MAX_DEVIATION: f64 = 2e-3;
const MAX_PREDICTIONS: u32 = 4;

/// The accuracy of stages, or of a smooth plant, that was chosen.
pub(super) fn tolerance_of(config: &ImplicitConfig) -> f64 {
    config.tolerance.unwrap_or(TOLERANCE * config.precision.scale())
}

/// At the default precision \[m/s\].
const TOLERANCE: f64 = 1e-6;
