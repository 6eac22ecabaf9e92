//! The discrepancies of (T 7.5.4) in 3D: mass, friction and torque limit of one robot, backlash, the Stribeck effect.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, Wave};
use snake_core::laws::Stribeck;
use snake_core::robot::{Robot, RobotConfig};
use snake_core::scene::{Scene, SceneConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, SpatialScripted, SpatialState, SpatialSystem, joint_angle, orientation_of, twist_of};
use snake_core::stepping::PlantParameters;
use snake_test_support::lanes::alone_as_among_others;
use snake_test_support::planar::{each_joint, ground, table_7_5, uneven_joints};
use snake_test_support::spatial::{implicit, sidewinding, undulation};

const GRAVITY: f64 = 9.81;

fn still() -> CardanGait {
    CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) }
}

fn limited() -> ControllerConfig {
    ControllerConfig { torque_limit: Some(6.0), ..ControllerConfig::default() }
}

/// Aiko at the start of the course in the posture of its gait.
fn robot(
    config: &RobotConfig,
    scene: &SceneConfig,
    pd: &ControllerConfig,
    parameters: PlantParameters,
) -> SpatialSimulation {
    let mut simulation = SpatialSimulation::new(config, scene, pd, &implicit(0.01, 2)).expect("admissible");
    let at = |joint| undulation().target(joint, 0.0).yaw.angle;
    let posture: Vec<_> = (0..config.links - 1).map(|joint| Vector2::new(at(joint), 0.0)).collect();
    let head = Pose { position: Vector3::new(1.0247, 0.1416, 0.0), orientation: orientation_of(3.9029, 0.0, 0.0) };
    simulation.place_chain(head, &posture);
    simulation.rest_on_ground();
    simulation.body_mut().parameters = parameters;
    simulation
}

fn apart(a: &SpatialState, b: &SpatialState) -> f64 {
    a.pose.iter().zip(&b.pose).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
}

#[test]
fn a_robot_of_its_own_friction_moves_as_on_ground_of_that_friction() {
    let parameters = PlantParameters { friction: Vector2::new(1.5, 2.0), ..PlantParameters::default() };
    let rough = SceneConfig { friction: [0.2 * 1.5, 0.2 * 2.0], ..table_7_5() };
    let config = RobotConfig::default();
    let mut own = robot(&config, &table_7_5(), &limited(), parameters);
    let mut of_scene = robot(&config, &rough, &limited(), PlantParameters::default());
    for simulation in [&mut own, &mut of_scene] {
        simulation.advance(0.5, &undulation());
    }
    assert_eq!(own.state(), of_scene.state());
}

#[test]
fn a_robot_of_its_own_torque_limit_moves_as_under_that_limit() {
    let parameters = PlantParameters { torque_limit: 0.5, ..PlantParameters::default() };
    let half = ControllerConfig { torque_limit: Some(3.0), ..limited() };
    let config = RobotConfig::default();
    let mut own = robot(&config, &table_7_5(), &limited(), parameters);
    let mut of_controller = robot(&config, &table_7_5(), &half, PlantParameters::default());
    let mut strong = robot(&config, &table_7_5(), &limited(), PlantParameters::default());
    for simulation in [&mut own, &mut of_controller, &mut strong] {
        simulation.advance(0.5, &undulation());
    }
    assert_eq!(own.state(), of_controller.state());
    assert!(apart(own.state(), strong.state()) > 1e-4, "the limit matters");
}

/// Masses, gains and limits that are all twice as large cancel in every equation.
#[test]
fn a_heavier_robot_with_stronger_joints_moves_alike() {
    let parameters = PlantParameters { mass: 2.0, ..PlantParameters::default() };
    let pd = limited();
    let strong = ControllerConfig { kp: 2.0 * pd.kp, kd: 2.0 * pd.kd, torque_limit: Some(12.0), ..pd };
    let config = RobotConfig::default();
    let mut light = robot(&config, &table_7_5(), &pd, PlantParameters::default());
    let mut heavy = robot(&config, &table_7_5(), &strong, parameters);
    let mut weak = robot(&config, &table_7_5(), &pd, parameters);
    for simulation in [&mut light, &mut heavy, &mut weak] {
        simulation.advance(0.5, &undulation());
    }
    let distance = apart(light.state(), heavy.state());
    assert!(distance < 1e-6, "apart by {distance} m");
    assert!(apart(light.state(), weak.state()) > 1e-4, "the mass matters");
    for (heavy, light) in heavy.ground_impulse().iter().zip(light.ground_impulse()) {
        assert!((heavy - 2.0 * light).abs() < 1e-5, "{heavy} and twice {light}");
    }
    assert!((heavy.energy() - 2.0 * light.energy()).abs() < 1e-6);
}

/// The stopping distance of a straight robot against that of a point, integrated with small steps.
#[test]
fn a_robot_slides_farther_with_the_stribeck_effect() {
    let stribeck = Stribeck { drop: 0.5, speed: 0.1 };
    let of_robot = PlantParameters { stribeck: 0.3, ..PlantParameters::default() };
    let dry = ground([0.2, 0.2]);
    let cases = [
        (SceneConfig { stribeck, ..dry.clone() }, PlantParameters::default()),
        (SceneConfig { stribeck: Stribeck { drop: 0.2, ..stribeck }, ..dry.clone() }, of_robot),
    ];
    let (mut expected, mut v, h) = (0.0, 0.5, 1e-6);
    while v > 0.0 {
        let a = 0.2 * GRAVITY * stribeck.share(v * v);
        (expected, v) = (expected + h * (v - 0.5 * h * a), v - h * a);
    }
    let plain = 0.25 / (2.0 * 0.2 * GRAVITY);
    for (scene, parameters) in cases {
        let config = RobotConfig::default();
        let pd = ControllerConfig::default();
        let mut simulation = SpatialSimulation::new(&config, &scene, &pd, &implicit(0.005, 2)).expect("admissible");
        simulation.place_chain(
            Pose { position: Vector3::zeros(), orientation: orientation_of(0.3, 0.0, 0.0) },
            &[Vector2::zeros(); 10],
        );
        simulation.rest_on_ground();
        simulation.body_mut().parameters = parameters;
        let mut state = simulation.state().clone();
        state.twist.fill(twist_of(Vector3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0) * 0.5, Vector3::zeros()));
        simulation.place(&state);
        let start = state.pose[5].position;
        let report = simulation.advance(1.5, &still());
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        let way = (simulation.state().pose[5].position - start).norm();
        assert!((way - expected).abs() < 2e-3 * expected, "{way} instead of {expected}");
        assert!(way > 1.2 * plain, "{way} and {plain} without the effect");
    }
}

/// Links that turn against each other in the air pass no torque within the play, which the motors do not notice, and
/// never come out of it by more than the motors give way.
#[test]
fn no_torque_passes_within_the_backlash() {
    let (play, rate) = (0.1, 0.5);
    for axis in 0..2 {
        let config = RobotConfig { links: 2, backlash: play.into(), gravity: 1e-9, ..RobotConfig::default() };
        let pd = ControllerConfig::default();
        let mut simulation =
            SpatialSimulation::new(&config, &ground([0.0; 2]), &pd, &implicit(0.01, 2)).expect("admissible");
        simulation.place_chain(
            Pose { position: Vector3::z(), orientation: orientation_of(0.0, 0.0, 0.0) },
            &[Vector2::zeros()],
        );
        let mut state = simulation.state().clone();
        // Yaw turns the links about the vertical, pitch about the horizontal across them.
        let about = [Vector3::z(), -Vector3::y()][axis];
        let half = 0.5 * simulation.robot().links[0].length;
        for (side, (pose, twist)) in [-1.0, 1.0].into_iter().zip(state.pose.iter().zip(&mut state.twist)) {
            let omega = about * (side * 0.5 * rate);
            let v = omega.cross(&(pose.axis() * (side * half)));
            *twist = twist_of(v, pose.orientation.inverse_transform_vector(&omega));
        }
        simulation.place(&state);
        let angle = |simulation: &SpatialSimulation| {
            let pose = &simulation.state().pose;
            joint_angle(&pose[0], &pose[1])[axis]
        };
        simulation.advance(0.08, &still());
        assert!((angle(&simulation).abs() - 0.08 * rate).abs() < 2e-5, "turned by {}", angle(&simulation));
        assert!(simulation.joint_torque()[0].amax() < 1e-9, "{:?}", simulation.joint_torque());
        let mut most: f64 = 0.0;
        for _ in 0..1000 {
            simulation.advance(0.001, &still());
            most = most.max(angle(&simulation).abs());
        }
        assert!(most > 0.5 * play && most < 0.5 * play + 0.01, "{most} rad");
        let mut tight = SpatialSimulation::new(
            &RobotConfig { backlash: 0.0.into(), ..config },
            &ground([0.0; 2]),
            &pd,
            &implicit(0.01, 2),
        )
        .expect("admissible");
        tight.place(&state);
        tight.body_mut().parameters.backlash = play;
        tight.advance(0.08, &still());
        tight.advance(0.01, &still());
        assert!(angle(&tight).abs() > 0.4 * play, "the robot's own play counts the same");
    }
}

/// Robots that differ in everything, side by side in lanes, move as each does alone.
#[test]
fn discrepancies_of_neighbours_do_not_matter() {
    let scene = Scene::new(&ground([0.2, 0.3])).unwrap();
    let config = RobotConfig {
        backlash: each_joint(&[0.0, 0.01, 0.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.03, 0.0]),
        ..uneven_joints(10)
    };
    let system = SpatialSystem::new(Robot::new(&config).unwrap(), &scene, limited()).unwrap();
    let robot = |k: usize| {
        let x = k as f64;
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(PI, 0.0, 0.0) };
        let pegs = snake_core::obstacles::ObstacleGrid::new(&[]);
        let mut robot = SpatialScripted::new(&system.robot, pegs, head, &[Vector2::new(0.1, 0.0); 10], sidewinding());
        robot.body.parameters = PlantParameters {
            mass: 1.0 + 0.1 * x,
            friction: Vector2::new(1.0 - 0.05 * x, 1.0 + 0.2 * x),
            torque_limit: 1.0 - 0.05 * x,
            backlash: 0.01 * (k % 3) as f64,
            stribeck: 0.1 * (k % 4) as f64,
        };
        robot
    };
    let alone = alone_as_among_others(&system, implicit(0.01, 2), &[9, 13], &[0.4], 9, robot);
    assert!(alone.iter().all(|(body, _)| !body.statistics.diverged && body.statistics.unconverged == 0));
}
