//! The thesis's scheme: midpoint time stepping with Algorithms 4.1, 4.2 and 4.3 (T 4.6).
//!
//! | symbol | name here | meaning | unit |
//! | --- | --- | --- | --- |
//! | h | `smooth_force` | gravity and gyroscopic moment | N, N m |
//! | W_N, W_T, W_V | `GroundContact` | directions of normal, friction and rolling friction | m/s per twist |
//! | W_H | `PegContact` | direction of a peg's force | m/s per twist |
//! | W_J | `JointRows` | directions of a joint's constraint forces | m/s, 1/s per twist |

use nalgebra::{Matrix3, Vector2, Vector3, Vector6};
use snake_core::ConfigError;
use snake_core::capabilities::Method;
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, Reference};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::Link;
use snake_core::simulation::{Scheme, SchemeConfig};
use snake_core::spatial::{
    End, Pose, Spatial, SpatialBody, SpatialState, SpatialSystem, ground_gap, joint_angle, mass_diagonal, peg_gap,
    turning, twist_of,
};
use snake_core::stepping::{Driven, ObstacleImpulses, Record, StepStatistics};

use crate::ThesisConfig;
use crate::scheme::advance_in_equal_steps;

mod ground;
mod joint;
mod modified_newton;
mod motion;
mod peg;
mod step;
mod step_residual;

pub use ground::{GroundContact, ground_contact, ground_frame};
pub use joint::{JointRows, actuator_torque, joint_rows, printed_joint_rate};
pub use modified_newton::{ContactPenalties, ModifiedNewton};
pub use motion::{close_joints, smooth_force, travel};
pub use peg::{PegContact, peg_contact};
pub use step::{GroundImpulse, Step, StepGround, StepLink, StepPeg, StepSolution};
pub use step_residual::step_residual;

/// Workspace of the scheme, for one robot.
#[derive(Debug, Clone)]
pub struct SpatialThesis {
    config: ThesisConfig,
    step: Step,
    solution: StepSolution,
    iteration: ModifiedNewton,
    midpoint: Vec<Pose>,
    targets: Vec<CardanTarget>,
    /// Impulses of every contact when it was last active: two per link \[N s\].
    last_ground: Vec<[GroundImpulse; 2]>,
    /// The same for every link-peg pair: row = peg, column = link \[N s\].
    last_peg: Vec<f64>,
    /// Which of these the contacts of the present step are.
    ground: Vec<(usize, usize)>,
    pegs: Vec<usize>,
}

impl SchemeConfig<Spatial> for ThesisConfig {
    type Scheme = SpatialThesis;

    const METHOD: Method = Method::Thesis;

    fn validate(&self) -> Result<(), ConfigError> {
        ThesisConfig::validate(self)
    }

    fn scheme(&self, system: &SpatialSystem) -> SpatialThesis {
        SpatialThesis::new(*self, system)
    }
}

impl Scheme<Spatial> for SpatialThesis {
    fn step(&self) -> f64 {
        self.config.step
    }

    fn advance(&mut self, system: &SpatialSystem, robot: Driven<Spatial>, duration: f64) {
        let (Driven { body, reference }, longest) = (robot, self.config.step);
        if !advance_in_equal_steps(body, duration, longest, |body, h| self.take_step(system, body, reference, h)) {
            self.clear();
        }
    }

    fn clear(&mut self) {
        self.last_ground.fill(Default::default());
        self.last_peg.fill(0.0);
    }
}

impl SpatialThesis {
    fn new(config: ThesisConfig, system: &SpatialSystem) -> Self {
        let links = system.robot.link_count();
        Self {
            config,
            step: Step::with_capacity(links, system.friction, system.rolling_friction),
            solution: StepSolution::new(links),
            iteration: ModifiedNewton::new(links),
            midpoint: vec![Pose::identity(); links],
            targets: vec![CardanTarget::default(); links - 1],
            last_ground: vec![Default::default(); links],
            last_peg: Vec::new(),
            ground: Vec::with_capacity(2 * links),
            pegs: Vec::with_capacity(2 * links),
        }
    }

    /// Algorithm 4.1 with step length `h`.
    fn take_step(
        &mut self,
        system: &SpatialSystem,
        body: &mut SpatialBody,
        reference: &dyn Reference<CardanTarget>,
        h: f64,
    ) {
        reference.targets(body.state.time, &mut self.targets);
        let SpatialBody { state, obstacles, statistics, warm_start, record, .. } = body;
        let SpatialBody { impulses, obstacle_impulse, .. } = body;
        let joint_torque = &mut warm_start.last.joint_torque;
        self.move_to_midpoint(state, h);
        self.command(system, state, joint_torque);
        self.build_links(system, state, joint_torque, h);
        self.build_joints(&system.robot.links);
        self.find_closed_contacts(&system.robot.links, obstacles);
        self.recall_impulses(system.robot.link_count(), obstacles);
        let (iterations, converged) = self.solve();
        self.keep_impulses(&mut impulses.ground);
        self.record(iterations, !converged, joint_torque, h, statistics);
        if let Some(record) = record {
            self.add_to(record, joint_torque, h);
        }
        self.move_to_end(system, state, h);
        self.add_contact_impulses(&mut impulses.contact, obstacle_impulse);
    }

    /// q_M = q_A + h/2 F(q_A) u_A (T 4.103).
    fn move_to_midpoint(&mut self, state: &SpatialState, h: f64) {
        for (midpoint, (q, u)) in self.midpoint.iter_mut().zip(state.pose.iter().zip(&state.twist)) {
            *midpoint = travel(q, u, 0.5 * h);
        }
    }

    /// Torques from angles and rates at the start of the step, held over it (T Remark 4.1).
    fn command(&self, system: &SpatialSystem, state: &SpatialState, torque: &mut [Vector2<f64>]) {
        let SpatialState { pose, twist, time, .. } = state;
        for (j, (torque, target)) in torque.iter_mut().zip(&self.targets).enumerate() {
            let angle = joint_angle(&pose[j], &pose[j + 1]);
            let rate = printed_joint_rate(&pose[j], &twist[j], &pose[j + 1], &twist[j + 1]);
            *torque = joint_torque(&system.controller, target, angle, rate, *time);
        }
    }

    /// u_A + M^-1 (h + tau) dt, torques along the axes at q_M.
    fn build_links(&mut self, system: &SpatialSystem, state: &SpatialState, torque: &[Vector2<f64>], h: f64) {
        let Self { step, midpoint, .. } = self;
        step.links.clear();
        step.links.extend(system.robot.links.iter().zip(&state.twist).map(|(link, u)| {
            let inverse_mass = mass_diagonal(link).map(f64::recip);
            let force = smooth_force(link, &system.gravity, u);
            StepLink { reference: u + inverse_mass.component_mul(&force) * h, inverse_mass }
        }));
        for (j, torque) in torque.iter().enumerate() {
            for (i, moment) in actuator_torque(&midpoint[j], &midpoint[j + 1], *torque).iter().enumerate() {
                let StepLink { reference, inverse_mass } = &mut step.links[j + i];
                let mut turn = reference.fixed_rows_mut::<3>(3);
                turn += turning(inverse_mass).component_mul(moment) * h;
            }
        }
    }

    fn build_joints(&mut self, links: &[Link]) {
        let pairs = links.windows(2).zip(self.midpoint.windows(2));
        self.step.joints.clear();
        self.step.joints.extend(pairs.map(|(link, q)| joint_rows(&link[0], &q[0], &link[1], &q[1])));
    }

    /// The sets I and H of active contacts at q_M and their directions (T 4.106), (T 4.107).
    fn find_closed_contacts(&mut self, links: &[Link], obstacles: &ObstacleGrid) {
        let Self { step, midpoint, ground, pegs: pairs, .. } = self;
        step.ground.clear();
        step.pegs.clear();
        ground.clear();
        pairs.clear();
        for (i, (link, q)) in links.iter().zip(midpoint.iter()).enumerate() {
            for (k, end) in End::BOTH.into_iter().enumerate() {
                if ground_gap(link, q, end) <= 0.0 {
                    step.ground.push(StepGround { link: i, rows: ground_contact(link, q, end) });
                    ground.push((i, k));
                }
            }
            obstacles.near(q.position.x, q.position.y, link.reach()).for_each(|peg| {
                if peg_gap(link, q, &obstacles.pegs()[peg]) <= 0.0 {
                    let direction = peg_contact(link, q, &obstacles.pegs()[peg]).direction;
                    step.pegs.push(StepPeg { link: i, direction });
                    pairs.push(peg * links.len() + i);
                }
            });
        }
    }

    /// Starts from the impulses that these contacts had when they were last active.
    fn recall_impulses(&mut self, links: usize, obstacles: &ObstacleGrid) {
        let Self { solution, ground, pegs: pairs, last_ground, last_peg, .. } = self;
        last_peg.resize(links * obstacles.pegs().len(), 0.0);
        solution.ground.clear();
        solution.ground.extend(ground.iter().map(|&(link, end)| last_ground[link][end]));
        solution.peg.clear();
        solution.peg.extend(pairs.iter().map(|&pair| last_peg[pair]));
    }

    /// Keeps the impulses for the next step and adds the ground's normal ones to the sums of their links.
    fn keep_impulses(&mut self, ground_impulse: &mut [f64]) {
        for (&(link, end), impulse) in self.ground.iter().zip(&self.solution.ground) {
            self.last_ground[link][end] = *impulse;
            ground_impulse[link] += impulse.normal;
        }
        for (&pair, impulse) in self.pegs.iter().zip(&self.solution.peg) {
            self.last_peg[pair] = *impulse;
        }
    }

    fn solve(&mut self) -> (u32, bool) {
        let ThesisConfig { r_n, r_t, r_v, r_h, .. } = self.config;
        let r = ContactPenalties { normal: r_n, friction: r_t.unwrap_or(R_T), rolling: r_v, peg: r_h };
        let (epsilon, cap) = (self.config.tolerance.unwrap_or(EPSILON), self.config.max_iterations);
        self.iteration.solve(&self.step, &mut self.solution, r, epsilon, cap)
    }

    fn record(
        &self,
        iterations: u32,
        unconverged: bool,
        torque: &[Vector2<f64>],
        h: f64,
        statistics: &mut StepStatistics,
    ) {
        let Self { step, solution, midpoint, .. } = self;
        statistics.steps += 1;
        statistics.add_solve(iterations, unconverged, step_residual(step, solution), 0.0);
        for (contact, impulse) in step.ground.iter().zip(&solution.ground) {
            let u = &solution.twist[contact.link];
            let rows = &contact.rows;
            statistics.friction_work +=
                impulse.tangent.dot(&rows.tangent.tr_mul(u)) + impulse.rolling.dot(&rows.rolling.tr_mul(u));
        }
        for (j, torque) in torque.iter().enumerate() {
            let moments = actuator_torque(&midpoint[j], &midpoint[j + 1], *torque);
            let power = |(k, moment)| turning(&solution.twist[j + k]).dot(moment);
            let work = h * moments.iter().enumerate().map(power).sum::<f64>();
            statistics.actuator_work += work;
            statistics.positive_actuator_work += work.max(0.0);
        }
    }

    /// Adds the impulses of the pegs to the sums of the links and of the pegs.
    fn add_contact_impulses(&self, of_link: &mut [Vector3<f64>], of_peg: &mut ObstacleImpulses) {
        let links = self.step.links.len();
        for (pair, (contact, impulse)) in self.pegs.iter().zip(self.step.pegs.iter().zip(&self.solution.peg)) {
            let impulse = contact.direction.fixed_rows::<3>(0) * *impulse;
            of_link[contact.link] += impulse;
            of_peg.add(pair / links, impulse);
        }
    }

    /// Adds the step to what the run records.
    fn add_to(&self, record: &mut Record, torque: &[Vector2<f64>], h: f64) {
        let Self { step, solution, midpoint, .. } = self;
        for ((&(link, end), contact), impulse) in self.ground.iter().zip(&step.ground).zip(&solution.ground) {
            let friction = (contact.rows.tangent * impulse.tangent).xy();
            record.sum.ground[link][end] += friction.push(impulse.normal);
        }
        for (j, (work, torque)) in record.sum.actuator_work.iter_mut().zip(torque).enumerate() {
            for axis in 0..2 {
                let mut alone = Vector2::zeros();
                alone[axis] = torque[axis];
                let moments = actuator_torque(&midpoint[j], &midpoint[j + 1], alone);
                let power = |(k, moment)| turning(&solution.twist[j + k]).dot(moment);
                work[axis] += h * moments.iter().enumerate().map(power).sum::<f64>();
            }
        }
    }

    /// q_E = q_M + h/2 F(q_M) u_E (T 4.108), then Algorithm 4.3.
    fn move_to_end(&self, system: &SpatialSystem, state: &mut SpatialState, h: f64) {
        for ((q, midpoint), u) in state.pose.iter_mut().zip(&self.midpoint).zip(&self.solution.twist) {
            *q = travel(midpoint, u, 0.5 * h);
        }
        close_joints(&system.robot, &mut state.pose);
        state.twist.copy_from_slice(&self.solution.twist);
    }
}

/// tau_C = (yaw, pitch) of a joint from its angles and rates (T 4.101), (T 4.102), within the limit at `time`
/// \[N m\].
fn joint_torque(
    controller: &ControllerConfig,
    target: &CardanTarget,
    angle: Vector2<f64>,
    rate: Vector2<f64>,
    time: f64,
) -> Vector2<f64> {
    let ControllerConfig { kp, kd, .. } = *controller;
    let limit = controller.limit_at(time);
    let wanted_angle = Vector2::new(target.yaw.angle, target.pitch.angle);
    let wanted_rate = Vector2::new(target.yaw.rate, target.pitch.rate);
    let torque = -(wanted_angle - angle) * kp - (wanted_rate - rate) * kd;
    torque.map(|torque| torque.clamp(-limit, limit))
}

/// Direction of a force along `axis` (frame I) at `arm` from the CG (frame I): its power is this times the twist
/// (T 4.25).
fn force_direction(rotation: &Matrix3<f64>, axis: &Vector3<f64>, arm: &Vector3<f64>) -> Vector6<f64> {
    twist_of(*axis, rotation.tr_mul(&arm.cross(axis)))
}

/// r_T of (T Table 7.2), 3D model.
const R_T: f64 = 0.01;

/// epsilon of (T 3.81) \[N s\].
const EPSILON: f64 = 2e-5;
