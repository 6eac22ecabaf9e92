//! One robot that can be advanced: model, scheme, state and counters together.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::capabilities::{ModelName, require_supported};
use crate::contact::gap;
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::gait::JointReference;
use crate::pegs::PegGrid;
use crate::planar::{
    Adaptive, Body, Fleet, Hardest, PlanarState, Plant, Pose, Scripted, Thesis, Twist, WarmStart, assemble_chain,
    largest_joint_gap,
};
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Peg, Scene, SceneConfig};
use crate::stepping::{IntegratorConfig, Method, StepReport};

/// The scheme chosen at construction.
#[derive(Debug, Clone)]
enum Scheme {
    Thesis(Box<Thesis>),
    Implicit(Box<Fleet>),
    Adaptive(Box<Adaptive>),
}

/// A robot in a scene under a joint controller.
#[derive(Debug, Clone)]
pub struct PlanarSimulation {
    plant: Plant,
    body: Body,
    scheme: Scheme,
}

/// All that a run changes: enough to continue it elsewhere bit for bit (`implicit` only).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimulationState {
    state: PlanarState,
    warm_start: WarmStart,
}

impl SimulationState {
    /// Whether this can be a state of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        let Self { state, warm_start } = self;
        let of_links = [state.pose.len(), state.twist.len(), warm_start.friction.len()];
        let of_joints = [warm_start.joint_torque.len(), warm_start.play.len()];
        of_links.iter().all(|&length| length == links)
            && of_joints.iter().all(|&length| length == links - 1)
            && warm_start.near.fits(links, pegs)
    }
}

impl PlanarSimulation {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new(
        robot: &RobotConfig,
        scene: &SceneConfig,
        controller: &ControllerConfig,
        integrator: &IntegratorConfig,
    ) -> Result<Self, ConfigError> {
        require_supported(ModelName::Planar, integrator.method, robot, scene, controller)?;
        let robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let body = Body::new(&robot, PegGrid::new(&scene.pegs));
        let joints = robot.joint_count();
        let plant = Plant::new(robot, scene.friction, *controller).map_err(|e| e.inside("controller"))?;
        let plant = plant.on_ground_with(scene.stribeck);
        let scheme = match integrator.method {
            Method::Thesis => Scheme::Thesis(Box::new(Thesis::new(*integrator, &plant))),
            Method::Implicit => Scheme::Implicit(Box::new(Fleet::new(*integrator, &plant, 1))),
            Method::Adaptive => Scheme::Adaptive(Box::new(Adaptive::new(*integrator, &plant))),
        };
        let mut simulation = Self { plant, body, scheme };
        simulation.place_chain(0.0, 0.0, 0.0, &vec![0.0; joints]);
        Ok(simulation)
    }

    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    pub fn body(&self) -> &Body {
        &self.body
    }

    pub fn body_mut(&mut self) -> &mut Body {
        &mut self.body
    }

    pub fn robot(&self) -> &Robot {
        &self.plant.robot
    }

    pub fn pegs(&self) -> &[Peg] {
        self.body.pegs.pegs()
    }

    pub fn state(&self) -> &PlanarState {
        &self.body.state
    }

    /// Replaces the pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        self.body.pegs.rebuild(pegs);
        self.forget();
    }

    /// Takes poses and twists over and forgets the past.
    pub fn place(&mut self, state: &PlanarState) {
        self.body.state.copy_from(state);
        self.forget();
    }

    /// Places the robot at rest at time 0: CG of link 1, its absolute angle, and all joint angles.
    pub fn place_chain(&mut self, x: f64, y: f64, heading: f64, joint_angle: &[f64]) {
        let state = &mut self.body.state;
        state.time = 0.0;
        state.twist.fill(Twist::zeros());
        assemble_chain(&self.plant.robot, Pose::new(x, y, heading), joint_angle, &mut state.pose);
        self.forget();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &impl JointReference) -> StepReport {
        let mut driver = Scripted { body: &mut self.body, reference };
        match &mut self.scheme {
            Scheme::Thesis(scheme) => scheme.advance(&self.plant, &mut driver, duration),
            Scheme::Adaptive(scheme) => scheme.advance(&self.plant, &mut driver, duration),
            Scheme::Implicit(fleet) => {
                fleet.advance(&self.plant, std::slice::from_mut(&mut driver), duration, |_| true);
            }
        }
        StepReport::new(&self.body.tally, self.body.diverged)
    }

    /// Impulse of the pegs on each link during the last `advance`, world frame \[N s\].
    pub fn contact_impulse(&self) -> &[Vector2<f64>] {
        &self.body.tally.contact_impulse
    }

    /// tau_C of each joint in the last step, thesis sign (T 3.51) \[N m\].
    pub fn joint_torque(&self) -> &[f64] {
        &self.body.warm_start.joint_torque
    }

    /// \[J\]
    pub fn kinetic_energy(&self) -> f64 {
        self.body.variation.mass * self.body.state.kinetic_energy(&self.plant.robot)
    }

    /// Smallest link-peg gap now \[m\]; infinite without pegs nearby.
    pub fn min_gap(&self) -> f64 {
        let Body { state, pegs, .. } = &self.body;
        let mut smallest = f64::INFINITY;
        for (pose, link) in state.pose.iter().zip(&self.plant.robot.links) {
            pegs.visit_near(pose.x, pose.y, link.reach(), |peg| {
                smallest = smallest.min(gap(pose, link, &pegs.pegs()[peg]));
            });
        }
        smallest
    }

    /// Widest gap of a joint now \[m\].
    pub fn joint_gap(&self) -> f64 {
        largest_joint_gap(&self.plant.robot, &self.body.state.pose)
    }

    /// From now on keeps the stage that took the most linear solves (`implicit` only).
    pub fn keep_hardest_stage(&mut self) {
        let links = self.robot().link_count();
        if let Scheme::Implicit(fleet) = &mut self.scheme {
            fleet.keep_hardest(Some(Hardest::new(links)));
        }
    }

    /// The stage that took the most linear solves since [`Self::keep_hardest_stage`], with their number; `None`
    /// before the first stage.
    pub fn hardest_stage(&mut self) -> Option<&Hardest> {
        match &mut self.scheme {
            Scheme::Implicit(fleet) => fleet.hardest().filter(|hardest| hardest.solves > 0),
            Scheme::Thesis(_) | Scheme::Adaptive(_) => None,
        }
    }

    /// The changing part of a simulation with the `implicit` or the `adaptive` method.
    pub fn snapshot(&self) -> SimulationState {
        SimulationState { state: self.body.state.clone(), warm_start: self.body.warm_start.clone() }
    }

    /// Continues from a snapshot of a simulation of the same configuration.
    pub fn restore(&mut self, snapshot: &SimulationState) {
        self.place(&snapshot.state);
        self.body.warm_start.clone_from(&snapshot.warm_start);
    }

    fn forget(&mut self) {
        self.body.forget();
        if let Scheme::Thesis(scheme) = &mut self.scheme {
            scheme.clear();
        }
    }
}
