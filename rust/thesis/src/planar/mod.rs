//! The thesis's scheme: midpoint time stepping with Algorithm 3.1 (T 3.6).

use explicit_io::ExplicitIo;
use nalgebra::{Vector2, Vector3};
use snake_core::ConfigError;
use snake_core::capabilities::Method;
use snake_core::contact::{NearObstacles, NearPair, PlacedLink, gap, link_peg_contact};
use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::gait::{JointTarget, Reference};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{
    Body, Heading, Planar, PlanarState, PlanarSystem, Pose, Stage, StageContact, StageJoint, StageLink, StageSolution,
    certify, close_joints, work_of,
};
use snake_core::robot::Link;
use snake_core::simulation::{Scheme, SchemeConfig};
use snake_core::stepping::{Driven, ObstacleImpulses, Record, StepStatistics};

use crate::ThesisConfig;
use crate::scheme::advance_in_equal_steps;

mod explicit_io;
mod modified_newton;

pub use modified_newton::{ModifiedNewton, Penalties};

/// Workspace of the scheme, for one robot.
#[derive(Debug, Clone)]
pub struct Thesis {
    config: ThesisConfig,
    stage: Stage,
    solution: StageSolution,
    iteration: ModifiedNewton,
    /// Input-output linearisation instead of PD.
    io: Option<ExplicitIo>,
    midpoint: Vec<Pose>,
    targets: Vec<JointTarget>,
    near: NearObstacles,
    previous: Vec<NearPair>,
    closed: Vec<NearPair>,
    /// P_H of every link-peg pair when it was last active \[N s\]: row = peg, column = link.
    last_impulse: Vec<f64>,
}

impl SchemeConfig<Planar> for ThesisConfig {
    type Scheme = Thesis;

    const METHOD: Method = Method::Thesis;

    fn validate(&self) -> Result<(), ConfigError> {
        ThesisConfig::validate(self)
    }

    fn scheme(&self, system: &PlanarSystem) -> Thesis {
        Thesis::new(*self, system)
    }
}

impl Scheme<Planar> for Thesis {
    fn step(&self) -> f64 {
        self.config.step
    }

    fn advance(&mut self, system: &PlanarSystem, robot: Driven<Planar>, duration: f64) {
        let (Driven { body, reference }, longest) = (robot, self.config.step);
        if !advance_in_equal_steps(body, duration, longest, |body, h| self.take_step(system, body, reference, h)) {
            self.clear();
        }
    }

    fn clear(&mut self) {
        self.solution.friction.fill(Vector2::zeros());
        self.near.clear();
        self.last_impulse.fill(0.0);
    }
}

impl Thesis {
    fn new(config: ThesisConfig, system: &PlanarSystem) -> Self {
        let links = system.robot.link_count();
        Self {
            config,
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            iteration: ModifiedNewton::new(links),
            io: (system.controller.law == ControlLaw::Io).then(|| ExplicitIo::new(system)),
            midpoint: vec![Pose::zeros(); links],
            targets: vec![JointTarget::default(); links - 1],
            near: NearObstacles::with_capacity(links),
            previous: Vec::new(),
            closed: Vec::with_capacity(links),
            last_impulse: Vec::new(),
        }
    }

    /// One step of length `h`: q_M, active set and directions there, impulses, q_E, projection.
    fn take_step(&mut self, system: &PlanarSystem, body: &mut Body, reference: &dyn Reference<JointTarget>, h: f64) {
        reference.targets(body.state.time, &mut self.targets);
        let Body { state, obstacles, statistics, impulses, obstacle_impulse, warm_start, record, .. } = body;
        self.move_to_midpoint(state, h);
        self.find_closed_contacts(system, state, obstacles);
        self.build_stage(system, state, obstacles, h);
        self.solve(obstacles, statistics);
        self.add_contact_impulses(&mut impulses.contact, obstacle_impulse);
        if let Some(record) = record {
            self.add_to(record);
        }
        self.move_to_end(system, state, h);
        self.near.advance(farthest(&system.robot.links, &self.midpoint, &state.pose));
        for (torque, drive) in warm_start.joint_torque.iter_mut().zip(&self.solution.actuator) {
            *torque = -drive / h;
        }
    }

    /// q_M = q_A + h/2 u_A (T 3.65).
    fn move_to_midpoint(&mut self, state: &PlanarState, h: f64) {
        for (midpoint, (q, u)) in self.midpoint.iter_mut().zip(state.pose.iter().zip(&state.twist)) {
            *midpoint = q + u * (0.5 * h);
        }
    }

    /// The set H of active contacts at q_M (T 3.47).
    fn find_closed_contacts(&mut self, system: &PlanarSystem, state: &PlanarState, obstacles: &ObstacleGrid) {
        let displacement = farthest(&system.robot.links, &state.pose, &self.midpoint);
        if !self.near.covers(displacement, 0.0) {
            let (poses, links) = (self.midpoint.iter().copied(), &system.robot.links);
            self.near.rebuild(poses, links, obstacles, 0.0, displacement, &mut self.previous);
        }
        self.near.advance(displacement);
        self.closed.clear();
        for pair in self.near.pairs() {
            let (link, peg) = (&system.robot.links[pair.link], &obstacles.pegs()[pair.obstacle]);
            if gap(&self.midpoint[pair.link], link, peg) <= 0.0 {
                self.closed.push(*pair);
            }
        }
    }

    /// Directions at q_M, reference velocity u_A, and the torque (T 3.51 != D8) at t_A held over the step.
    fn build_stage(&mut self, system: &PlanarSystem, state: &PlanarState, obstacles: &ObstacleGrid, h: f64) {
        let Self { stage, midpoint, .. } = self;
        let gain = (system.pull() * h).push(0.0);
        stage.coefficient = h;
        stage.links.clear();
        stage.links.extend(system.robot.links.iter().zip(midpoint.iter()).zip(&state.twist).map(|((link, q), u)| {
            StageLink {
                heading: Heading::of(q.z),
                reference: u + gain,
                mass: link.mass,
                inertia: link.inertia,
                half_length: 0.5 * link.length,
                cg_offset: 0.0,
                friction: system.friction_force(link) * h * system.stribeck.share(u.xy().norm_squared()),
            }
        }));
        let ControllerConfig { kp, kd, .. } = system.controller;
        let limit = h * system.controller.limit_at(state.time);
        if let Some(io) = &mut self.io {
            io.update(state, &self.targets);
        }
        stage.joints.clear();
        stage.joints.extend(self.targets.iter().enumerate().map(|(j, target)| {
            let torque = match &self.io {
                Some(io) => io.tau[j],
                None => kp * (target.angle - state.joint_angle(j)) + kd * (target.rate - state.joint_rate(j)),
            };
            StageJoint { drive: h * torque, stiffness: 0.0, limit, slack: 0.0 }
        }));
        stage.contacts.clear();
        for pair in &self.closed {
            let (q, heading) = (&midpoint[pair.link], stage.links[pair.link].heading);
            let link = (&system.robot.links[pair.link]).into();
            let placed = PlacedLink { link, pose: *q, axis: heading.axial() };
            let direction = link_peg_contact(&placed, &obstacles.pegs()[pair.obstacle]).direction;
            stage.contacts.push(StageContact { link: pair.link, direction, offset: 0.0 });
        }
    }

    fn solve(&mut self, obstacles: &ObstacleGrid, statistics: &mut StepStatistics) {
        let links = self.stage.links.len();
        self.last_impulse.resize(links * obstacles.pegs().len(), 0.0);
        let place = |pair: &NearPair| pair.obstacle * links + pair.link;
        self.solution.contact.clear();
        self.solution.contact.extend(self.closed.iter().map(|pair| self.last_impulse[place(pair)]));
        let r = Penalties { friction: self.config.r_t.unwrap_or(R_T), contact: self.config.r_h };
        let (epsilon, cap) = (self.config.tolerance.unwrap_or(EPSILON), self.config.max_iterations);
        let (iterations, converged) = self.iteration.solve(&self.stage, &mut self.solution, r, epsilon, cap);
        for (pair, impulse) in self.closed.iter().zip(&self.solution.contact) {
            self.last_impulse[place(pair)] = *impulse;
        }
        self.record(iterations, converged, statistics);
    }

    fn record(&self, iterations: u32, converged: bool, statistics: &mut StepStatistics) {
        let certificate = certify(&self.stage, &self.solution);
        statistics.steps += 1;
        statistics.add_solve(iterations, !converged, certificate.residual(), certificate.gap);
        statistics.add_work(&work_of(&self.stage, &self.solution), 0, 1.0);
    }

    /// Adds the impulses of the obstacles to the sums of the links and of the obstacles.
    fn add_contact_impulses(&self, of_link: &mut [Vector3<f64>], of_peg: &mut ObstacleImpulses) {
        let contacts = self.stage.contacts.iter().zip(&self.solution.contact);
        for (pair, (contact, impulse)) in self.closed.iter().zip(contacts) {
            let impulse = (contact.direction.xy() * *impulse).push(0.0);
            of_link[pair.link] += impulse;
            of_peg.add(pair.obstacle, impulse);
        }
    }

    /// Adds the step to what the run records.
    fn add_to(&self, record: &mut Record) {
        let StageSolution { twist, friction, actuator, .. } = &self.solution;
        for ((to, link), impulse) in record.sum.ground.iter_mut().zip(&self.stage.links).zip(friction) {
            to[0] += link.heading.to_world(*impulse).push(0.0);
        }
        for (j, (work, impulse)) in record.sum.actuator_work.iter_mut().zip(actuator).enumerate() {
            work[0] += impulse * (twist[j + 1].z - twist[j].z);
        }
    }

    /// q_E = q_M + h/2 u_E (T 3.74), then the projection of (T 3.6.3).
    fn move_to_end(&self, system: &PlanarSystem, state: &mut PlanarState, h: f64) {
        for ((q, midpoint), u) in state.pose.iter_mut().zip(&self.midpoint).zip(&self.solution.twist) {
            *q = midpoint + u * (0.5 * h);
        }
        close_joints(&system.robot, &mut state.pose);
        state.twist.copy_from_slice(&self.solution.twist);
    }
}

/// Bound on how far any point of the robot moves between two configurations \[m\].
fn farthest(links: &[Link], from: &[Pose], to: &[Pose]) -> f64 {
    let moved = |((link, from), to): ((&Link, &Pose), &Pose)| {
        let step = to - from;
        step.xy().norm() + link.reach() * step.z.abs()
    };
    links.iter().zip(from).zip(to).map(moved).fold(0.0, f64::max)
}

/// r_T of (T Table 7.2), planar model.
const R_T: f64 = 1.3;

/// epsilon of (T 3.81) \[N s\].
const EPSILON: f64 = 2e-5;
