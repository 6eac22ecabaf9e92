//! The thesis's scheme: midpoint time stepping with Algorithm 3.1 (T 3.6).

use crate::contact::{NearPair, NearPegs, gap};
use crate::gait::JointReference;
use crate::planar::{
    ModifiedNewton, Penalties, PlanarState, Pose, Stage, StageSolution, certify, close_joints,
};

use super::{IntegratorConfig, Plant, Tally};

/// Workspace of the scheme.
#[derive(Debug, Clone)]
pub struct Thesis {
    config: IntegratorConfig,
    stage: Stage,
    solution: StageSolution,
    iteration: ModifiedNewton,
    midpoint: Vec<Pose>,
    near: NearPegs,
    closed: Vec<NearPair>,
    /// P_H of every link-peg pair when it was last active \[N s\]: row = peg, column = link.
    last_impulse: Vec<f64>,
}

impl Thesis {
    pub fn new(config: IntegratorConfig, links: usize) -> Self {
        Self {
            config,
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            iteration: ModifiedNewton::new(links),
            midpoint: vec![Pose::zeros(); links],
            near: NearPegs::with_capacity(links),
            closed: Vec::with_capacity(links),
            last_impulse: Vec::new(),
        }
    }

    /// Forgets all impulses.
    pub fn clear(&mut self) {
        self.solution.friction.fill(nalgebra::Vector2::zeros());
        self.near.clear();
        self.last_impulse.fill(0.0);
    }

    /// tau_C of each joint in the last step, thesis sign (T 3.51) \[N m\].
    pub fn joint_torque(&self, torque: &mut [f64]) {
        for (torque, drive) in torque.iter_mut().zip(&self.solution.drive) {
            *torque = -drive / self.stage.coefficient;
        }
    }

    /// One step of length `h`: q_M, active set and directions there, impulsions, q_E, projection.
    pub fn step(&mut self, plant: &Plant, state: &mut PlanarState, h: f64, reference: &impl JointReference, tally: &mut Tally) {
        self.move_to_midpoint(state, h);
        self.find_closed_contacts(plant);
        self.build_stage(plant, state, h, reference);
        self.solve(tally);
        self.move_to_end(plant, state, h);
    }

    /// q_M = q_A + h/2 u_A (T 3.65).
    fn move_to_midpoint(&mut self, state: &PlanarState, h: f64) {
        for (midpoint, (q, u)) in self.midpoint.iter_mut().zip(state.pose.iter().zip(&state.twist)) {
            *midpoint = q + u * (0.5 * h);
        }
    }

    /// The set H of active contacts at q_M (T 3.47).
    fn find_closed_contacts(&mut self, plant: &Plant) {
        self.near.update(&self.midpoint, &plant.robot.links, &plant.pegs, 0.0);
        self.closed.clear();
        for pair in self.near.pairs() {
            let (link, peg) = (&plant.robot.links[pair.link], &plant.pegs.pegs()[pair.peg]);
            if gap(&self.midpoint[pair.link], link, peg) <= 0.0 {
                self.closed.push(*pair);
            }
        }
    }

    fn build_stage(&mut self, plant: &Plant, state: &PlanarState, h: f64, reference: &impl JointReference) {
        self.stage.coefficient = h;
        plant.fill_links(&mut self.stage, &self.midpoint, &state.twist);
        plant.fill_explicit_joints(&mut self.stage, &state.pose, &state.twist, reference, state.time);
        plant.fill_velocity_contacts(&mut self.stage, &self.closed, &self.midpoint);
        let links = self.stage.links.len();
        self.last_impulse.resize(links * plant.pegs.pegs().len(), 0.0);
        self.solution.contact.clear();
        self.solution.contact.extend(self.closed.iter().map(|pair| self.last_impulse[pair.peg * links + pair.link]));
    }

    fn solve(&mut self, tally: &mut Tally) {
        let r = Penalties { friction: self.config.r_t, contact: self.config.r_h };
        let (epsilon, cap) = (self.config.tolerance(), self.config.max_iterations());
        let outcome = self.iteration.solve(&self.stage, &mut self.solution, r, epsilon, cap);
        let links = self.stage.links.len();
        for (pair, impulse) in self.closed.iter().zip(&self.solution.contact) {
            self.last_impulse[pair.peg * links + pair.link] = *impulse;
        }
        let certificate = certify(&self.stage, &self.solution);
        tally.steps += 1;
        tally.add_solve(outcome.iterations, !outcome.converged, certificate.residual(), certificate.gap);
        tally.add_stage(&self.stage, &self.solution, 1.0);
    }

    /// q_E = q_M + h/2 u_E (T 3.74), then the projection of (T 3.6.3).
    fn move_to_end(&self, plant: &Plant, state: &mut PlanarState, h: f64) {
        for ((q, midpoint), u) in state.pose.iter_mut().zip(&self.midpoint).zip(&self.solution.twist) {
            *q = midpoint + u * (0.5 * h);
        }
        close_joints(&plant.robot, &mut state.pose);
        state.twist.copy_from_slice(&self.solution.twist);
        state.time += h;
    }
}
