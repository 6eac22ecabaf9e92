//! One robot that can be advanced: system, scheme, state and counters together.

mod planar;
mod spatial;

pub use planar::{PlanarSimulation, PlanarSnapshot};
pub use spatial::{SpatialSimulation, SpatialSnapshot};

use std::fmt::Debug;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::capabilities::{ModelName, require_supported};
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::pegs::PegGrid;
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Peg, Scene, SceneConfig};
use crate::stepping::{
    Body, Clock, CompiledModel, Driven, Fleet, IntegratorConfig, Model, Reference, RobotState, Scripted,
    StepStatistics, ThesisConfig, WarmStart,
};

/// A model of which a robot can be simulated by itself.
pub trait SimulatedModel: CompiledModel {
    /// The scheme as printed in the thesis.
    type Thesis: Debug + Clone;

    const NAME: ModelName;

    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    fn system(robot: Robot, scene: &Scene, controller: &ControllerConfig) -> Result<Self::System, ConfigError>;

    /// Places the robot straight and at rest.
    fn place_initially(simulation: &mut Simulation<Self>);

    fn new_thesis(config: ThesisConfig, system: &Self::System) -> Self::Thesis;

    /// Integrates over `duration` in equal steps no longer than the configured one.
    fn advance_thesis<D: Driven<Model = Self>>(
        scheme: &mut Self::Thesis,
        system: &Self::System,
        robot: &mut D,
        duration: f64,
    );

    /// Forgets all impulses.
    fn clear_thesis(scheme: &mut Self::Thesis);
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

/// All that a run changes: enough to continue it elsewhere bit for bit with the method `implicit`; `thesis` starts its
/// iteration from zero impulses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Snapshot<M: Model> {
    state: M::State,
    clock: Clock,
    warm_start: <M::WarmStart as WarmStart>::Saved,
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
        let robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let body = Body::new(&robot, PegGrid::new(&scene.pegs));
        let system = M::system(robot, &scene, controller)?;
        let (integrator, scheme) = match *integrator {
            IntegratorConfig::Thesis(config) => (*integrator, Scheme::Thesis(Box::new(M::new_thesis(config, &system)))),
            IntegratorConfig::Implicit(config) => {
                let fleet = Fleet::new(config, &system, 1);
                ((*fleet.config()).into(), Scheme::Implicit(Box::new(fleet)))
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

    /// Replaces the pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        self.body.pegs.rebuild(pegs);
        self.clear_memory();
    }

    /// Sets poses and twists and clears warm starts.
    pub fn place(&mut self, state: &M::State) {
        self.body.state.copy_from(state);
        self.clear_memory();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &impl Reference<M>) -> StepStatistics {
        let Self { system, body, scheme, .. } = self;
        let mut robot = Scripted { body: &mut *body, reference: Borrowed(reference) };
        match scheme {
            Scheme::Thesis(scheme) => M::advance_thesis(scheme, system, &mut robot, duration),
            Scheme::Implicit(fleet) => fleet.advance(system, std::slice::from_mut(&mut robot), duration, |_| true),
        }
        body.statistics
    }

    /// Impulse of the pegs on each link during the last `advance`, x and y of the world frame \[N s\]; it has no z
    /// part.
    pub fn contact_impulse(&self) -> &[Vector2<f64>] {
        &self.body.contact_impulse
    }

    /// The changing part of a simulation.
    pub fn snapshot(&self) -> Snapshot<M> {
        let Body { state, clock, warm_start, .. } = &self.body;
        Snapshot { state: state.clone(), clock: *clock, warm_start: warm_start.save() }
    }

    /// Continues from a snapshot of a simulation of the same configuration among the same pegs.
    pub fn restore(&mut self, snapshot: &Snapshot<M>) {
        self.place(&snapshot.state);
        self.body.clock = snapshot.clock;
        self.body.warm_start.resume(&snapshot.warm_start);
    }

    fn clear_memory(&mut self) {
        self.body.clear_memory();
        if let Scheme::Thesis(scheme) = &mut self.scheme {
            M::clear_thesis(scheme);
        }
    }
}

/// A reference that somebody else owns.
struct Borrowed<'a, R>(&'a R);

impl<M: Model, R: Reference<M>> Reference<M> for Borrowed<'_, R> {
    fn targets(&self, time: f64, targets: &mut [M::Target]) {
        self.0.targets(time, targets);
    }

    fn travelling_wave(&self, time: f64) -> Option<crate::gait::WaveJets> {
        self.0.travelling_wave(time)
    }

    fn next_jump(&self, time: f64) -> f64 {
        self.0.next_jump(time)
    }
}
