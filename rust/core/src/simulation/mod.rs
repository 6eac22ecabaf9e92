//! One robot that can be advanced: system, scheme, state and counters together.

mod apart;
mod planar;
mod scheme;
mod spatial;

pub use apart::require_apart;
pub use planar::{PlanarSimulation, PlanarSnapshot};
pub use scheme::{Scheme, SchemeConfig};
pub use spatial::{SpatialSimulation, SpatialSnapshot};

use std::ops::Add;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::capabilities::{Feature, ModelName, require_supported};
use crate::contact::obstacle_gap;
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::gait::Reference;
use crate::obstacles::{Movable, Moved, ObstacleGrid, Peg};
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Scene, SceneConfig};
use crate::spatial::ball_gap;
use crate::stepping::{Body, Clock, Driven, Fleet, Model, Record, StateOf, StepStatistics, WarmStart, steps_in};

/// A model of which a robot can be simulated by itself.
pub trait SimulatedModel: Model {
    const NAME: ModelName;

    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    fn system(robot: Robot, scene: &Scene, controller: &ControllerConfig) -> Result<Self::System, ConfigError>;

    /// Places the robot straight and at rest.
    fn place_initially<S: Scheme<Self>>(simulation: &mut Simulation<Self, S>);

    /// [`Simulation::energy`] and the three gaps.
    fn energy<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64;
    fn min_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64;
    fn self_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64;
    fn joint_gap<S: Scheme<Self>>(simulation: &Simulation<Self, S>) -> f64;
}

/// A robot in a scene under a joint controller, advanced by the scheme `S`.
#[derive(Debug, Clone)]
pub struct Simulation<M: SimulatedModel, S = Fleet<M>> {
    /// Shared by copies.
    system: Arc<M::System>,
    body: Body<M>,
    scheme: Box<S>,
}

/// All that a run with the default scheme changes: enough to continue it elsewhere bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Snapshot<M: Model> {
    state: StateOf<M>,
    clock: Clock,
    warm_start: <M::WarmStart as WarmStart>::Saved,
}

impl<M: Model> Snapshot<M> {
    /// Whether this can be a state of a robot of `links` links among these obstacles.
    pub fn fits(&self, links: usize, obstacles: &ObstacleGrid) -> bool {
        self.state.fits(links, obstacles.movables().len()) && M::WarmStart::fits(&self.warm_start, links, obstacles)
    }
}

impl<M: SimulatedModel, S: Scheme<M>> Simulation<M, S> {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new<C: SchemeConfig<M, Scheme = S>>(
        robot: &RobotConfig,
        scene: &SceneConfig,
        controller: &ControllerConfig,
        integrator: &C,
    ) -> Result<Self, ConfigError> {
        require_supported(M::NAME, C::METHOD, robot, scene, controller)?;
        let controller = controller.driving(robot);
        let mut robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let has = |feature: Feature| feature.is_in(M::NAME, C::METHOD);
        robot.self_contact &= has(Feature::SelfContact);
        if robot.self_contact {
            robot.require_parted_links().map_err(|e| e.inside("robot"))?;
        }
        if !has(Feature::JointLimits) {
            robot.joint_bounds.fill([f64::NEG_INFINITY, f64::INFINITY]);
        }
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let obstacles = ObstacleGrid::of(&scene.obstacles);
        require_apart(&obstacles)?;
        let body = Body::new(&robot, obstacles);
        let system = Arc::new(M::system(robot, &scene, &controller)?);
        let scheme = Box::new(integrator.scheme(&system));
        let mut simulation = Self { system, body, scheme };
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

    /// Number of equal steps that divide `duration`.
    pub fn steps_in(&self, duration: f64) -> u32 {
        steps_in(duration, self.scheme.step())
    }

    pub fn robot(&self) -> &Robot {
        M::robot(&self.system)
    }

    pub fn pegs(&self) -> &[Peg] {
        self.body.obstacles.pegs()
    }

    pub fn state(&self) -> &StateOf<M> {
        &self.body.state
    }

    /// Replaces all obstacles by pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        match Arc::get_mut(&mut self.body.obstacles) {
            Some(own) => own.rebuild(pegs),
            None => self.body.obstacles = ObstacleGrid::new(pegs).into(),
        }
        self.place_movables();
        self.clear_memory();
    }

    /// Replaces all obstacles, which robots may share; the caller has validated them.
    pub fn set_obstacles(&mut self, obstacles: Arc<ObstacleGrid>) {
        self.body.obstacles = obstacles;
        self.place_movables();
        self.clear_memory();
    }

    /// Places the obstacles that can be pushed where they lie at first, at rest.
    pub fn place_movables(&mut self) {
        let Body { state, obstacles, .. } = &mut self.body;
        state.place_movables(obstacles.movables());
    }

    /// Sets poses and twists and clears warm starts; obstacles that can be pushed, where the state has others than the scene,
    /// lie as at first.
    pub fn place(&mut self, state: &StateOf<M>) {
        self.body.state.copy_from(state);
        if !state.fits(self.robot().link_count(), self.body.obstacles.movables().len()) {
            self.place_movables();
        }
        self.clear_memory();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &dyn Reference<M::Target>) -> StepStatistics {
        let Self { system, body, scheme } = self;
        scheme.advance(system, Driven { body, reference }, duration);
        body.statistics
    }

    /// Impulse of the obstacles on each link during the last `advance`, world frame \[N s\]; without a z part in the
    /// plane.
    pub fn contact_impulse(&self) -> &[Vector3<f64>] {
        &self.body.impulses.contact
    }

    /// Impulse of each obstacle, by its number, on the robot during the last `advance`, world frame \[N s\]; without a z
    /// part in the plane.
    pub fn obstacle_impulse(&self) -> &[Vector3<f64>] {
        self.body.obstacle_impulse.sums()
    }

    /// Impulse of the robot's other links on each link during the last `advance`, world frame \[N s\]; without a z part in
    /// the plane.
    pub fn self_contact_impulse(&self) -> &[Vector3<f64>] {
        &self.body.impulses.self_contact
    }

    /// Records from now on the forces of the ground and of the robot on itself, and the work of the actuators.
    pub fn start_record(&mut self) {
        self.body.record = Some(Box::new(Record::new(self.robot().link_count())));
    }

    /// Place in the scene of each obstacle, by its number.
    pub fn indices_of_obstacles(&self) -> Vec<usize> {
        let obstacles = &self.body.obstacles;
        (0..obstacles.total()).map(|obstacle| obstacles.index_in_scene(obstacle)).collect()
    }

    /// What has been recorded since it was last cleared.
    pub fn record_mut(&mut self) -> Option<&mut Record> {
        self.body.record.as_deref_mut()
    }

    /// The obstacles that can be pushed, and where they are.
    pub fn movables(&self) -> impl Iterator<Item = (&Movable, &Moved)> + Clone {
        self.body.obstacles.movables().iter().zip(&self.body.state.movables)
    }

    /// Kinetic and potential energy, the latter zero with every CG at the height of the origin and springs slack \[J\].
    pub fn energy(&self) -> f64 {
        M::energy(self)
    }

    /// Smallest gap now of a link to an obstacle or, in 3D, to the ground, or of an obstacle that can be pushed to another or
    /// to its stop \[m\]; infinite without any nearby.
    pub fn min_gap(&self) -> f64 {
        M::min_gap(self)
    }

    /// Smallest gap of two links that are not neighbours now \[m\], negative where they overlap; infinite where none are
    /// close to each other.
    pub fn self_gap(&self) -> f64 {
        M::self_gap(self)
    }

    /// Widest gap of a joint now \[m\].
    pub fn joint_gap(&self) -> f64 {
        M::joint_gap(self)
    }

    /// Kinetic energy of what can be pushed \[J\].
    fn kinetic_energy_of_movables(&self) -> f64 {
        self.movables().map(|(movable, moved)| moved.kinetic_energy(movable)).fold(0.0, f64::add)
    }

    /// Energy of its springs, and its potential energy under gravity \[J\].
    fn potential_of_movables(&self, gravity: &Vector3<f64>) -> f64 {
        let potential = |(movable, moved): (&Movable, &Moved)| {
            let place = moved.pose.xy();
            movable.spring_energy(&place) - movable.link.mass * gravity.dot(&place.push(moved.out_of_plane.height))
        };
        self.movables().map(potential).fold(0.0, f64::add)
    }

    /// Smallest gap of what can be pushed to a fixed obstacle, or to its stop, or of a ball to the ground \[m\]; infinite
    /// without any nearby.
    fn gap_of_movables(&self) -> f64 {
        let gap = |(movable, moved): (&Movable, &Moved)| {
            if movable.ball.is_some() {
                let centre = moved.pose.xy().push(moved.out_of_plane.height);
                return ball_gap(movable, &centre, &self.body.obstacles);
            }
            let to_stop = movable.travel() - movable.deflection(&moved.pose.xy()).norm();
            to_stop.min(obstacle_gap(&moved.pose, movable, &self.body.obstacles))
        };
        self.movables().map(gap).fold(f64::INFINITY, f64::min)
    }

    fn clear_memory(&mut self) {
        self.body.clear_memory();
        self.scheme.clear();
    }
}

impl<M: SimulatedModel> Simulation<M> {
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
}
