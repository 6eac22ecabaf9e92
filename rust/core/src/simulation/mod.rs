//! One robot that can be advanced: system, scheme, state and counters together.

mod planar;
mod spatial;

pub use planar::{PlanarSimulation, PlanarSnapshot};
pub use spatial::{SpatialSimulation, SpatialSnapshot};

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::capabilities::{Feature, ModelName, require_supported};
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::gait::Reference;
use crate::obstacles::Peg;
use crate::pegs::PegGrid;
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Scene, SceneConfig};
use crate::stepping::{
    Body, Clock, CompiledModel, Fleet, IntegratorConfig, Model, Record, RobotState, Scripted, StepStatistics,
    ThesisScheme, WarmStart,
};

/// A model of which a robot can be simulated by itself.
pub trait SimulatedModel: CompiledModel {
    /// The scheme as printed in the thesis.
    type Thesis: ThesisScheme<Model = Self>;

    const NAME: ModelName;

    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    fn system(robot: Robot, scene: &Scene, controller: &ControllerConfig) -> Result<Self::System, ConfigError>;

    /// Places the robot straight and at rest.
    fn place_initially(simulation: &mut Simulation<Self>);
}

/// A robot in a scene under a joint controller.
#[derive(Debug, Clone)]
pub struct Simulation<M: SimulatedModel> {
    system: M::System,
    body: Body<M>,
    integrator: IntegratorConfig,
    scheme: Scheme<M>,
}

/// The scheme chosen at construction.
#[derive(Debug, Clone)]
enum Scheme<M: SimulatedModel> {
    Thesis(Box<M::Thesis>),
    Implicit(Box<Fleet<M>>),
}

/// All that a run changes: enough to continue it elsewhere bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Snapshot<M: Model> {
    state: M::State,
    clock: Clock,
    warm_start: <M::WarmStart as WarmStart>::Saved,
    /// With the method `thesis`, those of its impulses that are not zero, by their places \[N s\].
    impulses: Vec<(usize, f64)>,
}

impl<M: Model> Snapshot<M> {
    /// Whether this can be a state of a robot of `links` links among `pegs` pegs.
    pub fn fits(&self, links: usize, pegs: usize) -> bool {
        self.state.fits(links) && M::WarmStart::fits(&self.warm_start, links, pegs)
    }
}

impl<M: SimulatedModel> Simulation<M> {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new(
        robot: &RobotConfig,
        scene: &SceneConfig,
        controller: &ControllerConfig,
        integrator: &IntegratorConfig,
    ) -> Result<Self, ConfigError> {
        require_supported(M::NAME, integrator.method(), robot, scene, controller)?;
        let mut robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let has = |feature: Feature| feature.is_in(M::NAME, integrator.method());
        robot.self_contact &= has(Feature::SelfContact);
        if robot.self_contact {
            robot.require_parted_links().map_err(|e| e.inside("robot"))?;
        }
        if !has(Feature::JointLimits) {
            robot.joint_limit = f64::INFINITY;
        }
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let body = Body::new(&robot, PegGrid::of(&scene.obstacles));
        let system = M::system(robot, &scene, controller)?;
        let (integrator, scheme) = match *integrator {
            IntegratorConfig::Thesis(config) => {
                (*integrator, Scheme::Thesis(Box::new(M::Thesis::new(config, &system))))
            }
            IntegratorConfig::Implicit(config) => {
                let fleet = Fleet::new(config, &system, 1);
                (integrator.with_step(fleet.accuracy().step), Scheme::Implicit(Box::new(fleet)))
            }
        };
        let mut simulation = Self { system, body, integrator, scheme };
        M::place_initially(&mut simulation);
        Ok(simulation)
    }

    pub fn system(&self) -> &M::System {
        &self.system
    }

    pub fn body(&self) -> &Body<M> {
        &self.body
    }

    pub fn body_mut(&mut self) -> &mut Body<M> {
        &mut self.body
    }

    /// The configuration with the model's default step.
    pub fn integrator(&self) -> &IntegratorConfig {
        &self.integrator
    }

    pub fn robot(&self) -> &Robot {
        M::robot(&self.system)
    }

    pub fn pegs(&self) -> &[Peg] {
        self.body.pegs.pegs()
    }

    pub fn state(&self) -> &M::State {
        &self.body.state
    }

    /// Replaces all obstacles by pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        match Arc::get_mut(&mut self.body.pegs) {
            Some(own) => own.rebuild(pegs),
            None => self.body.pegs = PegGrid::new(pegs).into(),
        }
        self.clear_memory();
    }

    /// Replaces all obstacles, which robots may share; the caller has validated them.
    pub fn set_obstacles(&mut self, obstacles: Arc<PegGrid>) {
        self.body.pegs = obstacles;
        self.clear_memory();
    }

    /// Sets poses and twists and clears warm starts.
    pub fn place(&mut self, state: &M::State) {
        self.body.state.copy_from(state);
        self.clear_memory();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &impl Reference<M::Target>) -> StepStatistics {
        let Self { system, body, scheme, .. } = self;
        let mut robot = Scripted { body: &mut *body, reference };
        match scheme {
            Scheme::Thesis(scheme) => scheme.advance(system, &mut robot, duration),
            Scheme::Implicit(fleet) => fleet.advance(system, std::slice::from_mut(&mut robot), duration, |_| true),
        }
        body.statistics
    }

    /// Impulse of the obstacles on each link during the last `advance`, world frame \[N s\]; without a z part in the
    /// plane.
    pub fn contact_impulse(&self) -> &[Vector3<f64>] {
        &self.body.contact_impulse
    }

    /// Impulse of each obstacle, by its number, on the robot during the last `advance`, world frame \[N s\]; without a z
    /// part in the plane.
    pub fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        self.body.obstacle_impulse.sums()
    }

    /// Impulse of the robot's other links on each link during the last `advance`, world frame \[N s\]; without a z part in
    /// the plane.
    pub fn self_contact_impulse(&self) -> &[Vector3<f64>] {
        &self.body.self_contact_impulse
    }

    /// Records from now on the forces of the ground and of the robot on itself, and the work of the actuators.
    pub fn start_record(&mut self) {
        self.body.record = Some(Box::new(Record::new(self.robot().link_count())));
    }

    /// Place in the scene of each obstacle, by its number.
    pub fn places_of_obstacles(&self) -> Vec<usize> {
        let obstacles = &self.body.pegs;
        (0..obstacles.len()).map(|obstacle| obstacles.place_in_scene(obstacle)).collect()
    }

    /// What has been recorded since it was last cleared.
    pub fn record_mut(&mut self) -> Option<&mut Record> {
        self.body.record.as_deref_mut()
    }

    /// The changing part of a simulation.
    pub fn snapshot(&self) -> Snapshot<M> {
        let Body { state, clock, warm_start, .. } = &self.body;
        let impulses = match &self.scheme {
            Scheme::Thesis(scheme) => {
                let mut scheme = scheme.clone();
                let impulses = scheme.impulses(self.pegs().len()).enumerate();
                impulses
                    .filter(|(_, impulse)| impulse.to_bits() != 0)
                    .map(|(place, impulse)| (place, *impulse))
                    .collect()
            }
            Scheme::Implicit(_) => Vec::new(),
        };
        Snapshot { state: state.clone(), clock: *clock, warm_start: warm_start.save(), impulses }
    }

    /// Continues from a snapshot of a simulation of the same configuration among the same pegs.
    pub fn restore(&mut self, snapshot: &Snapshot<M>) {
        self.place(&snapshot.state);
        self.body.clock = snapshot.clock;
        self.body.warm_start.resume(&snapshot.warm_start);
        if let Scheme::Thesis(scheme) = &mut self.scheme {
            let mut impulses: Vec<_> = scheme.impulses(self.body.pegs.pegs().len()).collect();
            for (place, impulse) in &snapshot.impulses {
                impulses.get_mut(*place).into_iter().for_each(|kept| **kept = *impulse);
            }
        }
    }

    fn clear_memory(&mut self) {
        self.body.clear_memory();
        if let Scheme::Thesis(scheme) = &mut self.scheme {
            scheme.clear();
        }
    }
}
