//! One environment with what drives its robot, and the changes that a hand makes to it.

use std::f64::consts::SQRT_2;
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::Deserialize;
use snake_core::ConfigError;
use snake_core::environment::action::ActionEntry;
use snake_core::environment::signal::{SignalInfo, signals_of};
use snake_core::environment::{EnvConfig, Environment, ModelKind, Outcome};
use snake_core::obstacles::{Moved, Obstacle, ObstacleGrid, OutOfPlane, Peg, ROLLING_FRICTION, Shape, Spring};
use snake_core::robot::Robot;

use crate::policy::Policy;
use crate::shown::Shown;

/// A session of either model, as the page uses it.
pub trait Play {
    fn reset(&mut self, seed: u64);
    fn reconfigure(&mut self, config: &EnvConfig) -> Result<(), ConfigError>;
    fn use_gait(&mut self, values: &[f64]);
    fn use_policy(&mut self, policy: Policy) -> Result<(), String>;
    fn step(&mut self);
    fn pull(&mut self, pull: Option<(usize, Vector3<f64>)>);
    fn move_peg(&mut self, peg: usize, x: f64, y: f64);
    fn add_peg(&mut self, kind: Kind, peg: Peg) -> bool;
    fn remove_peg(&mut self, peg: usize);

    fn actions(&self) -> &[ActionEntry];
    fn robot(&self) -> &Robot;
    fn control_period(&self) -> f64;
    fn torque_limit(&self) -> Option<f64>;
    fn links(&self) -> Vec<f64>;
    fn contact_force(&self) -> Vec<f64>;
    fn joint_torque(&self) -> Vec<f64>;
    fn pull_force(&self) -> Vector3<f64>;
    fn blocks(&self) -> Vec<&'static str>;
    fn pegs(&self) -> Vec<Peg>;
    fn springs(&self) -> Vec<(usize, Peg)>;
    fn boxes(&self) -> Vec<(usize, [f64; 2], f64)>;
    fn balls(&self) -> Vec<(usize, f64)>;
    fn goal(&self) -> [f64; 3];
    fn observation(&self) -> &[f32];
    fn action(&self) -> &[f64];
    fn signals(&self) -> Vec<(String, f64)>;
    fn residual(&self) -> f64;
    fn worst_residual(&self) -> f64;
    fn has_ended(&self) -> bool;
}

/// Pegs that a hand can add.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Does not move.
    Fixed,
    /// Gives way on a spring up to a stop; the planar model only.
    Spring,
    /// Lies on the ground and can be pushed; the planar model only.
    Loose,
    /// The same with a square outline.
    Box,
    /// Rolls; the spatial model only.
    Ball,
}

/// A disc, a box or a ball, and its motion if it can move.
#[derive(Debug, Clone)]
struct Placed {
    obstacle: Obstacle,
    moved: Option<Moved>,
}

impl Placed {
    /// The disc, or the circle around the box or the ball, when nothing has moved it.
    fn home(&self) -> Peg {
        match self.obstacle.shape {
            Shape::Circle(peg) => peg,
            Shape::Box { size: [length, width], x, y, .. } => Peg { radius: 0.5 * length.hypot(width), x, y },
            Shape::Sphere { radius, centre: [x, y, _], .. } => Peg { radius, x, y },
            // The page has no tasks with others.
            _ => Peg { radius: 0.0, x: f64::NAN, y: f64::NAN },
        }
    }

    /// The same where it is.
    fn peg(&self) -> Peg {
        let home = self.home();
        self.moved.map_or(home, |Moved { pose, .. }| Peg { x: pose.x, y: pose.y, ..home })
    }

    /// Sides and angle of a box where it is.
    fn edges(&self) -> Option<([f64; 2], f64)> {
        let Shape::Box { size, angle, .. } = self.obstacle.shape else { return None };
        Some((size, angle + self.moved.map_or(0.0, |moved| moved.pose.z)))
    }

    /// Carries it to another place, where it is at rest.
    fn carry(&mut self, peg: Peg) {
        self.obstacle.shape = match (&self.obstacle.shape, self.edges()) {
            (Shape::Sphere { .. }, _) => ball(peg),
            (_, None) => Shape::Circle(peg),
            (_, Some((size, angle))) => Shape::Box { size, x: peg.x, y: peg.y, angle },
        };
        self.moved = self.moved.map(|_| at_rest(&self.obstacle, peg));
    }
}

/// On the ground.
fn ball(Peg { radius, x, y }: Peg) -> Shape {
    Shape::Sphere { radius, centre: [x, y, radius], rolling_friction: ROLLING_FRICTION }
}

fn at_rest(obstacle: &Obstacle, peg: Peg) -> Moved {
    let height = if let Shape::Sphere { centre: [_, _, z], .. } = obstacle.shape { z } else { 0.0 };
    let out_of_plane = OutOfPlane { height, ..OutOfPlane::default() };
    Moved { out_of_plane, ..Moved::flat(Vector3::new(peg.x, peg.y, 0.0), Vector3::zeros()) }
}

/// An environment and its driver.
pub struct Session<M: 'static> {
    environment: Environment<M>,
    config: EnvConfig,
    signals: Vec<SignalInfo>,
    /// Places of the elements of the observation that policies with a memory remember.
    remembered: Vec<usize>,
    observation: Vec<f32>,
    outcome: Outcome,
    worst_residual: f64,
    /// Drives the robot; without one `action` stays as it is.
    policy: Option<Policy>,
    action: Vec<f64>,
    /// In the order in which the page knows them.
    pegs: Vec<Placed>,
    /// Link that is pulled, and where to \[m\].
    pull: Option<(usize, Vector3<f64>)>,
    pull_force: Vector3<f64>,
}

impl<M: Shown> Session<M> {
    /// # Errors
    /// Names the field of the configuration, its value and the admissible range.
    pub fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        let environment = Environment::<M>::new(config)?;
        let blocks = environment.observation_blocks().iter().filter(|block| block.row.memory);
        let mut session = Self {
            remembered: blocks.flat_map(|block| block.start..block.start + block.size()).collect(),
            observation: vec![0.0; environment.observation_size()],
            action: vec![0.0; environment.action_size()],
            outcome: environment.outcome(),
            signals: signals_of::<M>(),
            worst_residual: 0.0,
            policy: None,
            pegs: Vec::new(),
            pull: None,
            pull_force: Vector3::zeros(),
            config: config.clone(),
            environment,
        };
        session.environment.observe(&mut session.observation);
        session.find_pegs();
        Ok(session)
    }

    /// Takes over the pegs of the environment.
    fn find_pegs(&mut self) {
        let obstacles = self.environment.obstacles();
        let mut moved = self.environment.model_mut().movables_mut().iter().copied();
        let of = |obstacle: Obstacle| {
            let moved = obstacle.mass.and_then(|_| moved.next());
            Placed { obstacle, moved }
        };
        self.pegs = obstacles.into_iter().map(of).collect();
    }

    /// Notes where those are that move.
    fn follow_pegs(&mut self) {
        let moving = self.pegs.iter_mut().filter_map(|peg| peg.moved.as_mut());
        for (known, now) in moving.zip(self.environment.model_mut().movables_mut()) {
            *known = *now;
        }
    }

    /// Replaces the pegs; the time since the start, on which the choice of steps depends, goes on.
    fn place_pegs(&mut self) {
        let obstacles: Vec<_> = self.pegs.iter().map(|peg| peg.obstacle.clone()).collect();
        let simulation = self.environment.model_mut().simulation_mut();
        let clock = simulation.body().clock;
        simulation.set_obstacles(Arc::new(ObstacleGrid::of(&obstacles)));
        simulation.body_mut().clock = clock;
        let moving = self.pegs.iter().filter_map(|peg| peg.moved);
        for (now, known) in self.environment.model_mut().movables_mut().iter_mut().zip(moving) {
            *now = known;
        }
        self.environment.observe(&mut self.observation);
    }

    /// How far a peg overlaps a link seen from above \[m\], and the direction out of it.
    fn overlap(&self, peg: &Peg, link: usize) -> (f64, Vector2<f64>) {
        let model = self.environment.model();
        let [rear, front] = model.centre_line(link);
        let (centre, along) = (Vector2::new(peg.x, peg.y), front - rear);
        let length = along.norm_squared();
        let place = if length > 0.0 { ((centre - rear).dot(&along) / length).clamp(0.0, 1.0) } else { 0.5 };
        let apart = centre - (rear + along * place);
        let out = apart.try_normalize(0.0).unwrap_or_else(Vector2::y);
        (peg.radius + model.robot().links[link].radius - apart.norm(), out)
    }

    /// How far a peg overlaps another one \[m\], and the direction out of it; fixed ones may overlap.
    fn overlap_of_pegs(&self, peg: &Peg, moves: bool, other: &Placed) -> (f64, Vector2<f64>) {
        if !moves && other.moved.is_none() {
            return (0.0, Vector2::y());
        }
        let there = other.peg();
        let apart = Vector2::new(peg.x - there.x, peg.y - there.y);
        (peg.radius + there.radius - apart.norm(), apart.try_normalize(0.0).unwrap_or_else(Vector2::y))
    }

    /// The place nearest to a peg's, roughly, at which it touches neither the robot nor, where one of both moves, another
    /// peg than that with a number.
    fn beside(&self, mut peg: Peg, moves: bool, number: usize) -> Option<Peg> {
        let links = self.environment.robot().link_count();
        for _ in 0..ATTEMPTS {
            let of_links = (0..links).map(|link| self.overlap(&peg, link));
            let others = self.pegs.iter().enumerate().filter(|(other, _)| *other != number);
            let of_pegs = others.map(|(_, other)| self.overlap_of_pegs(&peg, moves, other));
            let deepest = of_links.chain(of_pegs).max_by(|a, b| a.0.total_cmp(&b.0))?;
            if deepest.0 <= 0.0 {
                return Some(peg);
            }
            let moved = (deepest.0 + CLEARANCE) * deepest.1;
            (peg.x, peg.y) = (peg.x + moved.x, peg.y + moved.y);
        }
        None
    }

    /// A damped spring between a link and the pointer, limited; its impulse of one control period comes at once.
    fn apply_pull(&mut self) {
        self.pull_force = Vector3::zeros();
        let Some((link, point)) = self.pull else { return };
        let model = self.environment.model_mut();
        let (position, _) = model.link_pose(link);
        let force = STIFFNESS * (point - position) - DAMPING * model.velocity(link);
        self.pull_force = force * (LARGEST_PULL / force.norm()).min(1.0);
        model.strike(link, &(self.pull_force * self.config.control_period));
    }
}

impl<M: Shown> Play for Session<M> {
    fn reset(&mut self, seed: u64) {
        self.outcome = self.environment.reset(Some(seed), &mut self.observation);
        self.find_pegs();
        self.pull = None;
        self.pull_force = Vector3::zeros();
        self.worst_residual = 0.0;
        if let Some(policy) = &mut self.policy {
            policy.forget();
            self.action.fill(0.0);
        }
    }

    fn reconfigure(&mut self, config: &EnvConfig) -> Result<(), ConfigError> {
        let mut next = Self::new(config)?;
        next.environment.restore(&self.environment.save())?;
        next.environment.set_difficulty(config.difficulty)?;
        next.environment.observe(&mut next.observation);
        next.outcome = next.environment.outcome();
        next.pegs.clone_from(&self.pegs);
        next.action.clone_from(&self.action);
        next.worst_residual = self.worst_residual;
        if let Some(policy) = self.policy.take().filter(|policy| fits(policy, &next).is_ok()) {
            next.policy = Some(policy);
        }
        *self = next;
        Ok(())
    }

    fn use_gait(&mut self, values: &[f64]) {
        self.policy = None;
        self.action.fill(0.0);
        for ((action, entry), value) in self.action.iter_mut().zip(self.environment.action_entries()).zip(values) {
            *action = entry.normalised(*value).clamp(-1.0, 1.0);
        }
    }

    fn use_policy(&mut self, policy: Policy) -> Result<(), String> {
        fits(&policy, self)?;
        self.policy = Some(policy);
        Ok(())
    }

    fn step(&mut self) {
        if let Some(policy) = &mut self.policy {
            self.action = policy.act(&self.observation, &self.remembered, self.config.control_period);
        }
        self.apply_pull();
        self.outcome = self.environment.step(&self.action, &mut self.observation);
        self.follow_pegs();
        self.worst_residual = self.worst_residual.max(self.residual());
    }

    fn pull(&mut self, pull: Option<(usize, Vector3<f64>)>) {
        self.pull = pull.filter(|(link, _)| *link < self.environment.robot().link_count());
    }

    fn move_peg(&mut self, number: usize, x: f64, y: f64) {
        let Some(before) = self.pegs.get(number) else { return };
        if let Some(moved) = self.beside(Peg { x, y, ..before.peg() }, before.moved.is_some(), number) {
            self.pegs[number].carry(moved);
            self.place_pegs();
        }
    }

    fn add_peg(&mut self, kind: Kind, peg: Peg) -> bool {
        let (moves, number) = (kind != Kind::Fixed, self.pegs.len());
        if moves && (M::KIND == ModelKind::Planar) == (kind == Kind::Ball) {
            return false;
        }
        let Some(peg) = self.beside(peg, moves, number) else { return false };
        let mut obstacle = Obstacle::from(peg);
        if moves {
            obstacle.mass = Some(PEG_MASS);
        }
        match kind {
            Kind::Fixed | Kind::Loose => {}
            Kind::Spring => (obstacle.spring, obstacle.ground_friction) = (Some(SPRING), 0.0),
            Kind::Box => {
                let size = [SQRT_2 * peg.radius; 2];
                obstacle.shape = Shape::Box { size, x: peg.x, y: peg.y, angle: 0.0 };
            }
            Kind::Ball => obstacle.shape = ball(peg),
        }
        let moved = moves.then(|| at_rest(&obstacle, peg));
        self.pegs.push(Placed { obstacle, moved });
        self.place_pegs();
        true
    }

    fn remove_peg(&mut self, peg: usize) {
        if peg < self.pegs.len() {
            self.pegs.remove(peg);
            self.place_pegs();
        }
    }

    fn actions(&self) -> &[ActionEntry] {
        self.environment.action_entries()
    }

    fn robot(&self) -> &Robot {
        self.environment.robot()
    }

    fn control_period(&self) -> f64 {
        self.config.control_period
    }

    fn torque_limit(&self) -> Option<f64> {
        self.config.controller.torque_limit
    }

    fn links(&self) -> Vec<f64> {
        let model = self.environment.model();
        let pose = |link| {
            let (r, q) = model.link_pose(link);
            [r.x, r.y, r.z, q.i, q.j, q.k, q.w]
        };
        (0..self.robot().link_count()).flat_map(pose).collect()
    }

    fn contact_force(&self) -> Vec<f64> {
        self.environment.model().contact_force().flat_map(|force| [force.x, force.y, force.z]).collect()
    }

    fn joint_torque(&self) -> Vec<f64> {
        self.environment.model().joint_torque()
    }

    fn pull_force(&self) -> Vector3<f64> {
        self.pull_force
    }

    fn blocks(&self) -> Vec<&'static str> {
        self.environment.observation_blocks().iter().map(|block| block.row.name).collect()
    }

    fn pegs(&self) -> Vec<Peg> {
        self.pegs.iter().map(Placed::peg).collect()
    }

    fn springs(&self) -> Vec<(usize, Peg)> {
        let held = self.pegs.iter().enumerate().filter(|(_, peg)| peg.obstacle.spring.is_some());
        held.map(|(number, peg)| (number, peg.home())).collect()
    }

    fn boxes(&self) -> Vec<(usize, [f64; 2], f64)> {
        let edges = |(number, peg): (usize, &Placed)| peg.edges().map(|(size, angle)| (number, size, angle));
        self.pegs.iter().enumerate().filter_map(edges).collect()
    }

    fn balls(&self) -> Vec<(usize, f64)> {
        let is_ball = |peg: &Placed| matches!(peg.obstacle.shape, Shape::Sphere { .. });
        let balls = self.pegs.iter().enumerate().filter(|(_, peg)| is_ball(peg));
        balls.filter_map(|(number, peg)| Some((number, peg.moved?.out_of_plane.height))).collect()
    }

    fn goal(&self) -> [f64; 3] {
        let goal = self.environment.goal();
        let point = goal.point();
        [point.x, point.y, goal.radius()]
    }

    fn observation(&self) -> &[f32] {
        &self.observation
    }

    fn action(&self) -> &[f64] {
        &self.action
    }

    fn signals(&self) -> Vec<(String, f64)> {
        let own = M::SIGNALS.iter().map(|signal| (signal.value)(self.environment.model()));
        let values = self.outcome.signals.iter().copied().chain(own);
        self.signals.iter().map(|signal| signal.name.clone().into_owned()).zip(values).collect()
    }

    fn residual(&self) -> f64 {
        self.environment.summary().residual
    }

    fn worst_residual(&self) -> f64 {
        self.worst_residual
    }

    fn has_ended(&self) -> bool {
        self.outcome.terminated || self.outcome.truncated
    }
}

/// # Errors
/// The policy was trained with other observations or actions.
fn fits<M: Shown>(policy: &Policy, session: &Session<M>) -> Result<(), String> {
    let (inputs, outputs) = (policy.inputs(session.remembered.len()), policy.outputs());
    let (seen, actions) = (session.observation.len(), session.action.len());
    if (inputs, outputs) == (seen, actions) {
        return Ok(());
    }
    Err(format!("policy with {inputs} inputs and {outputs} outputs: expected {seen} and {actions}, as of this robot"))
}

/// Distance of a peg from the robot after it has been pushed away from it \[m\].
const CLEARANCE: f64 = 1e-4;

/// Links out of which a peg is pushed one after the other before it stays where it is.
const ATTEMPTS: usize = 16;

/// Of the spring that pulls a link \[N/m\], \[N s/m\], \[N\]; with a link's mass of 0.68 kg stable at 50 ms.
const STIFFNESS: f64 = 60.0;
const DAMPING: f64 = 6.0;
const LARGEST_PULL: f64 = 30.0;

/// Of pegs that move \[kg\], and of those on springs.
const PEG_MASS: f64 = 0.5;
const SPRING: Spring = Spring { stiffness: 100.0, damping: 5.0, travel: Some(0.1) };
