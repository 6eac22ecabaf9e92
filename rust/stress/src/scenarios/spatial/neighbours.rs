//! One faulty robot in a fleet of the 3D model.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_SPATIAL_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::spatial::{Pose, Spatial, SpatialScripted, SpatialSystem, orientation_of};

use crate::case::pegs;
use crate::scenarios::neighbours::{ROBOTS, TestFleet};

/// Robots in 3D that differ in gait, in height, and in the number of pegs around them.
pub fn in_space(step: f64) -> TestFleet<Spatial, CardanGait> {
    let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
    let scene = Scene::new(&SceneConfig::default()).expect("the thesis's ground");
    let system = SpatialSystem::new(robot, &scene, ControllerConfig::default()).expect("the thesis's controller");
    let robot = |k: usize| {
        let pitch = Wave { amplitude: 0.05 * (k % 3) as f64, phase: 1.5, ..Wave::default() };
        let gait = CardanGait { yaw: Gait::Wave(Wave::default()), pitch: Gait::Wave(pitch) };
        let start_angles = |joint| {
            let target = gait.target(joint, 0.0);
            Vector2::new(target.yaw.angle, target.pitch.angle)
        };
        let posture: Vec<Vector2<f64>> = (0..10).map(start_angles).collect();
        let [x, y, yaw] = START_SPATIAL_7_5;
        let head = Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(yaw, 0.0, 0.0) };
        let mut robot =
            SpatialScripted::new(&system.robot, ObstacleGrid::of(&pegs(&TABLE_7_5[..k % 8])), head, &posture, gait);
        robot.body.state.pose.iter_mut().for_each(|pose| pose.position.z += 0.002 * (k % 5) as f64);
        robot
    };
    let robots = (0..ROBOTS).map(robot).collect();
    TestFleet::new(step, system, robots, |twist, place| &mut twist[place % 6])
}
