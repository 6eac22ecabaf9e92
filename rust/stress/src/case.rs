//! One robot in one scene, simulated for some time and observed.

use snake_core::control::ControllerConfig;
use snake_core::gait::{JointTarget, Reference, Wave};
use snake_core::obstacles::Obstacle;
use snake_core::planar::{PlanarState, Twist};
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::scene::{START_7_5, SceneConfig, TABLE_7_5};
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::ImplicitConfig;

use crate::figures::Figures;

/// Reference of the joints.
#[derive(Debug, Clone, Copy)]
pub enum Motion {
    Wave(Wave),
    /// The same angle at every joint \[rad\].
    Hold(f64),
    /// Jumps between two angles at this rate \[rad\], \[1/s\].
    Jump {
        angle: f64,
        rate: f64,
    },
}

impl Reference<JointTarget> for Motion {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        match *self {
            Motion::Wave(wave) => wave.target(joint, time),
            Motion::Hold(angle) => JointTarget { angle, ..JointTarget::default() },
            Motion::Jump { angle, rate } => {
                let up = (time * rate + joint as f64 * 0.37).fract() < 0.5;
                JointTarget { angle: if up { angle } else { -angle }, ..JointTarget::default() }
            }
        }
    }
}

/// A case of a scenario.
#[derive(Debug, Clone)]
pub struct Case {
    pub name: String,
    pub robot: RobotConfig,
    pub scene: SceneConfig,
    pub controller: ControllerConfig,
    pub integrator: ImplicitConfig,
    pub motion: Motion,
    /// CG and angle of link 1.
    pub place: [f64; 3],
    /// Joint angles at the start; `None`: those of the motion.
    pub posture: Option<Vec<f64>>,
    /// Velocity of the whole robot at the start.
    pub velocity: [f64; 2],
    pub duration: f64,
}

impl Case {
    /// Aiko at rest on the course of Table 7.5, about to undulate.
    pub fn course(name: impl Into<String>, step: f64, duration: f64) -> Self {
        Self {
            name: name.into(),
            robot: RobotConfig::default(),
            scene: SceneConfig { obstacles: pegs(&TABLE_7_5), ..SceneConfig::default() },
            controller: ControllerConfig::default(),
            integrator: ImplicitConfig { step: Some(step), ..ImplicitConfig::default() },
            motion: Motion::Wave(Wave::default()),
            place: START_7_5,
            posture: None,
            velocity: [0.0; 2],
            duration,
        }
    }

    /// Aiko straight along the x axis, its first link at the origin, head first in the direction of -x.
    pub fn straight(name: impl Into<String>, step: f64, duration: f64) -> Self {
        let links = RobotConfig::default().links;
        let course = Self::course(name, step, duration);
        Self {
            scene: SceneConfig::default(),
            motion: Motion::Hold(0.0),
            place: [0.0; 3],
            posture: Some(vec![0.0; links - 1]),
            ..course
        }
    }

    /// The simulation at its start.
    ///
    /// # Panics
    /// If the case is not admissible.
    pub fn simulation(&self) -> PlanarSimulation {
        let mut simulation = PlanarSimulation::new(&self.robot, &self.scene, &self.controller, &self.integrator)
            .unwrap_or_else(|error| panic!("{}: {error}", self.name));
        let start_angle = |joint| self.motion.target(joint, 0.0).angle;
        let posture = self.posture.clone().unwrap_or_else(|| (0..self.robot.links - 1).map(start_angle).collect());
        let [x, y, heading] = self.place;
        simulation.place_chain(x, y, heading, &posture);
        if self.velocity != [0.0; 2] {
            let state = PlanarState {
                twist: vec![Twist::new(self.velocity[0], self.velocity[1], 0.0); self.robot.links],
                ..simulation.state().clone()
            };
            simulation.place(&state);
        }
        simulation
    }

    /// Runs the case step by step.
    pub fn run(&self) -> Figures {
        let step = self.integrator.step();
        let advance = |simulation: &mut PlanarSimulation| simulation.advance(step, &self.motion);
        Figures::of_run(self.simulation(), self.integrator.steps_in(self.duration), advance)
    }
}

pub fn pegs(table: &[[f64; 3]]) -> Vec<Obstacle> {
    table.iter().map(|&peg| peg.into()).collect()
}

/// Scales mass and inertia of link i by `factor(i)`.
pub fn weighted(links: usize, factor: impl Fn(usize) -> f64) -> RobotConfig {
    let aiko = RobotConfig::default();
    let each = |quantity: &PerLink| match quantity {
        PerLink::Same(value) => PerLink::Each((0..links).map(|i| value * factor(i)).collect()),
        PerLink::Each(_) => unreachable!("Aiko's links are alike"),
    };
    RobotConfig { links, mass: each(&aiko.mass), inertia: each(&aiko.inertia), ..aiko }
}
