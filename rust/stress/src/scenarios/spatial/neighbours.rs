//! One faulty robot in a fleet of the 3D model.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{START_SPATIAL_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::spatial::{Pose, SpatialBody, SpatialFleet, SpatialScripted, SpatialSystem, orientation_of};
use snake_core::stepping::{ImplicitConfig, StepStatistics};

use crate::case::pegs;
use crate::scenarios::neighbours::{FaultyRobot, TestFleet};

type CardanRobot = SpatialScripted<CardanGait>;

/// Robots of the 3D model that differ in gait, in height, and in the number of pegs around them.
pub struct SpatialTestFleet {
    system: SpatialSystem,
    fleet: SpatialFleet,
    robots: Vec<CardanRobot>,
}

impl TestFleet for SpatialTestFleet {
    type Robot = SpatialBody;

    fn new(step: f64, count: usize) -> Self {
        let config = ImplicitConfig { step: Some(step), ..ImplicitConfig::default() };
        let robot = Robot::new(&RobotConfig::default()).expect("Aiko");
        let scene = Scene::new(&SceneConfig::default()).expect("the thesis's ground");
        let system = SpatialSystem::new(robot, &scene, ControllerConfig::default()).expect("the thesis's controller");
        let robots = (0..count).map(|k| robot_of(&system, k)).collect();
        Self { fleet: SpatialFleet::new(config, &system, count), robots, system }
    }

    fn advance(&mut self, duration: f64) {
        self.fleet.advance(&self.system, self.robots.iter_mut().map(CardanRobot::driven), duration);
    }

    fn robot(&self, robot: usize) -> &SpatialBody {
        &self.robots[robot].body
    }

    fn robot_mut(&mut self, robot: usize) -> &mut SpatialBody {
        &mut self.robots[robot].body
    }
}

impl FaultyRobot for SpatialBody {
    fn poison(&mut self, place: usize, poison: f64) {
        self.state.twist[place % 11][place % 6] = poison;
    }

    fn statistics(&self) -> &StepStatistics {
        &self.statistics
    }

    fn is_contained(&self) -> bool {
        self.statistics.diverged && self.state.is_plausible()
    }

    fn bits(&self) -> Vec<u64> {
        let poses = self.state.pose.iter().flat_map(|pose| pose.position.iter().chain(pose.orientation.coords.iter()));
        poses.chain(self.state.twist.iter().flatten()).map(|x| x.to_bits()).collect()
    }
}

fn robot_of(system: &SpatialSystem, k: usize) -> CardanRobot {
    let pitch = Wave { amplitude: 0.05 * (k % 3) as f64, phase: 1.5, ..Wave::default() };
    let gait = CardanGait { yaw: Gait::Wave(Wave::default()), pitch: Gait::Wave(pitch) };
    let start_angles = |joint| {
        let target = gait.target(joint, 0.0);
        Vector2::new(target.yaw.angle, target.pitch.angle)
    };
    let posture: Vec<Vector2<f64>> = (0..10).map(start_angles).collect();
    let [x, y, yaw] = START_SPATIAL_7_5;
    let head = Pose { position: Vector3::new(x, y, 0.0), orientation: orientation_of(yaw, 0.0, 0.0) };
    let mut robot = CardanRobot::new(&system.robot, ObstacleGrid::of(&pegs(&TABLE_7_5[..k % 8])), head, &posture, gait);
    robot.body.state.pose.iter_mut().for_each(|pose| pose.position.z += 0.002 * (k % 5) as f64);
    robot
}
