//! Aiko in 3D: gaits, starts and reference trajectories.
use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, SoftStart, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::SceneConfig;
use snake_core::simulation::{SchemeConfig, Simulation};
use snake_core::spatial::{Pose, Spatial, SpatialScripted, orientation_of};
use snake_core::stepping::ImplicitConfig;

use crate::planar::{ground, table_7_5};

pub const DEGREE: f64 = PI / 180.0;

/// Rows of t, then x, y, z of links 6, 1 and 11.
pub fn rows(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/../core/tests/data/spatial-{name}-converged.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the reference data");
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect()).collect()
}

/// Lateral undulation (T 7.3), no lifting.
pub fn undulation() -> CardanGait {
    CardanGait { yaw: Gait::Wave(Wave::default()), pitch: Gait::Wave(Wave::still()) }
}

/// Sidewinding (T 7.5) with soft start.
pub fn sidewinding() -> CardanGait {
    let yaw = Wave { amplitude: 30.0 * DEGREE, ..Wave::default() };
    let pitch = Wave { amplitude: 10.0 * DEGREE, phase: 90.0 * DEGREE, ..Wave::default() };
    let soft = |wave| Gait::SoftStart(SoftStart::new(wave, 10));
    CardanGait { yaw: soft(yaw), pitch: soft(pitch) }
}

/// Aiko lying flat: x and y of link 1 and the yaw of its centre line.
pub fn lying<C: SchemeConfig<Spatial>>(
    scene: &SceneConfig,
    [x, y, yaw]: [f64; 3],
    posture: &[Vector2<f64>],
    integrator: &C,
) -> Simulation<Spatial, C::Scheme> {
    let pd = ControllerConfig::default();
    let mut simulation = Simulation::new(&RobotConfig::default(), scene, &pd, integrator).expect("admissible");
    let head = Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(yaw, 0.0, 0.0) };
    simulation.place_chain(head, posture);
    simulation.rest_on_ground();
    simulation
}

/// A robot that follows a gait among obstacles, at rest in its posture: x and y of link 1 and the yaw of its centre line.
pub fn in_gait(
    robot: &Robot,
    obstacles: ObstacleGrid,
    [x, y, yaw]: [f64; 3],
    gait: CardanGait,
) -> SpatialScripted<CardanGait> {
    let target = |joint| gait.target(joint, 0.0);
    let posture: Vec<_> = (0..robot.joint_count())
        .map(|joint| Vector2::new(target(joint).yaw.angle, target(joint).pitch.angle))
        .collect();
    let head = Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(yaw, 0.0, 0.0) };
    SpatialScripted::new(robot, obstacles, head, &posture, gait)
}

pub fn on_course<C: SchemeConfig<Spatial>>(integrator: &C) -> Simulation<Spatial, C::Scheme> {
    let posture: Vec<_> = (0..10).map(|j| Vector2::new(undulation().target(j, 0.0).yaw.angle, 0.0)).collect();
    lying(&table_7_5(), [1.0247, 0.1416, 223.617 * DEGREE], &posture, integrator)
}

pub fn straight<C: SchemeConfig<Spatial>>(integrator: &C) -> Simulation<Spatial, C::Scheme> {
    lying(&ground([0.2, 0.2]), [0.0, 0.0, PI], &[Vector2::zeros(); 10], integrator)
}

/// The default scheme of the spatial model.
pub fn implicit(step: f64, order: u32) -> ImplicitConfig {
    ImplicitConfig { step: Some(step), order, ..ImplicitConfig::default() }
}
