//! Scenes of the 3D model to measure: scene, gait and start, by name.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use serde::Serialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, SoftStart, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_SPATIAL_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::simulation::{SchemeConfig, Simulation};
use snake_core::spatial::{Pose, Spatial, SpatialScripted, SpatialState, SpatialSystem, orientation_of};
use snake_core::stepping::ImplicitConfig;

use crate::methods::{Choice, choices_in_space};
use crate::precision::Limits;
use crate::reference::{Positions, Sampled};

/// A robot of the 3D model, flat on the ground and at rest, ready for its gait.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpatialScenario {
    pub name: &'static str,
    pub title: &'static str,
    pub robot: RobotConfig,
    pub scene: SceneConfig,
    pub controller: ControllerConfig,
    pub yaw: Wave,
    pub pitch: Wave,
    /// Whether the gait begins softly, joint by joint ([`SoftStart`]).
    pub soft_start: bool,
    /// CG of link 1 \[m\] and the yaw of its centre line \[rad\].
    pub start: [f64; 3],
    /// Simulated time over which errors are measured \[s\], a whole number of seconds.
    pub duration: f64,
}

/// All scenes of the spatial model.
pub fn all() -> Vec<SpatialScenario> {
    vec![course(), sidewinding()]
}

impl SpatialScenario {
    /// Pose of link 1 at the start; its height is that of a robot on the ground.
    fn head(&self) -> Pose {
        let [x, y, yaw] = self.start;
        Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(yaw, 0.0, 0.0) }
    }

    /// (yaw, pitch) of the joints at the start \[rad\].
    fn posture(&self) -> Vec<Vector2<f64>> {
        let gait = self.gait();
        let targets = (0..self.robot.links - 1).map(|joint| gait.target(joint, 0.0));
        targets.map(|target| Vector2::new(target.yaw.angle, target.pitch.angle)).collect()
    }
}

impl Sampled for SpatialScenario {
    type Model = Spatial;
    type Gait = CardanGait;

    const MODEL: Option<&'static str> = Some("spatial");
    const STEPS: [f64; 2] = [2.5e-4, 1.25e-4];
    const SAMPLE: f64 = 0.2;
    const LIMITS: [Limits; 2] = [
        Limits { run: f64::INFINITY, repetition: f64::INFINITY, runs: 5, rounds: 5 },
        Limits { run: f64::INFINITY, repetition: f64::INFINITY, runs: 1, rounds: 1 },
    ];

    fn name(&self) -> &'static str {
        self.name
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn gait(&self) -> CardanGait {
        let gait = |wave| {
            if self.soft_start { Gait::SoftStart(SoftStart::new(wave, self.robot.links - 1)) } else { Gait::Wave(wave) }
        };
        CardanGait { yaw: gait(self.yaw), pitch: gait(self.pitch) }
    }

    fn choices(&self, quick: bool) -> Vec<Choice> {
        choices_in_space(quick)
    }

    fn fine(step: f64) -> ImplicitConfig {
        ImplicitConfig { step: Some(step), tolerance: Some(1e-8), ..ImplicitConfig::default() }
    }

    fn system(&self) -> Result<SpatialSystem, ConfigError> {
        SpatialSystem::new(Robot::new(&self.robot)?, &Scene::new(&self.scene)?, self.controller)
    }

    fn at_start(&self, system: &SpatialSystem) -> SpatialScripted<CardanGait> {
        let pegs = ObstacleGrid::of(&self.scene.obstacles);
        SpatialScripted::new(&system.robot, pegs, self.head(), &self.posture(), self.gait())
    }

    fn simulation<C: SchemeConfig<Spatial>>(
        &self,
        integrator: &C,
    ) -> Result<Simulation<Spatial, C::Scheme>, ConfigError> {
        let mut simulation = Simulation::new(&self.robot, &self.scene, &self.controller, integrator)?;
        simulation.place_chain(self.head(), &self.posture());
        simulation.rest_on_ground();
        Ok(simulation)
    }

    fn positions(state: &SpatialState) -> Positions {
        state.pose.iter().map(|pose| pose.position.as_slice().to_vec()).collect()
    }
}

/// Lateral undulation (T 7.3) without lifting, among the pegs of Table 7.5.
pub fn course() -> SpatialScenario {
    SpatialScenario {
        name: "spatial-course-7.5",
        title: "3D: course of Table 7.5",
        scene: SceneConfig { obstacles: TABLE_7_5.iter().map(|&peg| peg.into()).collect(), ..SceneConfig::default() },
        yaw: Wave::default(),
        pitch: Wave::still(),
        soft_start: false,
        start: START_SPATIAL_7_5,
        ..sidewinding()
    }
}

/// Sidewinding (T 7.5) with soft start.
pub fn sidewinding() -> SpatialScenario {
    SpatialScenario {
        name: "spatial-sidewinding",
        title: "3D: sidewinding from rest, isotropic ground",
        robot: RobotConfig::default(),
        scene: SceneConfig::default(),
        controller: ControllerConfig::default(),
        yaw: Wave { amplitude: 30_f64.to_radians(), ..Wave::default() },
        pitch: Wave { amplitude: 10_f64.to_radians(), phase: 90_f64.to_radians(), ..Wave::default() },
        soft_start: true,
        start: [0.0, 0.0, PI],
        duration: 5.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_starts_on_the_ground_and_free_of_pegs() {
        for scenario in all() {
            let simulation = scenario.simulation(&ImplicitConfig::default()).unwrap();
            assert!(simulation.min_gap() > -1e-12 && simulation.joint_gap() < 1e-12, "{}", scenario.name);
            assert!(scenario.system().is_ok());
        }
    }
}
