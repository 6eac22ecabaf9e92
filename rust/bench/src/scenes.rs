//! What is simulated: robot, ground, pegs and start, by name.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::environment::{EnvConfig, Environment, FieldKind, Task};
use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Planar, PlanarState, PlanarSystem, Scripted};
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_7_3, START_7_5, START_FREE, Scene, SceneConfig, TABLE_7_3, TABLE_7_5};
use snake_core::simulation::{SchemeConfig, Simulation};
use snake_core::stepping::{ImplicitConfig, Precision};

use crate::methods::{Choice, choices};
use crate::precision::Limits;
use crate::reference::{Positions, Sampled};

/// Simulated time over which errors are measured \[s\], by default.
pub const DURATION: f64 = 5.0;

/// A robot at rest among its pegs, ready for the gait (T 7.3).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scenario {
    pub name: &'static str,
    pub title: &'static str,
    pub robot: RobotConfig,
    pub scene: SceneConfig,
    pub controller: ControllerConfig,
    /// CG of link 1 \[m\] and its absolute angle \[rad\].
    pub start: [f64; 3],
    pub joint_angle: Vec<f64>,
    /// Simulated time over which errors are measured \[s\], a whole number of seconds.
    pub duration: f64,
}

/// The scenes of the work-precision plots.
pub fn all() -> Vec<Scenario> {
    vec![
        aiko("free", "free, isotropic ground", &[], [0.2, 0.2], START_FREE),
        aiko("orthotropic", "free, orthotropic ground", &[], [0.2, 0.5], START_FREE),
        aiko("course-7.5", "course of Table 7.5", &TABLE_7_5, [0.2, 0.2], START_7_5),
        aiko("course-7.3", "course of Table 7.3", &TABLE_7_3, [0.2, 0.2], START_7_3),
        dense_field(),
        jam(),
    ]
}

impl Scenario {
    pub fn has_pegs(&self) -> bool {
        !self.scene.obstacles.is_empty()
    }
}

impl Sampled for Scenario {
    type Model = Planar;
    type Gait = Wave;

    const MODEL: Option<&'static str> = None;
    const STEPS: [f64; 2] = [1e-4, 5e-5];
    const SAMPLE: f64 = 0.1;
    const LIMITS: [Limits; 2] = [
        Limits { run: 10.0, repetition: 0.4, runs: 6, rounds: 5 },
        Limits { run: 2.0, repetition: 0.1, runs: 4, rounds: 3 },
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

    fn gait(&self) -> Wave {
        Wave::default()
    }

    fn choices(&self, quick: bool) -> Vec<Choice> {
        choices(quick, self.has_pegs())
    }

    fn fine(step: f64) -> ImplicitConfig {
        ImplicitConfig {
            step: Some(step),
            tolerance: Some(1e-11),
            precision: Precision::Fine,
            max_iterations: 2000,
            ..ImplicitConfig::default()
        }
    }

    fn system(&self) -> Result<PlanarSystem, ConfigError> {
        PlanarSystem::new(Robot::new(&self.robot)?, &Scene::new(&self.scene)?, self.controller)
    }

    fn at_start(&self, system: &PlanarSystem) -> Scripted<Wave> {
        let pegs = ObstacleGrid::of(&self.scene.obstacles);
        Scripted::new(&system.robot, pegs, self.start, &self.joint_angle, self.gait())
    }

    fn simulation<C: SchemeConfig<Planar>>(
        &self,
        integrator: &C,
    ) -> Result<Simulation<Planar, C::Scheme>, ConfigError> {
        let mut simulation = Simulation::new(&self.robot, &self.scene, &self.controller, integrator)?;
        let [x, y, heading] = self.start;
        simulation.place_chain(x, y, heading, &self.joint_angle);
        Ok(simulation)
    }

    fn positions(state: &PlanarState) -> Positions {
        state.pose.iter().map(|pose| vec![pose.x, pose.y]).collect()
    }
}

/// Aiko with the thesis's gains, in the posture of the gait at t = 0.
pub fn aiko(
    name: &'static str,
    title: &'static str,
    pegs: &[[f64; 3]],
    friction: [f64; 2],
    start: [f64; 3],
) -> Scenario {
    let obstacles = pegs.iter().map(|&peg| peg.into()).collect();
    Scenario {
        name,
        title,
        robot: RobotConfig::default(),
        scene: SceneConfig { obstacles, friction, ..SceneConfig::default() },
        controller: ControllerConfig::default(),
        start,
        joint_angle: (0..10).map(|joint| Wave::default().target(joint, 0.0).angle).collect(),
        duration: DURATION,
    }
}

/// The start and the pegs of an environment's first episode, without jitter, under `controller`.
///
/// # Errors
/// The configuration is not admissible.
pub fn of_environment(
    name: &'static str,
    title: &'static str,
    config: &EnvConfig,
    seed: u64,
) -> Result<Scenario, ConfigError> {
    let mut environment = Environment::new(&EnvConfig { start_jitter: 0.0, ..config.clone() })?;
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(seed), &mut observation);
    let state = environment.state();
    Ok(Scenario {
        name,
        title,
        robot: config.robot.clone(),
        scene: SceneConfig {
            obstacles: environment.pegs().iter().map(|&peg| peg.into()).collect(),
            friction: config.ground().friction,
            ..SceneConfig::default()
        },
        controller: config.controller,
        start: [state.pose[0].x, state.pose[0].y, state.pose[0].z],
        joint_angle: (0..environment.robot().joint_count()).map(|joint| state.joint_angle(joint)).collect(),
        duration: DURATION,
    })
}

/// Pegs thrown at random, as dense as leaves passages a little wider than the robot.
fn dense_field() -> Scenario {
    let config = EnvConfig {
        task: Task::FIELD,
        field: FieldKind::Poisson,
        difficulty: 0.2,
        controller: ControllerConfig::default(),
        ..EnvConfig::default()
    };
    of_environment("field", "dense random field", &config, FIELD_SEED).expect("a valid configuration")
}

const FIELD_SEED: u64 = 3;

/// The robot threads the first pegs of (T Table 7.5) and then presses against a wall without a passage.
///
/// It touches the wall after a second. After three it is about to buckle to one side or the other, and
/// errors of a millimetre grow to centimetres whatever the method: errors are measured before.
fn jam() -> Scenario {
    let behind = TABLE_7_5.iter().copied().filter(|peg| peg[1] < 1.2);
    let wall = (0..6).map(|k| [0.05, 1.45, -0.2 + 0.13 * f64::from(k)]);
    let pegs: Vec<[f64; 3]> = behind.chain(wall).collect();
    Scenario {
        controller: ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() },
        duration: 3.0,
        ..aiko("jam", "jam against a wall of pegs", &pegs, [0.2, 0.2], START_7_5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_scene_has_a_name_of_its_own_and_starts_free_of_pegs() {
        let scenes = all();
        let names: HashSet<_> = scenes.iter().map(|scene| scene.name).collect();
        assert_eq!(names.len(), scenes.len());
        for scene in scenes {
            let simulation = scene.simulation(&ImplicitConfig::default()).unwrap();
            assert!(simulation.min_gap() > 0.0, "{}: {}", scene.name, simulation.min_gap());
            assert!(simulation.joint_gap() < 1e-12);
        }
    }

    #[test]
    fn the_wall_of_the_jam_stops_the_robot() {
        let scenes = all();
        let travel = |name: &str| {
            let scene = scenes.iter().find(|scene| scene.name == name).unwrap();
            let mut simulation = scene.simulation(&ImplicitConfig::default()).unwrap();
            let start = simulation.state().pose[0].x;
            simulation.advance(DURATION, &Wave::default());
            simulation.state().pose[0].x - start
        };
        assert!(travel("jam") < 0.6 * travel("course-7.5"));
    }
}
