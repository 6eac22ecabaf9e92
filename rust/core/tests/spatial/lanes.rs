//! A robot in 3D moves the same, bit for bit, alone and in the lanes of a register among others.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::robot::{Motor, Robot, RobotConfig};
use snake_core::scene::{Peg, START_SPATIAL_7_5, Scene, SceneConfig, TABLE_7_5};
use snake_core::spatial::{Pose, SpatialScripted, SpatialSystem, orientation_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::lanes::{self, alone_as_among_others};
use snake_test_support::spatial::{implicit, in_gait, sidewinding, undulation};

type CardanRobot = SpatialScripted<CardanGait>;

fn system(friction: [f64; 2]) -> SpatialSystem {
    system_of(&RobotConfig::default(), friction)
}

fn system_of(robot: &RobotConfig, friction: [f64; 2]) -> SpatialSystem {
    let scene = Scene::new(&SceneConfig { friction, ..SceneConfig::default() }).unwrap();
    let controller = ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::default() };
    SpatialSystem::new(Robot::new(robot).unwrap(), &scene, controller).unwrap()
}

/// Robots that differ in gait, in height above the ground, and in the number of pegs around them.
fn robot(system: &SpatialSystem, k: usize) -> CardanRobot {
    let pegs: Vec<Peg> = TABLE_7_5.iter().take(k % 8).map(|&peg| peg.into()).collect();
    let gait = if k % 3 == 1 { sidewinding() } else { undulation() };
    let mut robot = in_gait(&system.robot, ObstacleGrid::new(&pegs), START_SPATIAL_7_5, gait);
    robot.body.state.pose.iter_mut().for_each(|pose| pose.position.z += 0.002 * (k % 5) as f64);
    robot
}

/// Pegs, robots in the air and on the ground, anisotropic friction with fallbacks, and friction along one axis alone.
#[test]
fn the_width_of_the_registers_and_the_neighbours_do_not_matter() {
    for (friction, step, order) in [([0.2, 0.2], 0.025, 2), ([0.05, 0.9], 0.05, 2), ([0.2, 0.0], 0.0125, 1)] {
        let system = system(friction);
        alone_as_among_others(&system, implicit(step, order), &[1, 9, 13, 100], &[0.05; 10], 13, |k| robot(&system, k));
    }
}

#[test]
fn so_it_is_with_motors() {
    let motor =
        Motor { stall_torque: 3.0, no_load_speed: 2.0, rotor_inertia: 1e-3, gear_friction: 0.3, ..Motor::default() };
    let system =
        system_of(&RobotConfig { motor: Some(motor.into()), limp: vec![3], ..RobotConfig::default() }, [0.2, 0.2]);
    alone_as_among_others(&system, implicit(0.025, 2), &[9, 13], &[0.05; 10], 9, |k| robot(&system, k));
}

/// A stage that Newton's method gives up while neighbours go on is handed to the fallback as it would be alone: robots that
/// lie in curves of their own, far from what their motors ask for.
#[test]
fn lanes_that_are_given_up_do_not_depend_on_neighbours_either() {
    let system = system([2.0, 2.0]);
    let jolted = |k: usize| {
        let posture: Vec<_> = (0..10).map(|j| Vector2::new(0.5 * (1.0 + (7 * j + 13 * k) as f64).sin(), 0.0)).collect();
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.3, 0.0, 0.0) };
        let yaw = Gait::Wave(Wave { amplitude: 0.1 * k as f64, ..Wave::default() });
        let gait = CardanGait { yaw, pitch: Gait::Wave(Wave::still()) };
        CardanRobot::new(&system.robot, ObstacleGrid::new(&[]), head, &posture, gait)
    };
    for most in 4..13 {
        let config = ImplicitConfig { max_iterations: most, ..implicit(0.01, 2) };
        alone_as_among_others(&system, config, &[9], &[0.1], 9, jolted);
    }
    let alone = alone_as_among_others(&system, implicit(0.01, 2), &[9, 13], &[0.1], 9, jolted);
    let fallbacks: u32 = alone.iter().map(|(body, _)| body.statistics.fallbacks).sum();
    assert!(fallbacks > 20, "many stages must be given up");
}

#[test]
fn a_robot_that_diverges_leaves_its_neighbours_untouched() {
    let (system, config) = (system([0.2, 0.2]), implicit(0.025, 2));
    let robot = |k| robot(&system, k);
    lanes::a_robot_that_diverges_leaves_its_neighbours_untouched(&system, config, &[0.05; 10], robot, |twist| {
        twist.x = f64::NAN;
    });
}
