//! One robot that can be advanced: model, scheme, state and counters together.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::contact::gap;
use crate::control::PdConfig;
use crate::error::ConfigError;
use crate::gait::JointReference;
use crate::planar::{PlanarState, Pose, Twist, assemble_chain, largest_joint_gap};
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Peg, Scene, SceneConfig};
use crate::stepper::{Implicit, IntegratorConfig, Method, Plant, Tally, Thesis, WarmStart};

/// The scheme chosen at construction.
#[derive(Debug, Clone)]
enum Scheme {
    Thesis(Box<Thesis>),
    Implicit(Box<Implicit>),
}

/// A robot in a scene under a joint controller.
#[derive(Debug, Clone)]
pub struct PlanarSimulation {
    plant: Plant,
    scheme: Scheme,
    largest_step: f64,
    state: PlanarState,
    /// Last state known to be finite.
    last_good: PlanarState,
    tally: Tally,
    joint_torque: Vec<f64>,
}

/// All that a run changes: enough to continue it elsewhere bit for bit (`implicit` only).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulationState {
    state: PlanarState,
    warm_start: WarmStart,
}

/// What happened during one [`PlanarSimulation::advance`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepReport {
    pub steps: u32,
    pub iterations: u32,
    /// Steps retaken because a peg contact closed.
    pub events: u32,
    /// Stages that ended before their tolerance was met.
    pub misses: u32,
    /// Worst certified residual \[m/s\].
    pub residual: f64,
    /// Worst duality gap \[J\].
    pub gap: f64,
    /// \[J\], never positive.
    pub friction_work: f64,
    /// \[J\].
    pub actuator_work: f64,
    /// \[J\].
    pub positive_actuator_work: f64,
    /// The state became absurd; the simulation stays at its last good state.
    pub diverged: bool,
}

impl PlanarSimulation {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new(
        robot: &RobotConfig,
        scene: &SceneConfig,
        controller: &PdConfig,
        integrator: &IntegratorConfig,
    ) -> Result<Self, ConfigError> {
        let robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let links = robot.link_count();
        let plant = Plant::new(robot, &scene, *controller).map_err(|e| e.inside("controller"))?;
        let scheme = match integrator.method {
            Method::Thesis => Scheme::Thesis(Box::new(Thesis::new(*integrator, links))),
            Method::Implicit => Scheme::Implicit(Box::new(Implicit::new(*integrator, links))),
        };
        let mut simulation = Self {
            plant,
            scheme,
            largest_step: integrator.step(),
            state: PlanarState::zero(links),
            last_good: PlanarState::zero(links),
            tally: Tally::new(links),
            joint_torque: vec![0.0; links - 1],
        };
        simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; links - 1]);
        Ok(simulation)
    }

    pub fn robot(&self) -> &Robot {
        &self.plant.robot
    }

    pub fn pegs(&self) -> &[Peg] {
        self.plant.pegs.pegs()
    }

    pub fn state(&self) -> &PlanarState {
        &self.state
    }

    /// Replaces the pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        self.plant.pegs.rebuild(pegs);
        self.forget();
    }

    /// Takes poses and twists over and forgets the past.
    pub fn place(&mut self, state: &PlanarState) {
        self.state.copy_from(state);
        self.last_good.copy_from(state);
        self.forget();
    }

    /// Places the robot at rest at time 0: CG of link 1, its absolute angle, and all joint angles.
    pub fn place_chain(&mut self, x: f64, y: f64, heading: f64, joint_angle: &[f64]) {
        self.state.time = 0.0;
        self.state.twist.fill(Twist::zeros());
        assemble_chain(&self.plant.robot, Pose::new(x, y, heading), joint_angle, &mut self.state.pose);
        self.last_good.copy_from(&self.state);
        self.forget();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &impl JointReference) -> StepReport {
        self.tally.clear();
        let steps = ((duration / self.largest_step - STEP_SLACK).ceil()).max(1.0);
        let (start, h) = (self.state.time, duration / steps);
        let mut diverged = false;
        for k in 1..=steps as u64 {
            match &mut self.scheme {
                Scheme::Thesis(scheme) => scheme.step(&self.plant, &mut self.state, h, reference, &mut self.tally),
                Scheme::Implicit(scheme) => scheme.step(&self.plant, &mut self.state, h, reference, &mut self.tally),
            }
            self.state.time = start + h * k as f64;
            if !self.is_sane() {
                diverged = true;
                self.return_to_last_good();
                break;
            }
        }
        self.last_good.copy_from(&self.state);
        self.read_joint_torque(diverged);
        self.report(diverged)
    }

    /// Impulse of the pegs on each link during the last `advance`, world frame \[N s\].
    pub fn contact_impulse(&self) -> &[Vector2<f64>] {
        &self.tally.contact_impulse
    }

    /// tau_C of each joint in the last step, thesis sign (T 3.51) \[N m\].
    pub fn joint_torque(&self) -> &[f64] {
        &self.joint_torque
    }

    /// \[J\]
    pub fn kinetic_energy(&self) -> f64 {
        self.state.kinetic_energy(&self.plant.robot)
    }

    /// Smallest link-peg gap now \[m\]; infinite without pegs nearby.
    pub fn min_gap(&self) -> f64 {
        let mut smallest = f64::INFINITY;
        for (pose, link) in self.state.pose.iter().zip(&self.plant.robot.links) {
            self.plant.pegs.visit_near(pose.x, pose.y, link.reach(), |peg| {
                smallest = smallest.min(gap(pose, link, &self.plant.pegs.pegs()[peg]));
            });
        }
        smallest
    }

    /// Widest gap of a joint now \[m\].
    pub fn joint_gap(&self) -> f64 {
        largest_joint_gap(&self.plant.robot, &self.state.pose)
    }

    /// The changing part of a simulation with the `implicit` method.
    pub fn snapshot(&self) -> SimulationState {
        let warm_start = match &self.scheme {
            Scheme::Implicit(scheme) => scheme.warm_start.clone(),
            Scheme::Thesis(_) => WarmStart::new(self.state.pose.len()),
        };
        SimulationState { state: self.state.clone(), warm_start }
    }

    /// Continues from a snapshot of a simulation of the same configuration.
    pub fn restore(&mut self, snapshot: &SimulationState) {
        self.place(&snapshot.state);
        if let Scheme::Implicit(scheme) = &mut self.scheme {
            scheme.warm_start.clone_from(&snapshot.warm_start);
        }
    }

    fn forget(&mut self) {
        self.tally.clear();
        self.joint_torque.fill(0.0);
        match &mut self.scheme {
            Scheme::Thesis(scheme) => scheme.clear(),
            Scheme::Implicit(scheme) => scheme.warm_start.clear(),
        }
    }

    fn is_sane(&self) -> bool {
        let slow = |u: &Twist| u.xy().norm() < MAX_SPEED && u.z.abs() < MAX_RATE;
        self.state.is_finite() && self.state.twist.iter().all(slow)
    }

    fn return_to_last_good(&mut self) {
        let good = self.last_good.clone();
        self.place(&good);
        self.state.twist.fill(Twist::zeros());
    }

    fn read_joint_torque(&mut self, diverged: bool) {
        if diverged {
            return;
        }
        match &self.scheme {
            Scheme::Thesis(scheme) => scheme.joint_torque(&mut self.joint_torque),
            Scheme::Implicit(scheme) => scheme.joint_torque(&mut self.joint_torque),
        }
    }

    fn report(&self, diverged: bool) -> StepReport {
        let tally = &self.tally;
        StepReport {
            steps: tally.steps,
            iterations: tally.iterations,
            events: tally.events,
            misses: tally.misses,
            residual: tally.residual,
            gap: tally.gap,
            friction_work: tally.friction_work,
            actuator_work: tally.actuator_work,
            positive_actuator_work: tally.positive_actuator_work,
            diverged,
        }
    }
}

/// A ratio of durations this close to a whole number counts as whole.
const STEP_SLACK: f64 = 1e-9;

/// Speeds beyond these are a diverged computation, not a robot \[m/s\], \[rad/s\].
const MAX_SPEED: f64 = 1e4;
const MAX_RATE: f64 = 1e6;
