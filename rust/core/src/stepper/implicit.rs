//! The default scheme: implicit stages, composed to first or second order.
//!
//! A stage with base configuration q_B, reference velocity u_R and coefficient c solves
//! `M (u - u_R) = impulses over c`, `q = q_B + c u` (see [`crate::planar::Stage`]).
//!
//! * Order 1, implicit Euler: one stage (q_A, u_A, h).
//! * Order 2, the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself:
//!   stage (q_A, u_A, gamma h) gives u_1; stage (q_A + (1 - gamma) h u_1,
//!   u_A + (1 - gamma)/gamma (u_1 - u_A), gamma h) gives u_E.
//!   The second reference velocity extrapolates the impulses of the first stage, which is wrong for
//!   impacts: a step in which a peg contact closes is retaken as a few Euler steps. Opening needs no
//!   such care, since the contact force reaches zero continuously.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::contact::NearPegs;
use crate::gait::JointReference;
use crate::planar::{Newton, PlanarState, Pose, Stage, StageSolution, Twist, certify, travel};

use super::stage_builder::largest_speed;
use super::{IntegratorConfig, Plant, Tally};

/// What one stage hands to the next: forces as a first guess, and which contacts were closed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WarmStart {
    /// Friction force on each link in its own frame \[N\].
    friction: Vec<Vector2<f64>>,
    near: NearPegs,
}

impl WarmStart {
    pub fn new(links: usize) -> Self {
        Self { friction: vec![Vector2::zeros(); links], near: NearPegs::with_capacity(links) }
    }

    pub fn clear(&mut self) {
        self.friction.fill(Vector2::zeros());
        self.near.clear();
    }
}

/// Workspace of the scheme.
#[derive(Debug, Clone)]
pub struct Implicit {
    config: IntegratorConfig,
    pub warm_start: WarmStart,
    stage: Stage,
    solution: StageSolution,
    newton: Newton,
    /// Data of the stage at hand.
    base: Vec<Pose>,
    predicted: Vec<Pose>,
    reference: Vec<Twist>,
    guess: Vec<Twist>,
    /// Works and impulses of a step until it is accepted.
    pending: Tally,
}

impl Implicit {
    pub fn new(config: IntegratorConfig, links: usize) -> Self {
        Self {
            config,
            warm_start: WarmStart::new(links),
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            base: vec![Pose::zeros(); links],
            predicted: vec![Pose::zeros(); links],
            reference: vec![Twist::zeros(); links],
            guess: vec![Twist::zeros(); links],
            pending: Tally::new(links),
        }
    }

    /// tau_C of each joint at the end of the last stage, thesis sign (T 3.51) \[N m\].
    pub fn joint_torque(&self, torque: &mut [f64]) {
        for (torque, drive) in torque.iter_mut().zip(&self.solution.drive) {
            *torque = -drive / self.stage.coefficient;
        }
    }

    /// Advances `state` by `h` seconds.
    pub fn step(&mut self, plant: &Plant, state: &mut PlanarState, h: f64, reference: &impl JointReference, tally: &mut Tally) {
        tally.steps += 1;
        if self.config.order == 2 && self.sdirk_step(plant, state, h, reference, tally) {
            return;
        }
        let substeps = if self.config.order == 2 { self.config.event_substeps } else { 1 };
        let start = state.time;
        for k in 1..=substeps {
            self.euler_step(plant, state, h / f64::from(substeps), reference, tally);
            state.time = start + h * f64::from(k) / f64::from(substeps);
        }
    }

    fn euler_step(&mut self, plant: &Plant, state: &mut PlanarState, h: f64, reference: &impl JointReference, tally: &mut Tally) {
        self.base.copy_from_slice(&state.pose);
        self.reference.copy_from_slice(&state.twist);
        self.guess.copy_from_slice(&state.twist);
        self.run_stage(plant, h, state.time + h, reference, tally);
        tally.add_stage(&self.stage, &self.solution, 1.0);
        self.accept(plant, state, h);
    }

    /// Returns false, with `state` as it was, if a peg contact closed on the way.
    fn sdirk_step(&mut self, plant: &Plant, state: &mut PlanarState, h: f64, reference: &impl JointReference, tally: &mut Tally) -> bool {
        let c = GAMMA * h;
        self.base.copy_from_slice(&state.pose);
        self.reference.copy_from_slice(&state.twist);
        self.guess.copy_from_slice(&state.twist);
        let event = self.run_stage(plant, c, state.time + c, reference, tally);
        if event {
            tally.events += 1;
            return false;
        }
        self.pending.clear();
        self.pending.add_stage(&self.stage, &self.solution, EXTRAPOLATION);
        for (i, u) in state.twist.iter().enumerate() {
            let change = self.solution.twist[i] - u;
            self.reference[i] = u + change * EXTRAPOLATION;
            self.guess[i] = u + change / GAMMA;
        }
        travel(&plant.robot, &state.pose, &self.solution.twist, h - c, &mut self.base);
        let event = self.run_stage(plant, c, state.time + h, reference, tally);
        if event {
            tally.events += 1;
            return false;
        }
        self.pending.add_stage(&self.stage, &self.solution, 1.0);
        tally.add_work(&self.pending);
        self.accept(plant, state, c);
        state.time += h;
        true
    }

    /// Solves one stage; returns whether a peg contact closed since the last accepted step.
    fn run_stage(&mut self, plant: &Plant, c: f64, end_time: f64, reference: &impl JointReference, tally: &mut Tally) -> bool {
        self.build_stage(plant, c, end_time, reference);
        self.load_warm_start();
        let outcome = self.newton.solve(&self.stage, &mut self.solution, self.config.tolerance(), self.config.max_iterations());
        let certificate = certify(&self.stage, &self.solution);
        tally.add_solve(outcome.iterations, !outcome.converged, certificate.residual(), certificate.gap);
        self.save_warm_start()
    }

    fn build_stage(&mut self, plant: &Plant, c: f64, end_time: f64, reference: &impl JointReference) {
        let robot = &plant.robot;
        let speed = largest_speed(&robot.links, &self.guess).max(largest_speed(&robot.links, &self.reference));
        let margin = MARGIN.max(2.0 * c * speed);
        travel(robot, &self.base, &self.guess, c, &mut self.predicted);
        self.warm_start.near.update(&self.predicted, &robot.links, &plant.pegs, margin);
        self.stage.coefficient = c;
        plant.fill_links(&mut self.stage, &self.predicted, &self.reference);
        plant.fill_implicit_joints(&mut self.stage, &self.base, reference, end_time);
        let pairs = self.warm_start.near.pairs();
        plant.fill_contacts(&mut self.stage, pairs, &self.base, &self.predicted, &self.guess, margin);
    }

    fn load_warm_start(&mut self) {
        let c = self.stage.coefficient;
        self.solution.twist.copy_from_slice(&self.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.warm_start.friction) {
            *impulse = force * c;
        }
        let pairs = self.warm_start.near.pairs();
        self.solution.contact.clear();
        self.solution.contact.extend(self.stage.contacts.iter().map(|contact| pairs[contact.pair].force * c));
    }

    /// Returns whether a contact is closed that was open after the last accepted step.
    fn save_warm_start(&mut self) -> bool {
        let c = self.stage.coefficient;
        for (force, impulse) in self.warm_start.friction.iter_mut().zip(&self.solution.friction) {
            *force = impulse / c;
        }
        let pairs = self.warm_start.near.pairs_mut();
        let mut closes = false;
        for (contact, impulse) in self.stage.contacts.iter().zip(&self.solution.contact) {
            let pair = &mut pairs[contact.pair];
            closes |= !pair.closed && *impulse > 0.0;
            pair.force = impulse / c;
        }
        closes
    }

    /// The stage's end becomes the state.
    fn accept(&mut self, plant: &Plant, state: &mut PlanarState, c: f64) {
        state.twist.copy_from_slice(&self.solution.twist);
        travel(&plant.robot, &self.base, &self.solution.twist, c, &mut state.pose);
        self.warm_start.near.pairs_mut().iter_mut().for_each(|pair| pair.closed = pair.force > 0.0);
    }
}

/// gamma = 1 - 1/sqrt 2, for which the two-stage SDIRK is of order 2 and L-stable.
const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// (1 - gamma) / gamma: weight of the first stage's impulses in the whole step.
const EXTRAPOLATION: f64 = (1.0 - GAMMA) / GAMMA;

/// Gap below which a pair becomes a contact of the stage \[m\]; faster robots look farther.
const MARGIN: f64 = 0.002;
