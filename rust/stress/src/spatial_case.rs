//! One robot of the 3D model in one scene, simulated for some time and observed.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanTarget, Reference, Wave};
use snake_core::robot::RobotConfig;
use snake_core::scene::{START_SPATIAL_7_5, SceneConfig, TABLE_7_5};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialState, orientation_of, twist_of};
use snake_core::stepping::ImplicitConfig;

use crate::case::{Motion, pegs};
use crate::figures::Figures;

/// References of yaw and pitch of the joints.
#[derive(Debug, Clone, Copy)]
pub struct CardanMotion {
    pub yaw: Motion,
    pub pitch: Motion,
}

impl Reference<CardanTarget> for CardanMotion {
    fn target(&self, joint: usize, time: f64) -> CardanTarget {
        CardanTarget { yaw: self.yaw.target(joint, time), pitch: self.pitch.target(joint, time) }
    }
}

impl CardanMotion {
    /// Straight joints at all times.
    pub fn still() -> Self {
        Self { yaw: Motion::Hold(0.0), pitch: Motion::Hold(0.0) }
    }

    /// Lateral undulation (T 7.3).
    pub fn undulation() -> Self {
        Self { yaw: Motion::Wave(Wave::default()), ..Self::still() }
    }

    /// Sidewinding (T 7.5) with amplitudes \[rad\].
    pub fn sidewinding(yaw: f64, pitch: f64) -> Self {
        let wave = |amplitude, phase| Motion::Wave(Wave { amplitude, phase, ..Wave::default() });
        Self { yaw: wave(yaw, 0.0), pitch: wave(pitch, 0.5 * PI) }
    }

    /// Lateral rolling (T 7.4).
    pub fn rolling() -> Self {
        let wave = |phase| Motion::Wave(Wave { amplitude: PI / 18.0, beta: 0.0, phase, ..Wave::default() });
        Self { yaw: wave(0.0), pitch: wave(0.5 * PI) }
    }
}

/// A case of a scenario of the 3D model.
#[derive(Debug, Clone)]
pub struct SpatialCase {
    pub name: String,
    pub robot: RobotConfig,
    pub scene: SceneConfig,
    pub controller: ControllerConfig,
    pub integrator: ImplicitConfig,
    pub motion: CardanMotion,
    /// CG of link 1, and yaw, pitch and roll of its centre line.
    pub place: [f64; 3],
    pub attitude: [f64; 3],
    /// Yaw and pitch of the joints at the start; `None`: those of the motion.
    pub posture: Option<Vec<Vector2<f64>>>,
    /// Height of the lowest point above the ground at the start \[m\].
    pub height: f64,
    /// Velocity of the whole robot at the start, and its angular velocity about the CG of link 1.
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
    pub duration: f64,
}

impl SpatialCase {
    /// Aiko lying straight along the x axis, link 1 at the origin and the others behind it, towards -x.
    pub fn straight(name: impl Into<String>, step: f64, duration: f64) -> Self {
        Self {
            name: name.into(),
            robot: RobotConfig::default(),
            scene: SceneConfig::default(),
            controller: ControllerConfig::default(),
            integrator: ImplicitConfig { step: Some(step), ..ImplicitConfig::default() },
            motion: CardanMotion::still(),
            place: [0.0; 3],
            attitude: [PI, 0.0, 0.0],
            posture: None,
            height: 0.0,
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            duration,
        }
    }

    /// Aiko on the course of Table 7.5, about to undulate.
    pub fn course(name: impl Into<String>, step: f64, duration: f64) -> Self {
        let [x, y, yaw] = START_SPATIAL_7_5;
        Self {
            scene: SceneConfig { obstacles: pegs(&TABLE_7_5), ..SceneConfig::default() },
            motion: CardanMotion::undulation(),
            place: [x, y, 0.0],
            attitude: [yaw, 0.0, 0.0],
            ..Self::straight(name, step, duration)
        }
    }

    /// Without drives and friction, so that the energy cannot increase.
    pub fn limp(mut self) -> Self {
        self.controller = ControllerConfig { kp: 0.0, kd: 0.0, ..ControllerConfig::default() };
        (self.scene.friction, self.scene.rolling_friction) = ([0.0; 2], 0.0);
        self
    }

    /// The simulation at its start.
    ///
    /// # Panics
    /// If the case is not admissible.
    pub fn simulation(&self) -> SpatialSimulation {
        let mut simulation = SpatialSimulation::new(&self.robot, &self.scene, &self.controller, &self.integrator)
            .unwrap_or_else(|error| panic!("{}: {error}", self.name));
        let start_angles = |joint| {
            let CardanTarget { yaw, pitch } = self.motion.target(joint, 0.0);
            Vector2::new(yaw.angle, pitch.angle)
        };
        let posture = self.posture.clone().unwrap_or_else(|| (0..self.robot.links - 1).map(start_angles).collect());
        let [yaw, pitch, roll] = self.attitude;
        let head = Pose { position: self.place.into(), orientation: orientation_of(yaw, pitch, roll) };
        simulation.place_chain(head, &posture);
        simulation.rest_on_ground();
        if self.height > 0.0 || self.velocity != Vector3::zeros() || self.spin != Vector3::zeros() {
            let thrown = self.thrown(simulation.state());
            simulation.place(&thrown);
        }
        simulation
    }

    /// The state lifted and in motion.
    fn thrown(&self, state: &SpatialState) -> SpatialState {
        let mut thrown = state.clone();
        let centre = state.pose[0].position;
        for (pose, twist) in thrown.pose.iter_mut().zip(&mut thrown.twist) {
            let velocity = self.velocity + self.spin.cross(&(pose.position - centre));
            *twist = twist_of(velocity, pose.orientation.inverse_transform_vector(&self.spin));
            pose.position.z += self.height;
        }
        thrown
    }

    /// Runs the case step by step.
    pub fn run(&self) -> Figures {
        let step = self.integrator.step();
        let advance = |simulation: &mut SpatialSimulation| simulation.advance(step, &self.motion);
        Figures::of_run(self.simulation(), self.integrator.steps_in(self.duration), advance)
    }
}
