//! One robot of the spatial model that can be advanced: model, scheme, state and counters together (T 4.6).

use nalgebra::Vector2;

use crate::capabilities::{ModelName, require_supported};
use crate::control::ControllerConfig;
use crate::error::ConfigError;
use crate::gait::CardanReference;
use crate::pegs::PegGrid;
use crate::robot::{Robot, RobotConfig};
use crate::scene::{Peg, Scene, SceneConfig};
use crate::spatial::{
    End, Pose, SpatialState, Twist, assemble_chain, ground_gap, largest_joint_gap, peg_gap, rest_on_ground,
};
use crate::stepping::{IntegratorConfig, Method, StepReport};

use super::{SpatialBody, SpatialFleet, SpatialPlant, SpatialScripted, SpatialThesis};

/// The scheme chosen at construction.
#[derive(Debug, Clone)]
pub(super) enum Scheme {
    Thesis(Box<SpatialThesis>),
    Implicit(Box<SpatialFleet>),
}

/// A robot in a scene under a joint controller.
#[derive(Debug, Clone)]
pub struct SpatialSimulation {
    plant: SpatialPlant,
    pub(super) body: SpatialBody,
    pub(super) scheme: Scheme,
}

impl SpatialSimulation {
    /// # Errors
    /// Names the section, the field, the value and what is admissible.
    pub fn new(
        robot: &RobotConfig,
        scene: &SceneConfig,
        controller: &ControllerConfig,
        integrator: &IntegratorConfig,
    ) -> Result<Self, ConfigError> {
        require_supported(ModelName::Spatial, integrator.method, robot, scene, controller)?;
        let robot = Robot::new(robot).map_err(|e| e.inside("robot"))?;
        let scene = Scene::new(scene).map_err(|e| e.inside("scene"))?;
        integrator.validate().map_err(|e| e.inside("integrator"))?;
        let body = SpatialBody::new(&robot, PegGrid::new(&scene.pegs));
        let joints = robot.joint_count();
        let plant = SpatialPlant::new(robot, &scene, *controller).map_err(|e| e.inside("controller"))?;
        let scheme = Scheme::new(integrator, &plant).map_err(|e| e.inside("integrator"))?;
        let mut simulation = Self { plant, body, scheme };
        simulation.place_chain(Pose::identity(), &vec![Vector2::zeros(); joints]);
        simulation.rest_on_ground();
        Ok(simulation)
    }

    pub fn plant(&self) -> &SpatialPlant {
        &self.plant
    }

    pub fn body(&self) -> &SpatialBody {
        &self.body
    }

    /// The configuration with its default step, which is not that of the planar model.
    pub fn integrator(&self) -> &IntegratorConfig {
        match &self.scheme {
            Scheme::Thesis(scheme) => scheme.config(),
            Scheme::Implicit(fleet) => fleet.config(),
        }
    }

    pub(crate) fn body_mut(&mut self) -> &mut SpatialBody {
        &mut self.body
    }

    pub fn robot(&self) -> &Robot {
        &self.plant.robot
    }

    pub fn pegs(&self) -> &[Peg] {
        self.body.pegs.pegs()
    }

    pub fn state(&self) -> &SpatialState {
        &self.body.state
    }

    /// Replaces the pegs; the caller has validated them.
    pub fn set_scene_pegs(&mut self, pegs: &[Peg]) {
        self.body.pegs.rebuild(pegs);
        self.forget();
    }

    /// Takes poses and twists over and forgets the past.
    pub fn place(&mut self, state: &SpatialState) {
        self.body.state.copy_from(state);
        self.forget();
    }

    /// Places the robot at rest at time 0: pose of link 1 and (yaw, pitch) of all joints.
    pub fn place_chain(&mut self, head: Pose, joint_angle: &[Vector2<f64>]) {
        let state = &mut self.body.state;
        state.time = 0.0;
        state.twist.fill(Twist::zeros());
        assemble_chain(&self.plant.robot, head, joint_angle, &mut state.pose);
        self.forget();
    }

    /// Lifts or lowers the robot until its lowest point touches the ground.
    pub fn rest_on_ground(&mut self) {
        rest_on_ground(&self.plant.robot, &mut self.body.state.pose);
        self.forget();
    }

    /// Integrates over `duration` in equal steps no longer than the configured one.
    pub fn advance(&mut self, duration: f64, reference: &impl CardanReference) -> StepReport {
        let Self { plant, body, scheme } = self;
        match scheme {
            Scheme::Thesis(scheme) => scheme.advance(plant, body, reference, duration),
            Scheme::Implicit(fleet) => {
                fleet.advance(plant, &mut [SpatialScripted { body: &mut *body, reference }], duration, |_| true)
            }
        }
        StepReport::new(&body.tally, body.diverged)
    }

    /// Impulse of the pegs on each link during the last `advance`, x and y in frame I \[N s\]; it has no z part.
    pub fn contact_impulse(&self) -> &[Vector2<f64>] {
        &self.body.tally.contact_impulse
    }

    /// Impulse of the ground's normal forces on each link during the last `advance` \[N s\].
    pub fn ground_impulse(&self) -> &[f64] {
        &self.body.ground_impulse
    }

    /// tau_C = (yaw, pitch) of each joint in the last step (T 4.89) \[N m\].
    pub fn joint_torque(&self) -> &[Vector2<f64>] {
        &self.body.joint_torque
    }

    /// Kinetic and potential energy, the latter zero with every CG in the ground plane \[J\].
    pub fn energy(&self) -> f64 {
        let state = &self.body.state;
        state.kinetic_energy(&self.plant.robot) + state.potential_energy(&self.plant.robot)
    }

    /// Smallest gap of a link to the ground or a peg now \[m\].
    pub fn min_gap(&self) -> f64 {
        let SpatialBody { state, pegs, .. } = &self.body;
        let mut smallest = f64::INFINITY;
        for (pose, link) in state.pose.iter().zip(&self.plant.robot.links) {
            for end in End::BOTH {
                smallest = smallest.min(ground_gap(link, pose, end));
            }
            pegs.visit_near(pose.position.x, pose.position.y, link.reach(), |peg| {
                smallest = smallest.min(peg_gap(link, pose, &pegs.pegs()[peg]));
            });
        }
        smallest
    }

    /// Widest gap of a joint now \[m\].
    pub fn joint_gap(&self) -> f64 {
        largest_joint_gap(&self.plant.robot, &self.body.state.pose)
    }

    fn forget(&mut self) {
        self.body.forget();
        if let Scheme::Thesis(scheme) = &mut self.scheme {
            scheme.clear();
        }
    }
}

impl Scheme {
    fn new(config: &IntegratorConfig, plant: &SpatialPlant) -> Result<Self, ConfigError> {
        match config.method {
            Method::Thesis => Ok(Scheme::Thesis(Box::new(SpatialThesis::new(*config, plant)))),
            Method::Implicit => Ok(Scheme::Implicit(Box::new(SpatialFleet::new(*config, plant, 1)))),
            Method::Adaptive => {
                let expected = "\"implicit\" or \"thesis\" for the spatial model";
                Err(ConfigError::new("method", "\"adaptive\"", expected))
            }
        }
    }
}
